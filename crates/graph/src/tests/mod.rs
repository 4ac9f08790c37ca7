//! Tests of declaration and planning, without a device.

mod checker;
mod errors;
mod history;
mod plans;

use afterlight_gpu::{GpuError, vk};
use afterlight_shader::{
    Binding, BindingKind, ImageDim, ImageShape, Interface, Reflection, Scalar, Shader, Shared, SpecConstant,
    Stage, Text,
};

use crate::{ImageInfo, MemoryNeed, Requirements};

/// Largest allocation of the made-up device.
pub const FAKE_ALLOCATION_BYTES: u64 = 1 << 30;

/// Memory as a made-up device would want it: 4 KiB pages for images, 256 bytes for buffers, a type of its own for
/// multisampled images.
pub struct FakeDevice;

impl Requirements for FakeDevice {
    fn image(&self, _: &str, info: &ImageInfo, _: vk::ImageUsageFlags) -> Result<MemoryNeed, GpuError> {
        let texels = u64::from(info.width) * u64::from(info.height) * u64::from(info.layers * info.samples);
        let bytes = (texels * 4 * 4 / 3).next_multiple_of(4096);
        Ok(MemoryNeed { bytes, alignment: 4096, type_bits: if info.samples > 1 { 2 } else { 3 } })
    }

    fn buffer(&self, _: &str, bytes: u64, _: vk::BufferUsageFlags) -> Result<MemoryNeed, GpuError> {
        Ok(MemoryNeed { bytes: bytes.next_multiple_of(256), alignment: 256, type_bits: 7 })
    }

    fn most_allocation_bytes(&self) -> u64 {
        FAKE_ALLOCATION_BYTES
    }

    fn most_groups(&self) -> [u32; 3] {
        [65_535; 3]
    }
}

/// One binding of a made-up shader: name, kind, and `r` readable, `w` writable, `a` array.
pub struct Slot(pub &'static str, pub BindingKind, pub &'static str);

pub fn shader(name: &str, stage: Stage, slots: &[Slot]) -> Shader {
    let bindings = slots
        .iter()
        .enumerate()
        .map(|(index, Slot(name, kind, mode))| Binding {
            set: 0,
            binding: index as u32,
            name: Text::Static(name),
            kind: *kind,
            count: 1,
            readable: mode.contains('r'),
            writable: mode.contains('w'),
            image: matches!(
                kind,
                BindingKind::SampledImage | BindingKind::CombinedImageSampler | BindingKind::StorageImage
            )
            .then_some(ImageShape {
                dim: ImageDim::D2,
                arrayed: mode.contains('a'),
                multisampled: false,
            }),
        })
        .collect::<Vec<_>>();
    Shader {
        name: name.into(),
        stage,
        spirv: Shared::Static(&[]),
        reflection: Reflection {
            bindings: bindings.into(),
            push_constant_bytes: 0,
            local_size: [1; 3],
            spec_constants: Vec::new().into(),
            inputs: Vec::new().into(),
            outputs: Vec::new().into(),
        },
    }
}

pub fn with_constant(mut shader: Shader, name: &'static str) -> Shader {
    let constant = SpecConstant { id: 0, name: Text::Static(name), scalar: Scalar::Uint, default_bits: 0 };
    shader.reflection.spec_constants = vec![constant].into();
    shader
}

pub fn with_push(mut shader: Shader, bytes: u32) -> Shader {
    shader.reflection.push_constant_bytes = bytes;
    shader
}

pub fn with_outputs(mut shader: Shader, count: u32) -> Shader {
    shader.reflection.outputs = (0..count)
        .map(|location| Interface {
            location,
            name: Text::Static("color"),
            components: 4,
            scalar: Scalar::Float,
        })
        .collect::<Vec<_>>()
        .into();
    shader
}
