//! Descriptors of draws and dispatches.

use afterlight_gpu::{self as gpu, vk};
use afterlight_shader::{BindingKind, Shader};

use super::builder::Builder;
use super::commands::Bindings;
use crate::bind::{BoundSlot, TEXTURE_SET};
use crate::declare::{ResourceId, Subresource};
use crate::error::GraphError;
use crate::plan::{PlannedPass, aspects};

impl Builder<'_> {
    fn push_set(&self, pass: &PlannedPass, bindings: &[BoundSlot]) -> Result<gpu::PushSet, GraphError> {
        let mut writes = Vec::with_capacity(bindings.len());
        for bound in bindings {
            let slot = &pass.node.slots[bound.slot];
            let sampler = slot.sampler.unwrap_or(gpu::SamplerDesc::NEAREST);
            let resource = match (bound.kind, slot.resource) {
                (BindingKind::Sampler, _) | (_, None) => {
                    gpu::SlotResource::Sampler { sampler: self.device.sampler(&sampler)? }
                }
                (BindingKind::UniformBuffer, Some(id)) => gpu::SlotResource::UniformBuffer {
                    buffer: self.buffer(id).clone(),
                    offset: 0,
                    bytes: u64::MAX,
                },
                (BindingKind::StorageBuffer, Some(id)) => gpu::SlotResource::StorageBuffer {
                    buffer: self.buffer(id).clone(),
                    offset: 0,
                    bytes: u64::MAX,
                },
                (BindingKind::SampledImage, Some(id)) => {
                    let (view, layout) = self.sampled(pass, id, slot.range, bound.arrayed)?;
                    gpu::SlotResource::SampledImage { view, layout }
                }
                (BindingKind::CombinedImageSampler, Some(id)) => {
                    let (view, layout) = self.sampled(pass, id, slot.range, bound.arrayed)?;
                    gpu::SlotResource::CombinedImageSampler {
                        view,
                        layout,
                        sampler: self.device.sampler(&sampler)?,
                    }
                }
                (BindingKind::StorageImage, Some(id)) => {
                    let range = Subresource { mip_count: 1, ..slot.range };
                    let view = self.view(id, range, bound.arrayed, vk::ImageAspectFlags::COLOR)?;
                    gpu::SlotResource::StorageImage { view }
                }
            };
            writes.push(gpu::SlotWrite { binding: bound.binding, element: 0, resource });
        }
        Ok(self.device.push_set(&writes)?)
    }

    fn sampled(
        &self,
        pass: &PlannedPass,
        id: ResourceId,
        range: Subresource,
        arrayed: bool,
    ) -> Result<(gpu::ImageView, vk::ImageLayout), GraphError> {
        let format_aspects = aspects(self.image(id).format());
        let aspect = match format_aspects.contains(vk::ImageAspectFlags::DEPTH) {
            true => vk::ImageAspectFlags::DEPTH,
            false => format_aspects,
        };
        let view = self.view(id, range, arrayed, aspect)?;
        let shown = &view.desc().mips;
        let layout = pass
            .accesses
            .iter()
            .find(|access| {
                access.resource == id
                    && !access.write
                    && access.range.mip == shown.start
                    && access.range.layer == view.desc().layers.start
            })
            .map_or(vk::ImageLayout::GENERAL, |access| access.layout);
        Ok((view, layout))
    }

    pub(super) fn bindings(
        &self,
        pass: &PlannedPass,
        pipeline: gpu::Pipeline,
        slots: &[BoundSlot],
        shaders: &[&Shader],
    ) -> Result<Bindings, GraphError> {
        Ok(Bindings {
            pipeline,
            push_set: self.push_set(pass, slots)?,
            texture_set: texture_set(pass, shaders).cloned(),
        })
    }
}

pub(super) fn texture_set<'a>(pass: &'a PlannedPass, shaders: &[&Shader]) -> Option<&'a gpu::DescriptorSet> {
    let used =
        shaders.iter().flat_map(|shader| shader.reflection.bindings.iter()).any(|b| b.set == TEXTURE_SET);
    pass.node.texture_set.as_ref().filter(|_| used)
}

pub(super) fn slot_layouts(bindings: &[BoundSlot]) -> Vec<gpu::SlotLayout> {
    bindings
        .iter()
        .map(|bound| gpu::SlotLayout {
            binding: bound.binding,
            kind: match bound.kind {
                BindingKind::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
                BindingKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
                BindingKind::SampledImage => vk::DescriptorType::SAMPLED_IMAGE,
                BindingKind::CombinedImageSampler => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
                BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
                BindingKind::Sampler => vk::DescriptorType::SAMPLER,
            },
            count: 1,
            stages: bound.stages,
        })
        .collect()
}
