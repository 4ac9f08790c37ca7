//! Recording a frame that is ready.

use afterlight_gpu::{self as gpu, GpuError, vk};

use super::raster::rect_2d;
use crate::declare::{Commands, Rect, Step};

use super::commands::{
    BarrierList, Bindings, Body, BoundCall, BoundCommand, BoundDispatch, ColorTarget, DepthTarget,
    DrawCommand,
};

impl BarrierList {
    pub(super) fn record(&self, encoder: &mut gpu::Encoder) {
        let images: Vec<gpu::ImageBarrier<'_>> = self
            .images
            .iter()
            .map(|one| gpu::ImageBarrier {
                image: &one.image,
                range: one.range,
                before: one.before,
                after: one.after,
                old_layout: one.old_layout,
                new_layout: one.new_layout,
            })
            .collect();
        encoder.barriers(self.memory.as_slice(), &[], &images);
    }
}

impl Bindings {
    pub(super) fn record(&self, encoder: &mut gpu::Encoder) {
        encoder.bind_pipeline(&self.pipeline);
        encoder.push_descriptors(&self.push_set);
        if let Some(set) = &self.texture_set {
            encoder.bind_descriptor_set(set);
        }
    }
}

impl Body {
    /// `scripts` holds the steps of each script.
    pub(super) fn record(&self, encoder: &mut gpu::Encoder, scripts: &[Vec<Step>]) -> Result<(), GpuError> {
        match self {
            Body::Raster { extent, viewport, layers, colors, depth, pipelines, commands, script } => {
                begin(encoder, *extent, *layers, colors, depth.as_ref());
                if let Some(rect_px) = viewport {
                    encoder.set_viewport(*rect_px, [0.0, 1.0]);
                }
                let mut bound = usize::MAX;
                let mut make = |encoder: &mut gpu::Encoder, draw: &DrawCommand, changed: &Changed| {
                    if bound != draw.pipeline {
                        pipelines[draw.pipeline].record(encoder);
                        bound = draw.pipeline;
                    }
                    draw.record(encoder, changed);
                };
                match script {
                    None => {
                        for command in commands {
                            match command {
                                BoundCommand::ClearStencil { value, rect } => {
                                    encoder.clear_stencil(*value, *rect, *layers)
                                }
                                BoundCommand::Draw(draw) => make(encoder, draw, &Changed::default()),
                            }
                        }
                    }
                    Some(script) => {
                        let steps = scripts.get(script.0 as usize).map_or(&[][..], Vec::as_slice);
                        for step in steps {
                            match *step {
                                Step::ClearStencil(value) => {
                                    encoder.clear_stencil(value, rect_2d(whole(*extent), *extent), *layers);
                                }
                                Step::Draw { draw, scissor, stencil_reference, push, commands: range } => {
                                    let scissor = scissor.map(|rect| rect_2d(rect, *extent));
                                    let changed = Changed { scissor, stencil_reference, push, range };
                                    match commands.get(draw as usize) {
                                        Some(BoundCommand::Draw(draw)) => make(encoder, draw, &changed),
                                        _ => panic!("a script makes draw {draw} of {}", commands.len()),
                                    }
                                }
                            }
                        }
                    }
                }
                encoder.end_rendering();
            }
            Body::Compute { bindings, dispatches } => {
                bindings.record(encoder);
                for (push, call) in dispatches {
                    encoder.push_constants(push);
                    match call {
                        BoundDispatch::Direct(groups) => encoder.dispatch(*groups),
                        BoundDispatch::Indirect(buffer, offset) => encoder.dispatch_indirect(buffer, *offset),
                    }
                }
            }
            Body::Fill { buffer, value } => encoder.fill_buffer(buffer, *value),
            Body::ClearImage { image, value, range } => {
                encoder.clear_color_image(image, vk::ImageLayout::TRANSFER_DST_OPTIMAL, *value, *range);
            }
            Body::CopyBuffer { src, dst, bytes } => encoder.copy_buffer(src, 0, dst, 0, *bytes)?,
            Body::CopyImage { src, dst, regions } => encoder.copy_image(src, dst, regions),
            Body::CopyImageToBuffer { src, dst, regions } => encoder.copy_image_to_buffer(src, dst, regions),
        }
        Ok(())
    }
}

fn begin(
    encoder: &mut gpu::Encoder,
    extent: [u32; 2],
    layers: u32,
    colors: &[ColorTarget],
    depth: Option<&DepthTarget>,
) {
    let colors: Vec<gpu::ColorAttachment<'_>> = colors
        .iter()
        .map(|color| gpu::ColorAttachment {
            view: &color.view,
            load: color.load,
            store: true,
            resolve: color
                .resolve
                .as_ref()
                .map(|view| gpu::Resolve { view, mode: vk::ResolveModeFlags::AVERAGE }),
        })
        .collect();
    encoder.begin_rendering(&gpu::Rendering {
        extent,
        layers,
        colors: &colors,
        depth: depth.and_then(|target| {
            target.depth.map(|(load, store)| gpu::DepthAttachment {
                view: &target.view,
                layout: target.layout,
                load,
                store,
            })
        }),
        stencil: depth.and_then(|target| {
            target.stencil.map(|(load, store)| gpu::StencilAttachment {
                view: &target.view,
                layout: target.layout,
                load,
                store,
            })
        }),
    });
}

/// What a script changes of a draw.
#[derive(Default)]
pub(super) struct Changed {
    scissor: Option<vk::Rect2D>,
    stencil_reference: Option<u32>,
    push: Option<u32>,
    range: Option<Commands>,
}

/// The whole of an attachment.
fn whole([width_px, height_px]: [u32; 2]) -> Rect {
    Rect { x_px: 0, y_px: 0, width_px, height_px }
}

impl DrawCommand {
    pub(super) fn record(&self, encoder: &mut gpu::Encoder, changed: &Changed) {
        encoder.set_scissor(changed.scissor.unwrap_or(self.scissor));
        encoder.set_cull_mode(self.cull);
        encoder.set_front_face(self.front_face);
        if self.depth_bias_slope != 0.0 {
            encoder.set_depth_bias(0.0, 0.0, self.depth_bias_slope);
        }
        encoder.set_stencil_reference(changed.stencil_reference.unwrap_or(self.stencil_reference));
        encoder.push_constants(&self.push);
        if let Some(word) = changed.push
            && !self.push.is_empty()
        {
            encoder.push_constants(&word.to_ne_bytes());
        }
        if !self.vertex_buffers.is_empty() {
            let buffers: Vec<(&gpu::Buffer, u64)> =
                self.vertex_buffers.iter().map(|buffer| (buffer, 0)).collect();
            encoder.bind_vertex_buffers(0, &buffers);
        }
        if let Some((buffer, index_type)) = &self.index_buffer {
            encoder.bind_index_buffer(buffer, 0, *index_type);
        }
        match &self.call {
            BoundCall::Direct { vertices, instances, first_vertex, first_instance } => {
                encoder.draw(*vertices, *instances, *first_vertex, *first_instance);
            }
            BoundCall::Indexed { indices, instances, first_index, vertex_offset, first_instance } => {
                encoder.draw_indexed(*indices, *instances, *first_index, *vertex_offset, *first_instance);
            }
            BoundCall::IndexedIndirect { buffer, offset, count, stride } => {
                encoder.draw_indexed_indirect(buffer, *offset, *count, *stride);
            }
            BoundCall::IndexedIndirectCount { buffer, offset, count_buffer, count_offset, max, stride } => {
                let declared = Commands { offset: *offset, count_offset: *count_offset, max: *max };
                let Commands { offset, count_offset, max } = changed.range.unwrap_or(declared);
                encoder.draw_indexed_indirect_count(buffer, offset, count_buffer, count_offset, max, *stride);
            }
        }
    }
}
