//! Samplers, made once for each description.

use crate::device::lock;
use crate::{Device, GpuError};
use ash::vk;
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::sync::Mutex;

/// How a texture is filtered and addressed.
#[derive(Clone, Copy, Debug)]
pub struct SamplerDesc {
    /// Filter where a texel covers more than a pixel.
    pub mag_filter: vk::Filter,
    /// Filter where a texel covers less than a pixel.
    pub min_filter: vk::Filter,
    /// How levels are blended.
    pub mipmap_mode: vk::SamplerMipmapMode,
    /// Addressing along u.
    pub address_u: vk::SamplerAddressMode,
    /// Addressing along v.
    pub address_v: vk::SamplerAddressMode,
    /// Most samples along the axis of anisotropy; 1 is isotropic. Lowered to what the device has.
    pub max_anisotropy: f32,
    /// Depth comparison, for shadow maps.
    pub compare: Option<vk::CompareOp>,
    /// Colour beyond the border, with border addressing.
    pub border: vk::BorderColor,
    /// The coarsest level that is read; `vk::LOD_CLAMP_NONE` is all.
    pub max_lod: f32,
}

impl SamplerDesc {
    /// Nearest texel, clamped to the edge.
    pub const NEAREST: SamplerDesc = SamplerDesc {
        mag_filter: vk::Filter::NEAREST,
        min_filter: vk::Filter::NEAREST,
        mipmap_mode: vk::SamplerMipmapMode::NEAREST,
        address_u: vk::SamplerAddressMode::CLAMP_TO_EDGE,
        address_v: vk::SamplerAddressMode::CLAMP_TO_EDGE,
        max_anisotropy: 1.0,
        compare: None,
        border: vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
        max_lod: vk::LOD_CLAMP_NONE,
    };
    /// Linear in a level and between levels, clamped to the edge.
    pub const LINEAR: SamplerDesc = SamplerDesc {
        mag_filter: vk::Filter::LINEAR,
        min_filter: vk::Filter::LINEAR,
        mipmap_mode: vk::SamplerMipmapMode::LINEAR,
        ..SamplerDesc::NEAREST
    };
    /// Linear in a level and between levels, repeated.
    pub const LINEAR_REPEAT: SamplerDesc = SamplerDesc {
        address_u: vk::SamplerAddressMode::REPEAT,
        address_v: vk::SamplerAddressMode::REPEAT,
        ..SamplerDesc::LINEAR
    };

    /// All fields in kinds that can be compared; floats by their bits.
    fn key(&self) -> impl Eq + Hash + use<> {
        let filters = (self.mag_filter, self.min_filter, self.mipmap_mode);
        let floats = (self.max_anisotropy.to_bits(), self.max_lod.to_bits());
        (filters, self.address_u, self.address_v, floats, self.compare, self.border)
    }
}

impl PartialEq for SamplerDesc {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for SamplerDesc {}

impl Hash for SamplerDesc {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.key().hash(state);
    }
}

impl Default for SamplerDesc {
    fn default() -> Self {
        SamplerDesc::LINEAR
    }
}

/// A sampler. It lives as long as its device.
#[derive(Clone)]
pub struct Sampler {
    pub(crate) raw: vk::Sampler,
    desc: SamplerDesc,
    // Keeps the device, and with it the sampler.
    _device: Device,
}

impl Sampler {
    /// What it was made from.
    pub fn desc(&self) -> &SamplerDesc {
        &self.desc
    }
}

#[derive(Default)]
pub(crate) struct SamplerStore(Mutex<HashMap<SamplerDesc, vk::Sampler>>);

impl SamplerStore {
    /// # Safety
    /// No sampler may be in use any more.
    pub unsafe fn destroy(&self, device: &ash::Device) {
        for (_, sampler) in lock(&self.0).drain() {
            // SAFETY: the caller promises that none is in use.
            unsafe { device.destroy_sampler(sampler, None) };
        }
    }
}

impl Device {
    /// The sampler of this description, made at its first use.
    ///
    /// # Errors
    /// A driver that has no more samplers.
    pub fn sampler(&self, desc: &SamplerDesc) -> Result<Sampler, GpuError> {
        let mut samplers = lock(&self.0.samplers.0);
        if let Some(&raw) = samplers.get(desc) {
            return Ok(Sampler { raw, desc: *desc, _device: self.clone() });
        }
        let features = self.features();
        let anisotropy = if features.sampler_anisotropy {
            desc.max_anisotropy.min(features.max_sampler_anisotropy)
        } else {
            1.0
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(desc.mag_filter)
            .min_filter(desc.min_filter)
            .mipmap_mode(desc.mipmap_mode)
            .address_mode_u(desc.address_u)
            .address_mode_v(desc.address_v)
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .anisotropy_enable(anisotropy > 1.0)
            .max_anisotropy(anisotropy.max(1.0))
            .compare_enable(desc.compare.is_some())
            .compare_op(desc.compare.unwrap_or(vk::CompareOp::NEVER))
            .max_lod(desc.max_lod)
            .border_color(desc.border);
        // SAFETY: the device is alive; anisotropy is within its limit.
        let raw =
            unsafe { self.0.raw.create_sampler(&info, None) }.map_err(GpuError::call("vkCreateSampler"))?;
        samplers.insert(*desc, raw);
        Ok(Sampler { raw, desc: *desc, _device: self.clone() })
    }
}
