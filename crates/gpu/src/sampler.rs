//! Samplers, made once for each description.

use crate::device::lock;
use crate::{Device, GpuError};
use ash::vk;
use std::collections::HashMap;
use std::sync::Mutex;

/// How a texture is filtered and addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SamplerDesc {
    /// Filter where a texel covers more than a pixel.
    pub mag: vk::Filter,
    /// Filter where a texel covers less than a pixel.
    pub min: vk::Filter,
    /// How levels are blended.
    pub mip: vk::SamplerMipmapMode,
    /// Addressing along u, v, w.
    pub address: [vk::SamplerAddressMode; 3],
    /// Most samples along the axis of anisotropy; 1 is isotropic. Lowered to what the device has.
    pub max_anisotropy: u32,
    /// Depth comparison, for shadow maps.
    pub compare: Option<vk::CompareOp>,
    /// Colour beyond the border, with border addressing.
    pub border: vk::BorderColor,
    /// The coarsest level that is read; `u32::MAX` is all.
    pub max_mip: u32,
}

impl SamplerDesc {
    /// Nearest texel of the finest level, clamped to the edge.
    pub const NEAREST: SamplerDesc = SamplerDesc {
        mag: vk::Filter::NEAREST,
        min: vk::Filter::NEAREST,
        mip: vk::SamplerMipmapMode::NEAREST,
        address: [vk::SamplerAddressMode::CLAMP_TO_EDGE; 3],
        max_anisotropy: 1,
        compare: None,
        border: vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
        max_mip: u32::MAX,
    };
    /// Linear in a level and between levels, clamped to the edge.
    pub const LINEAR: SamplerDesc = SamplerDesc {
        mag: vk::Filter::LINEAR,
        min: vk::Filter::LINEAR,
        mip: vk::SamplerMipmapMode::LINEAR,
        ..SamplerDesc::NEAREST
    };
    /// Linear in a level and between levels, repeated.
    pub const LINEAR_REPEAT: SamplerDesc =
        SamplerDesc { address: [vk::SamplerAddressMode::REPEAT; 3], ..SamplerDesc::LINEAR };
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
            (desc.max_anisotropy as f32).min(features.max_sampler_anisotropy)
        } else {
            1.0
        };
        let max_lod = if desc.max_mip == u32::MAX { vk::LOD_CLAMP_NONE } else { desc.max_mip as f32 };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(desc.mag)
            .min_filter(desc.min)
            .mipmap_mode(desc.mip)
            .address_mode_u(desc.address[0])
            .address_mode_v(desc.address[1])
            .address_mode_w(desc.address[2])
            .anisotropy_enable(anisotropy > 1.0)
            .max_anisotropy(anisotropy.max(1.0))
            .compare_enable(desc.compare.is_some())
            .compare_op(desc.compare.unwrap_or(vk::CompareOp::NEVER))
            .max_lod(max_lod)
            .border_color(desc.border);
        // SAFETY: the device is alive; anisotropy is within its limit.
        let raw =
            unsafe { self.0.raw.create_sampler(&info, None) }.map_err(GpuError::call("vkCreateSampler"))?;
        samplers.insert(*desc, raw);
        Ok(Sampler { raw, desc: *desc, _device: self.clone() })
    }
}
