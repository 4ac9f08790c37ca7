//! Recording a frame that is ready.

use afterlight_gpu::{self as gpu, GpuError, vk};

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
    pub(super) fn record(&self, encoder: &mut gpu::Encoder) -> Result<(), GpuError> {
        match self {
            Body::Raster { extent, viewport, layers, colors, depth, pipelines, commands } => {
                begin(encoder, *extent, *layers, colors, depth.as_ref());
                if let Some(rect_px) = viewport {
                    encoder.set_viewport(*rect_px, [0.0, 1.0]);
                }
                let mut bound = usize::MAX;
                for command in commands {
                    match command {
                        BoundCommand::ClearStencil { value, rect } => {
                            encoder.clear_stencil(*value, *rect, *layers)
                        }
                        BoundCommand::Draw(draw) => {
                            if bound != draw.pipeline {
                                pipelines[draw.pipeline].record(encoder);
                                bound = draw.pipeline;
                            }
                            draw.record(encoder);
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

impl DrawCommand {
    pub(super) fn record(&self, encoder: &mut gpu::Encoder) {
        encoder.set_scissor(self.scissor);
        encoder.set_cull_mode(self.cull);
        encoder.set_front_face(self.front_face);
        if self.depth_bias_slope != 0.0 {
            encoder.set_depth_bias(0.0, 0.0, self.depth_bias_slope);
        }
        encoder.set_stencil_reference(self.stencil_reference);
        encoder.push_constants(&self.push);
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
                encoder.draw_indexed_indirect_count(
                    buffer,
                    *offset,
                    count_buffer,
                    *count_offset,
                    *max,
                    *stride,
                );
            }
        }
    }
}
