//! What clears and copies access.

use afterlight_gpu::vk;

use super::access::{Access, is_depth};
use super::resolve::Resolver;
use crate::declare::{PassKind, ResourceId, ResourceKind, Subresource, TransferNode};
use crate::error::GraphError;

impl<'a> Resolver<'a> {
    pub(super) fn transfer(&mut self) -> Result<(), GraphError> {
        let PassKind::Transfer(node) = self.pass.kind else { return Ok(()) };
        let (src, dst, dst_range, discard) = match node {
            TransferNode::FillBuffer { buffer, .. } => (None, buffer, Subresource::ALL, true),
            TransferNode::ClearImage { image, range, .. } => {
                if is_depth(self.aspects(image)) {
                    return Err(self.attachment_error(
                        "image to clear",
                        format!("the depth image {:?}", self.node(image).name),
                        "a colour image (a raster pass clears depth)".to_owned(),
                    ));
                }
                (None, image, range, true)
            }
            TransferNode::CopyBuffer { src, dst, bytes } => {
                let whole =
                    matches!(self.node(dst).kind, ResourceKind::Buffer { bytes: all } if all == bytes);
                (Some((src, Subresource::ALL)), dst, Subresource::ALL, whole)
            }
            TransferNode::CopyImage { src, dst } => {
                (Some((src, Subresource::ALL)), dst, Subresource::ALL, true)
            }
            TransferNode::CopyImageToBuffer { src, range, dst } => {
                (Some((src, range)), dst, Subresource::ALL, false)
            }
        };
        if let Some((src, range)) = src {
            self.transfer_access(src, range, false, false)?;
        }
        self.transfer_access(dst, dst_range, true, discard)
    }

    fn transfer_access(
        &mut self,
        id: ResourceId,
        range: Subresource,
        write: bool,
        discard: bool,
    ) -> Result<(), GraphError> {
        let is_image = self.info(id).is_some();
        let (access, layout) = if write {
            (vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL)
        } else {
            (vk::AccessFlags2::TRANSFER_READ, vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
        };
        match (is_image, write) {
            (true, true) => self.out.image_usage.push((id, vk::ImageUsageFlags::TRANSFER_DST)),
            (true, false) => self.out.image_usage.push((id, vk::ImageUsageFlags::TRANSFER_SRC)),
            (false, true) => self.out.buffer_usage.push((id, vk::BufferUsageFlags::TRANSFER_DST)),
            (false, false) => self.out.buffer_usage.push((id, vk::BufferUsageFlags::TRANSFER_SRC)),
        }
        let access = Access {
            resource: id,
            range: self.range(id, range)?,
            aspects: self.aspects(id),
            stages: vk::PipelineStageFlags2::ALL_TRANSFER,
            access,
            layout: if is_image { layout } else { vk::ImageLayout::UNDEFINED },
            write,
            discard,
            what: if write { "destination of a transfer" } else { "source of a transfer" },
        };
        self.out.accesses.push(access);
        Ok(())
    }
}
