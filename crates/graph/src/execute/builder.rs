//! From planned passes to passes that are ready to be recorded.

use afterlight_gpu::{self as gpu, Device, vk};

use super::commands::{Body, BoundDispatch, BoundPass};
use super::pipelines::Job;
use super::raster::clear_color;
use super::resources::Physical;
use crate::bind;
use crate::declare::{DispatchCall, PassKind, ResourceId, Subresource, TransferNode};
use crate::error::GraphError;
use crate::plan::{Plan, PlannedPass, aspects};

/// Turns planned passes into bound ones.
pub(super) struct Builder<'a> {
    pub(super) device: &'a Device,
    pub(super) plan: &'a Plan,
    pub(super) physical: &'a [Physical],
}

impl Builder<'_> {
    pub(super) fn image(&self, id: ResourceId) -> &gpu::Image {
        match &self.physical[id.0 as usize] {
            Physical::Image(image) => image,
            _ => unreachable!("the plan has checked that resource {} is a used image", id.0),
        }
    }

    pub(super) fn buffer(&self, id: ResourceId) -> &gpu::Buffer {
        match &self.physical[id.0 as usize] {
            Physical::Buffer(buffer) => buffer,
            _ => unreachable!("the plan has checked that resource {} is a used buffer", id.0),
        }
    }

    pub(super) fn view(
        &self,
        id: ResourceId,
        range: Subresource,
        arrayed: bool,
        aspect: vk::ImageAspectFlags,
    ) -> Result<gpu::ImageView, GraphError> {
        let image = self.image(id);
        let range = range.resolve(image.mips(), image.layers()).unwrap_or(Subresource::mip_layer(0, 0));
        let desc = gpu::ViewDesc {
            kind: if arrayed { gpu::ViewKind::D2Array } else { gpu::ViewKind::D2 },
            mips: range.mip..range.mip + range.mip_count,
            layers: range.layer..range.layer + range.layer_count,
            aspect,
        };
        Ok(image.view(&desc)?)
    }

    /// The passes, with pipelines that [`Builder::make_pipelines`] has made of these jobs.
    pub(super) fn passes(
        &self,
        (jobs, pipeline_of): (&[Job], &[Vec<usize>]),
        pipelines: &[gpu::Pipeline],
    ) -> Result<Vec<BoundPass>, GraphError> {
        let mut passes = Vec::with_capacity(self.plan.passes.len());
        for (index, pass) in self.plan.passes.iter().enumerate() {
            let made: Vec<(Job, gpu::Pipeline)> = jobs
                .iter()
                .zip(pipelines)
                .filter(|(job, _)| job.pass == index)
                .map(|(job, pipeline)| (*job, pipeline.clone()))
                .collect();
            passes.push(BoundPass {
                name: pass.name.clone(),
                role: pass.role,
                work: pass.work,
                barriers: self.barriers(&pass.barriers),
                body: self.body(pass, &made, &pipeline_of[index])?,
            });
        }
        Ok(passes)
    }

    fn body(
        &self,
        pass: &PlannedPass,
        pipelines: &[(Job, gpu::Pipeline)],
        pipeline_of: &[usize],
    ) -> Result<Body, GraphError> {
        match &pass.node.kind {
            PassKind::Raster(node) => self.raster(pass, node, pipelines, pipeline_of),
            PassKind::Compute(node) => {
                let bindings =
                    self.bindings(pass, pipelines[0].1.clone(), &pass.bindings[0], &[&node.shader])?;
                let declared = bind::push_bytes(&[&node.shader]) as usize;
                let dispatches = node
                    .dispatches
                    .iter()
                    .map(|dispatch| {
                        let call = match dispatch.call {
                            DispatchCall::Direct(groups) => BoundDispatch::Direct(groups),
                            DispatchCall::Indirect { buffer, offset } => {
                                BoundDispatch::Indirect(self.buffer(buffer).clone(), offset)
                            }
                        };
                        (dispatch.push[..declared].to_vec(), call)
                    })
                    .collect();
                Ok(Body::Compute { bindings, dispatches })
            }
            PassKind::Transfer(node) => Ok(self.transfer(*node)),
        }
    }

    fn transfer(&self, node: TransferNode) -> Body {
        match node {
            TransferNode::FillBuffer { buffer, value } => {
                Body::Fill { buffer: self.buffer(buffer).clone(), value }
            }
            TransferNode::ClearImage { image, color, range } => {
                let image = self.image(image).clone();
                let range =
                    range.resolve(image.mips(), image.layers()).unwrap_or(Subresource::mip_layer(0, 0));
                let range = vk::ImageSubresourceRange {
                    aspect_mask: aspects(image.format()),
                    base_mip_level: range.mip,
                    level_count: range.mip_count,
                    base_array_layer: range.layer,
                    layer_count: range.layer_count,
                };
                Body::ClearImage { value: clear_color(image.format(), color), image, range }
            }
            TransferNode::CopyBuffer { src, dst, bytes } => {
                Body::CopyBuffer { src: self.buffer(src).clone(), dst: self.buffer(dst).clone(), bytes }
            }
            TransferNode::CopyImage { src, dst } => {
                let (src, dst) = (self.image(src).clone(), self.image(dst).clone());
                let regions = (0..src.mips())
                    .map(|mip| {
                        let layers = |image: &gpu::Image| vk::ImageSubresourceLayers {
                            aspect_mask: aspects(image.format()),
                            mip_level: mip,
                            base_array_layer: 0,
                            layer_count: image.layers(),
                        };
                        let [width, height] = src.mip_extent(mip);
                        vk::ImageCopy {
                            src_subresource: layers(&src),
                            src_offset: vk::Offset3D::default(),
                            dst_subresource: layers(&dst),
                            dst_offset: vk::Offset3D::default(),
                            extent: vk::Extent3D { width, height, depth: 1 },
                        }
                    })
                    .collect();
                Body::CopyImage { src, dst, regions }
            }
            TransferNode::CopyImageToBuffer { src, range, dst } => {
                let (src, dst) = (self.image(src).clone(), self.buffer(dst).clone());
                let range = range.resolve(src.mips(), src.layers()).unwrap_or(Subresource::mip_layer(0, 0));
                let full = aspects(src.format());
                let aspect = if full.contains(vk::ImageAspectFlags::DEPTH) {
                    vk::ImageAspectFlags::DEPTH
                } else {
                    full
                };
                let [width, height] = src.mip_extent(range.mip);
                let layer_bytes =
                    gpu::format_info(src.format()).map_or(0, |info| info.level_bytes(width, height));
                let regions = (0..range.layer_count)
                    .map(|layer| {
                        image_to_buffer(
                            &src,
                            aspect,
                            range.mip,
                            range.layer + layer,
                            u64::from(layer) * layer_bytes,
                        )
                    })
                    .collect();
                Body::CopyImageToBuffer { src, dst, regions }
            }
        }
    }
}

/// A copy of one level and layer, tightly packed, to `offset` bytes in a buffer.
pub(super) fn image_to_buffer(
    image: &gpu::Image,
    aspect: vk::ImageAspectFlags,
    mip: u32,
    layer: u32,
    offset: u64,
) -> vk::BufferImageCopy {
    let [width, height] = image.mip_extent(mip);
    vk::BufferImageCopy {
        buffer_offset: offset,
        buffer_row_length: 0,
        buffer_image_height: 0,
        image_subresource: vk::ImageSubresourceLayers {
            aspect_mask: aspect,
            mip_level: mip,
            base_array_layer: layer,
            layer_count: 1,
        },
        image_offset: vk::Offset3D::default(),
        image_extent: vk::Extent3D { width, height, depth: 1 },
    }
}
