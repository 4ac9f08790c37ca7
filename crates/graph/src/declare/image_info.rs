//! Format and extents of images, and ranges of their levels and layers.

use afterlight_gpu::vk;

/// Format and extents of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageInfo {
    /// Texel format.
    pub format: vk::Format,
    /// Width of level 0 in pixels, at least 1.
    pub width: u32,
    /// Height of level 0 in pixels, at least 1.
    pub height: u32,
    /// Array layers, at least 1.
    pub layers: u32,
    /// Mip levels, at least 1.
    pub mips: u32,
    /// Samples a pixel: a power of two.
    pub samples: u32,
}

impl ImageInfo {
    /// Describes an image of one layer, one level and one sample.
    pub fn new(format: vk::Format, width: u32, height: u32) -> Self {
        Self { format, width, height, layers: 1, mips: 1, samples: 1 }
    }

    /// Returns the same with `samples` samples a pixel.
    pub fn samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// Returns the same with `mips` mip levels.
    pub fn mips(self, mips: u32) -> Self {
        Self { mips, ..self }
    }

    /// Returns the same with `layers` array layers.
    pub fn layers(self, layers: u32) -> Self {
        Self { layers, ..self }
    }
}

/// A range of mip levels and array layers of an image; `u32::MAX` counts mean "the rest".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Subresource {
    /// First mip level.
    pub mip: u32,
    /// Number of mip levels.
    pub mip_count: u32,
    /// First array layer.
    pub layer: u32,
    /// Number of array layers.
    pub layer_count: u32,
}

impl Subresource {
    /// Every level and layer.
    pub const ALL: Self = Self { mip: 0, mip_count: u32::MAX, layer: 0, layer_count: u32::MAX };

    /// One mip level, every layer.
    pub const fn mip(mip: u32) -> Self {
        Self { mip, mip_count: 1, ..Self::ALL }
    }

    /// One array layer, every level.
    pub const fn layer(layer: u32) -> Self {
        Self { layer, layer_count: 1, ..Self::ALL }
    }

    /// One mip level of one layer.
    pub const fn mip_layer(mip: u32, layer: u32) -> Self {
        Self { mip, mip_count: 1, layer, layer_count: 1 }
    }

    /// Replaces open counts by what the image has; `None` where the range leaves the image.
    pub(crate) fn resolve(self, mips: u32, layers: u32) -> Option<Self> {
        let close = |first: u32, count: u32, all: u32| match count {
            u32::MAX if first < all => Some(all - first),
            0 => None,
            _ if first.checked_add(count).is_some_and(|end| end <= all) => Some(count),
            _ => None,
        };
        Some(Self {
            mip: self.mip,
            mip_count: close(self.mip, self.mip_count, mips)?,
            layer: self.layer,
            layer_count: close(self.layer, self.layer_count, layers)?,
        })
    }
}
