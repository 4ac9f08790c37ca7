//! What a format occupies.

use ash::vk;

/// The memory layout of a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FormatInfo {
    /// Bytes of one block (one texel where the format is not compressed); for depth with stencil, of the depth aspect as copied.
    pub block_bytes: u32,
    /// Width and height of a block in texels; 1×1 where the format is not compressed.
    pub block_texels: [u32; 2],
    /// The aspects that an image of the format has.
    pub aspect: vk::ImageAspectFlags,
}

impl FormatInfo {
    /// Bytes of a tightly packed level of `width` × `height` texels, as copied to or from a buffer.
    pub fn level_bytes(&self, width: u32, height: u32) -> u64 {
        let columns = u64::from(width.div_ceil(self.block_texels[0]));
        let rows = u64::from(height.div_ceil(self.block_texels[1]));
        columns * rows * u64::from(self.block_bytes)
    }
}

/// The memory layout of `format`; `None` for a format that the workbench does not use.
///
/// Source: Vulkan 1.3 specification, "Compatible Formats" table.
pub fn format_info(format: vk::Format) -> Option<FormatInfo> {
    use vk::Format as F;
    let color = vk::ImageAspectFlags::COLOR;
    let depth = vk::ImageAspectFlags::DEPTH;
    let stencil = vk::ImageAspectFlags::STENCIL;
    let (block_bytes, block, aspect) = match format {
        F::R8_UNORM | F::R8_SNORM | F::R8_UINT | F::R8_SINT | F::R8_SRGB => (1, 1, color),
        F::R8G8_UNORM | F::R8G8_SNORM | F::R8G8_UINT | F::R8G8_SINT | F::R8G8_SRGB => (2, 1, color),
        F::R16_UNORM | F::R16_SNORM | F::R16_UINT | F::R16_SINT | F::R16_SFLOAT => (2, 1, color),
        F::R8G8B8A8_UNORM
        | F::R8G8B8A8_SNORM
        | F::R8G8B8A8_UINT
        | F::R8G8B8A8_SINT
        | F::R8G8B8A8_SRGB
        | F::B8G8R8A8_UNORM
        | F::B8G8R8A8_SRGB
        | F::A2B10G10R10_UNORM_PACK32
        | F::A2B10G10R10_UINT_PACK32
        | F::B10G11R11_UFLOAT_PACK32
        | F::E5B9G9R9_UFLOAT_PACK32
        | F::R16G16_UNORM
        | F::R16G16_SNORM
        | F::R16G16_UINT
        | F::R16G16_SINT
        | F::R16G16_SFLOAT
        | F::R32_UINT
        | F::R32_SINT
        | F::R32_SFLOAT => (4, 1, color),
        F::R16G16B16A16_UNORM
        | F::R16G16B16A16_SNORM
        | F::R16G16B16A16_UINT
        | F::R16G16B16A16_SINT
        | F::R16G16B16A16_SFLOAT
        | F::R32G32_UINT
        | F::R32G32_SINT
        | F::R32G32_SFLOAT
        | F::R64_UINT
        | F::R64_SINT => (8, 1, color),
        F::R32G32B32_UINT | F::R32G32B32_SINT | F::R32G32B32_SFLOAT => (12, 1, color),
        F::R32G32B32A32_UINT | F::R32G32B32A32_SINT | F::R32G32B32A32_SFLOAT => (16, 1, color),
        F::BC1_RGB_UNORM_BLOCK
        | F::BC1_RGB_SRGB_BLOCK
        | F::BC1_RGBA_UNORM_BLOCK
        | F::BC1_RGBA_SRGB_BLOCK
        | F::BC4_UNORM_BLOCK
        | F::BC4_SNORM_BLOCK => (8, 4, color),
        F::BC2_UNORM_BLOCK
        | F::BC2_SRGB_BLOCK
        | F::BC3_UNORM_BLOCK
        | F::BC3_SRGB_BLOCK
        | F::BC5_UNORM_BLOCK
        | F::BC5_SNORM_BLOCK
        | F::BC6H_UFLOAT_BLOCK
        | F::BC6H_SFLOAT_BLOCK
        | F::BC7_UNORM_BLOCK
        | F::BC7_SRGB_BLOCK => (16, 4, color),
        F::D16_UNORM => (2, 1, depth),
        F::D32_SFLOAT | F::X8_D24_UNORM_PACK32 => (4, 1, depth),
        F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT => (4, 1, depth | stencil),
        F::S8_UINT => (1, 1, stencil),
        _ => return None,
    };
    Some(FormatInfo { block_bytes, block_texels: [block, block], aspect })
}

/// The aspects of any format: from the table, colour where it is not listed.
pub(crate) fn aspect_of(format: vk::Format) -> vk::ImageAspectFlags {
    format_info(format).map_or(vk::ImageAspectFlags::COLOR, |f| f.aspect)
}

/// Whether colour values of the format are integers (they have sample counts of their own).
pub(crate) fn is_integer(format: vk::Format) -> bool {
    let name = format!("{format:?}");
    name.contains("UINT") || name.contains("SINT")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_bytes_rounds_blocks_up() {
        let bc7 = format_info(vk::Format::BC7_UNORM_BLOCK).expect("listed");
        assert_eq!(bc7.level_bytes(5, 1), 32);
        let rgba8 = format_info(vk::Format::R8G8B8A8_UNORM).expect("listed");
        assert_eq!(rgba8.level_bytes(17, 3), 204);
        assert!(format_info(vk::Format::G8B8G8R8_422_UNORM).is_none());
    }

    #[test]
    fn aspects_follow_the_format() {
        assert_eq!(aspect_of(vk::Format::D32_SFLOAT), vk::ImageAspectFlags::DEPTH);
        assert!(is_integer(vk::Format::R32_UINT));
        assert!(!is_integer(vk::Format::R32_SFLOAT));
    }
}
