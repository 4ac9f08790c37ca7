//! Passes that clear or copy.

use afterlight_roles::PassRole;

use super::graph::Graph;
use super::handles::{BufferHandle, Handle, ImageHandle, ResourceId};
use super::image_info::{ImageInfo, Subresource};
use super::nodes::{PassKind, TransferNode};
use crate::error::GraphError;

impl Graph {
    fn transfer(&mut self, name: &str, role: PassRole, handles: &[&dyn HandleDyn], node: TransferNode) {
        for handle in handles {
            let (graph, resource) = handle.parts_dyn();
            if graph != self.id {
                let found = format!("#{}", resource.0);
                self.errors.push(GraphError::ForeignHandle { pass: name.to_owned(), found });
                return;
            }
        }
        self.pass(name, role, PassKind::Transfer(node));
    }

    /// Fills a buffer with a 32-bit word; its size is rounded down to whole words.
    pub fn clear_buffer(
        &mut self,
        name: &str,
        role: PassRole,
        buffer: BufferHandle,
        value: u32,
    ) -> BufferHandle {
        self.transfer(name, role, &[&buffer], TransferNode::FillBuffer { buffer: buffer.resource, value });
        buffer
    }

    /// Clears a colour image, every level and layer.
    pub fn clear_image(
        &mut self,
        name: &str,
        role: PassRole,
        image: ImageHandle,
        color: [f32; 4],
    ) -> ImageHandle {
        self.clear_image_range(name, role, image, Subresource::ALL, color)
    }

    /// Clears levels and layers of a colour image.
    pub fn clear_image_range(
        &mut self,
        name: &str,
        role: PassRole,
        image: ImageHandle,
        range: Subresource,
        color: [f32; 4],
    ) -> ImageHandle {
        let node = TransferNode::ClearImage { image: image.resource, color, range };
        self.transfer(name, role, &[&image], node);
        image
    }

    /// Copies the start of one buffer to the start of another: as many bytes as both have.
    pub fn copy_buffer(
        &mut self,
        name: &str,
        role: PassRole,
        src: &BufferHandle,
        dst: BufferHandle,
    ) -> BufferHandle {
        let bytes = src.bytes.min(dst.bytes);
        let node = TransferNode::CopyBuffer { src: src.resource, dst: dst.resource, bytes };
        self.transfer(name, role, &[src, &dst], node);
        dst
    }

    /// Copies an image to one of the same extents and a compatible format.
    pub fn copy_image(
        &mut self,
        name: &str,
        role: PassRole,
        src: &ImageHandle,
        dst: ImageHandle,
    ) -> ImageHandle {
        let same = |a: ImageInfo, b: ImageInfo| {
            (a.width, a.height, a.layers, a.mips, a.samples)
                == (b.width, b.height, b.layers, b.mips, b.samples)
        };
        if !same(src.info, dst.info) {
            self.errors.push(GraphError::Attachment {
                pass: name.to_owned(),
                what: "extents of the copy's destination",
                found: format!("{:?}", dst.info),
                expected: format!("{:?}", src.info),
            });
        }
        let node = TransferNode::CopyImage { src: src.resource, dst: dst.resource };
        self.transfer(name, role, &[src, &dst], node);
        dst
    }

    /// Copies one mip level (of all layers in the range) of an image, tightly packed, to the start of a buffer.
    pub fn copy_image_to_buffer(
        &mut self,
        name: &str,
        role: PassRole,
        src: &ImageHandle,
        range: Subresource,
        dst: BufferHandle,
    ) -> BufferHandle {
        let node = TransferNode::CopyImageToBuffer { src: src.resource, range, dst: dst.resource };
        self.transfer(name, role, &[src, &dst], node);
        dst
    }
}

/// [`Handle`] behind a reference of unknown kind.
trait HandleDyn {
    fn parts_dyn(&self) -> (u64, ResourceId);
}

impl<T: Handle> HandleDyn for T {
    fn parts_dyn(&self) -> (u64, ResourceId) {
        self.parts()
    }
}
