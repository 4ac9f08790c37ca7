//! Attachments and draws of raster passes.

use afterlight_gpu::{self as gpu, vk};

use super::builder::Builder;
use super::commands::{Bindings, Body, BoundCall, BoundCommand, ColorTarget, DepthTarget, DrawCommand};
use super::pipelines::Job;
use crate::bind;
use crate::declare::{
    CallNode, ColorLoad, ColorNode, DepthNode, DrawNode, ImageInfo, Load, RasterCommand, RasterNode, Rect,
    ResourceId, Subresource,
};
use crate::error::GraphError;
use crate::plan::{PlannedPass, aspects, mip_extent};

impl Builder<'_> {
    fn color_target(&self, color: &ColorNode) -> Result<ColorTarget, GraphError> {
        let layered = self.layers_of(color.resource, color.range) > 1;
        let view = self.view(color.resource, color.range, layered, vk::ImageAspectFlags::COLOR)?;
        let load = match color.load {
            ColorLoad::Float(Load::Clear(value)) => gpu::Load::Clear(gpu::ClearColor::Float(value)),
            ColorLoad::Uint(Load::Clear(value)) => gpu::Load::Clear(gpu::ClearColor::Uint(value)),
            ColorLoad::Float(Load::Keep) | ColorLoad::Uint(Load::Keep) => gpu::Load::Keep,
            ColorLoad::Float(Load::DontCare) | ColorLoad::Uint(Load::DontCare) => gpu::Load::DontCare,
        };
        let resolve = match color.resolve {
            Some((target, range)) => Some(self.view(target, range, layered, vk::ImageAspectFlags::COLOR)?),
            None => None,
        };
        Ok(ColorTarget { view, load, resolve })
    }

    fn layers_of(&self, id: ResourceId, range: Subresource) -> u32 {
        let image = self.image(id);
        range.resolve(image.mips(), image.layers()).map_or(1, |range| range.layer_count)
    }

    fn depth_target(&self, pass: &PlannedPass, depth: &DepthNode) -> Result<DepthTarget, GraphError> {
        let format_aspects = aspects(self.image(depth.resource).format());
        let layered = self.layers_of(depth.resource, depth.range) > 1;
        let view = self.view(depth.resource, depth.range, layered, format_aspects)?;
        let access = pass.accesses.iter().find(|access| {
            access.resource == depth.resource
                && matches!(access.what, "depth attachment" | "stencil attachment")
        });
        let layout = access.map_or(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL, |access| access.layout);
        fn load<T>(from: Option<Load<T>>) -> (gpu::Load<T>, bool) {
            match from {
                Some(Load::Clear(value)) => (gpu::Load::Clear(value), true),
                Some(Load::DontCare) => (gpu::Load::DontCare, true),
                Some(Load::Keep) => (gpu::Load::Keep, true),
                None => (gpu::Load::Keep, true),
            }
        }
        Ok(DepthTarget {
            view,
            layout,
            depth: format_aspects.contains(vk::ImageAspectFlags::DEPTH).then(|| load(depth.depth)),
            stencil: format_aspects.contains(vk::ImageAspectFlags::STENCIL).then(|| load(depth.stencil)),
        })
    }

    pub(super) fn raster(
        &self,
        pass: &PlannedPass,
        node: &RasterNode,
        pipelines: &[(Job, gpu::Pipeline)],
        pipeline_of: &[usize],
    ) -> Result<Body, GraphError> {
        let attached = node.colors.first().map(|color| (color.resource, color.range));
        let attached = attached.or(node.depth.as_ref().map(|depth| (depth.resource, depth.range)));
        let (extent, layers) = match attached {
            Some((id, range)) => {
                let image = self.image(id);
                let info = ImageInfo::new(image.format(), image.extent()[0], image.extent()[1]);
                let (width, height) = mip_extent(&info, range.mip);
                ([width, height], self.layers_of(id, range))
            }
            None => (node.extent.map_or([1, 1], |(width, height)| [width, height]), 1),
        };
        let all = Rect { x_px: 0, y_px: 0, width_px: extent[0], height_px: extent[1] };
        let draw_list: Vec<&DrawNode> = draws(node).collect();
        let bound: Vec<Bindings> = pipelines
            .iter()
            .map(|(job, pipeline)| {
                let shaders = draw_list[job.draw].state.shaders();
                self.bindings(pass, pipeline.clone(), &pass.bindings[job.draw], &shaders)
            })
            .collect::<Result<_, _>>()?;
        let mut next_draw = 0;
        let commands = node
            .commands
            .iter()
            .map(|command| match command {
                RasterCommand::ClearStencil { value, rect } => {
                    BoundCommand::ClearStencil { value: *value, rect: rect_2d(rect.unwrap_or(all), extent) }
                }
                RasterCommand::Draw(draw) => {
                    let pipeline = pipeline_of[next_draw];
                    next_draw += 1;
                    BoundCommand::Draw(Box::new(self.draw(draw, pipeline, all, extent)))
                }
            })
            .collect();
        Ok(Body::Raster {
            extent,
            viewport: node.viewport,
            layers,
            colors: node.colors.iter().map(|color| self.color_target(color)).collect::<Result<_, _>>()?,
            depth: node.depth.as_ref().map(|depth| self.depth_target(pass, depth)).transpose()?,
            pipelines: bound,
            commands,
            script: node.script,
        })
    }

    pub(super) fn draw(&self, draw: &DrawNode, pipeline: usize, all: Rect, extent: [u32; 2]) -> DrawCommand {
        let declared = bind::push_bytes(&draw.state.shaders()) as usize;
        let call = match draw.call {
            CallNode::Direct { vertices, instances, first_vertex, first_instance } => {
                BoundCall::Direct { vertices, instances, first_vertex, first_instance }
            }
            CallNode::Indexed { indices, instances, first_index, vertex_offset, first_instance } => {
                BoundCall::Indexed { indices, instances, first_index, vertex_offset, first_instance }
            }
            CallNode::IndexedIndirect { buffer, offset, count, stride } => {
                BoundCall::IndexedIndirect { buffer: self.buffer(buffer).clone(), offset, count, stride }
            }
            CallNode::IndexedIndirectCount { buffer, offset, count_buffer, count_offset, max, stride } => {
                BoundCall::IndexedIndirectCount {
                    buffer: self.buffer(buffer).clone(),
                    offset,
                    count_buffer: self.buffer(count_buffer).clone(),
                    count_offset,
                    max,
                    stride,
                }
            }
        };
        DrawCommand {
            pipeline,
            push: draw.push[..declared].to_vec(),
            cull: draw.state.cull,
            front_face: draw.state.front_face,
            depth_bias_slope: draw.state.depth_bias_slope,
            stencil_reference: draw.stencil_reference,
            scissor: rect_2d(draw.scissor.unwrap_or(all), extent),
            vertex_buffers: draw.vertex_buffers.iter().map(|id| self.buffer(*id).clone()).collect(),
            index_buffer: draw.index_buffer.map(|(id, index_type)| (self.buffer(id).clone(), index_type)),
            call,
        }
    }
}

pub(super) fn draws(node: &RasterNode) -> impl Iterator<Item = &DrawNode> {
    node.commands.iter().filter_map(|command| match command {
        RasterCommand::Draw(draw) => Some(&**draw),
        RasterCommand::ClearStencil { .. } => None,
    })
}

/// A clear value in the kind of the format; integer formats take the rounded numbers.
pub(super) fn clear_color(format: vk::Format, color: [f32; 4]) -> gpu::ClearColor {
    let name = format!("{format:?}");
    if name.contains("UINT") {
        gpu::ClearColor::Uint(color.map(|value| value as u32))
    } else if name.contains("SINT") {
        gpu::ClearColor::Sint(color.map(|value| value as i32))
    } else {
        gpu::ClearColor::Float(color)
    }
}

/// A rectangle cut to the attachment, as Vulkan wants it.
pub(super) fn rect_2d(rect: Rect, extent: [u32; 2]) -> vk::Rect2D {
    let (x, y) = (rect.x_px.min(extent[0]), rect.y_px.min(extent[1]));
    vk::Rect2D {
        offset: vk::Offset2D { x: x.cast_signed(), y: y.cast_signed() },
        extent: vk::Extent2D {
            width: rect.width_px.min(extent[0] - x),
            height: rect.height_px.min(extent[1] - y),
        },
    }
}
