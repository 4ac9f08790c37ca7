//! How a pass uses a part of a resource: stages, access bits, layout.

use afterlight_gpu::vk;

use crate::declare::{ImageInfo, ResourceId, Subresource};

/// Access bits that write.
pub(super) const WRITES: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::SHADER_WRITE.as_raw()
        | vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
        | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::TRANSFER_WRITE.as_raw()
        | vk::AccessFlags2::HOST_WRITE.as_raw()
        | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
);

/// One use of a part of a resource by a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// The resource.
    pub resource: ResourceId,
    /// Levels and layers of an image; level 0 and layer 0 of a buffer.
    pub range: Subresource,
    /// Aspects of an image; colour for buffers.
    pub aspects: vk::ImageAspectFlags,
    /// Stages that access it.
    pub stages: vk::PipelineStageFlags2,
    /// How they access it.
    pub access: vk::AccessFlags2,
    /// Layout of the image during the pass; `UNDEFINED` for buffers.
    pub layout: vk::ImageLayout,
    /// Whether the pass writes it.
    pub write: bool,
    /// Whether earlier contents do not matter.
    pub discard: bool,
    /// How an error message calls this use.
    pub what: &'static str,
}

/// Returns the aspects of a format.
pub(crate) fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    match format {
        vk::Format::D16_UNORM | vk::Format::D32_SFLOAT | vk::Format::X8_D24_UNORM_PACK32 => {
            vk::ImageAspectFlags::DEPTH
        }
        vk::Format::S8_UINT => vk::ImageAspectFlags::STENCIL,
        vk::Format::D16_UNORM_S8_UINT | vk::Format::D24_UNORM_S8_UINT | vk::Format::D32_SFLOAT_S8_UINT => {
            vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL
        }
        _ => vk::ImageAspectFlags::COLOR,
    }
}

pub(super) fn is_depth(aspects: vk::ImageAspectFlags) -> bool {
    aspects.intersects(vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL)
}

pub(super) fn color_access(
    resource: ResourceId,
    range: Subresource,
    discard: bool,
    what: &'static str,
) -> Access {
    Access {
        resource,
        range,
        aspects: vk::ImageAspectFlags::COLOR,
        stages: vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        access: vk::AccessFlags2::COLOR_ATTACHMENT_READ | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
        layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        write: true,
        discard,
        what,
    }
}

/// Extent in pixels of a mip level.
pub(crate) fn mip_extent(info: &ImageInfo, mip: u32) -> (u32, u32) {
    let shrink = |size: u32| (size.checked_shr(mip).unwrap_or(0)).max(1);
    (shrink(info.width), shrink(info.height))
}
