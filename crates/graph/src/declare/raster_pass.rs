//! Raster passes: attachments and draws.

use afterlight_gpu as gpu;

use super::draw::{Draw, DrawCall, Rect};
use super::graph::Graph;
use super::handles::{BufferHandle, Handle, ImageHandle};
use super::image_info::Subresource;
use super::nodes::{
    CallNode, ColorLoad, ColorNode, DepthNode, DrawNode, Intent, PassKind, RasterCommand, RasterNode,
    SlotNode,
};
use super::slots::slots;
use crate::error::GraphError;

/// What an attachment holds when a raster pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load<T> {
    /// The given value everywhere.
    Clear(T),
    /// What earlier passes wrote.
    Keep,
    /// Anything: the pass covers every pixel that it or others read.
    DontCare,
}

/// A raster pass under declaration. Viewport and default scissor are the attachments' extent, unless
/// [`RasterPass::viewport`] sets another viewport.
pub struct RasterPass<'g> {
    pub(super) graph: &'g mut Graph,
    pub(super) pass: usize,
}

impl RasterPass<'_> {
    slots!();

    pub(super) fn node(&mut self) -> &mut RasterNode {
        match &mut self.graph.passes[self.pass].kind {
            PassKind::Raster(node) => node,
            _ => unreachable!("a raster builder holds a raster pass"),
        }
    }

    fn name(&self) -> String {
        self.graph.passes[self.pass].name.clone()
    }

    fn add_color(&mut self, image: ImageHandle, range: Subresource, load: ColorLoad) -> ImageHandle {
        let name = self.name();
        if let Some(resource) = self.graph.own(&name, &image) {
            self.node().colors.push(ColorNode { resource, range, load, resolve: None });
        }
        image
    }

    /// Adds a colour attachment; the order of the calls gives the locations. Returns its next version.
    pub fn color(&mut self, image: ImageHandle, load: Load<[f32; 4]>) -> ImageHandle {
        self.add_color(image, Subresource::mip(0), ColorLoad::Float(load))
    }

    /// Adds an unsigned integer colour attachment.
    pub fn color_uint(&mut self, image: ImageHandle, load: Load<[u32; 4]>) -> ImageHandle {
        self.add_color(image, Subresource::mip(0), ColorLoad::Uint(load))
    }

    /// Adds one level and layer of an image as a colour attachment.
    pub fn color_range(
        &mut self,
        image: ImageHandle,
        range: Subresource,
        load: Load<[f32; 4]>,
    ) -> ImageHandle {
        self.add_color(image, range, ColorLoad::Float(load))
    }

    /// Averages the samples of the colour attachment added last into `target` when the pass ends.
    pub fn resolve(&mut self, target: ImageHandle) -> ImageHandle {
        let name = self.name();
        if let Some(resource) = self.graph.own(&name, &target) {
            match self.node().colors.last_mut() {
                Some(color) => color.resolve = Some((resource, Subresource::mip(0))),
                None => self.graph.errors.push(GraphError::Attachment {
                    pass: name,
                    what: "resolve target",
                    found: "no colour attachment before it".to_owned(),
                    expected: "a colour attachment to resolve".to_owned(),
                }),
            }
        }
        target
    }

    fn set_depth(&mut self, image: &ImageHandle, depth: Option<Load<f32>>, stencil: Option<Load<u32>>) {
        let name = self.name();
        let Some(resource) = self.graph.own(&name, image) else { return };
        if self.node().depth.is_some() {
            self.graph.errors.push(GraphError::Attachment {
                pass: name,
                what: "depth attachments",
                found: "2".to_owned(),
                expected: "at most 1".to_owned(),
            });
            return;
        }
        self.node().depth = Some(DepthNode { resource, range: Subresource::mip(0), depth, stencil });
    }

    /// Adds the depth attachment, tested and written. The stencil of a depth-stencil image is kept where depth is kept,
    /// undefined otherwise; see [`RasterPass::stencil_clear`]. Returns its next version.
    pub fn depth(&mut self, image: ImageHandle, load: Load<f32>) -> ImageHandle {
        let stencil = match load {
            Load::Keep => Load::Keep,
            _ => Load::DontCare,
        };
        self.set_depth(&image, Some(load), Some(stencil));
        image
    }

    /// Adds one level and layer of a depth image as the depth attachment, tested and written.
    pub fn depth_range(&mut self, image: ImageHandle, range: Subresource, load: Load<f32>) -> ImageHandle {
        let image = self.depth(image, load);
        if let Some(depth) = &mut self.node().depth {
            depth.range = range;
        }
        image
    }

    /// Adds the depth attachment, tested and not written; shaders of the pass may sample it as well.
    pub fn depth_read_only(&mut self, image: &ImageHandle) -> &mut Self {
        self.set_depth(image, None, None);
        self
    }

    /// Adds a depth-stencil attachment whose depth is tested and whose stencil is tested and written; shaders of the pass
    /// may sample its depth (bind it before this call). Returns its next version.
    pub fn stencil(&mut self, image: ImageHandle, load: Load<u32>) -> ImageHandle {
        self.set_depth(&image, None, Some(load));
        image
    }

    /// Clears the stencil of the depth-stencil attachment when the pass begins.
    pub fn stencil_clear(&mut self, value: u32) -> &mut Self {
        let name = self.name();
        match &mut self.node().depth {
            Some(depth) if depth.stencil.is_some() => depth.stencil = Some(Load::Clear(value)),
            _ => self.graph.errors.push(GraphError::Attachment {
                pass: name,
                what: "stencil clear",
                found: "no stencil that the pass writes".to_owned(),
                expected: "a call of depth or stencil before".to_owned(),
            }),
        }
        self
    }

    /// Sets the extent in pixels of a pass without attachments.
    pub fn extent(&mut self, width_px: u32, height_px: u32) -> &mut Self {
        self.node().extent = Some((width_px, height_px));
        self
    }

    /// Sets the viewport, pixels: x, y, width, height. It may reach beyond the attachments, which then hold a part of the view.
    pub fn viewport(&mut self, rect_px: [f32; 4]) -> &mut Self {
        self.node().viewport = Some(rect_px);
        self
    }

    /// Clears the stencil between draws, everywhere or in a rectangle.
    pub fn clear_stencil(&mut self, value: u32, rect: Option<Rect>) -> &mut Self {
        self.node().commands.push(RasterCommand::ClearStencil { value, rect });
        self
    }

    /// Adds a draw.
    pub fn draw(&mut self, draw: Draw<'_>) -> &mut Self {
        let name = self.name();
        let mut foreign = false;
        let mut own = |graph: &mut Graph, handle: &BufferHandle| {
            graph.own(&name, handle).unwrap_or_else(|| {
                foreign = true;
                handle.resource
            })
        };
        let graph = &mut *self.graph;
        let vertex_buffers = draw.vertex_buffers.iter().map(|buffer| own(graph, buffer)).collect();
        let index_buffer = draw.index_buffer.map(|(buffer, index_type)| (own(graph, buffer), index_type));
        let call = match draw.call {
            DrawCall::Direct { vertices, instances, first_vertex, first_instance } => {
                CallNode::Direct { vertices, instances, first_vertex, first_instance }
            }
            DrawCall::Indexed { indices, instances, first_index, vertex_offset, first_instance } => {
                CallNode::Indexed { indices, instances, first_index, vertex_offset, first_instance }
            }
            DrawCall::IndexedIndirect { buffer, offset, count, stride } => {
                CallNode::IndexedIndirect { buffer: own(graph, buffer), offset, count, stride }
            }
            DrawCall::IndexedIndirectCount { buffer, offset, count_buffer, count_offset, max, stride } => {
                CallNode::IndexedIndirectCount {
                    buffer: own(graph, buffer),
                    offset,
                    count_buffer: own(graph, count_buffer),
                    count_offset,
                    max,
                    stride,
                }
            }
        };
        if foreign {
            return self;
        }
        let node = DrawNode {
            state: draw.pipeline,
            push: draw.push,
            vertex_buffers,
            index_buffer,
            call,
            scissor: draw.scissor,
            stencil_reference: draw.stencil_reference,
        };
        self.node().commands.push(RasterCommand::Draw(Box::new(node)));
        self
    }
}
