//! Reading kept and imported resources after a frame.

use afterlight_gpu::{self as gpu, GpuError, vk};

use super::builder::image_to_buffer;
use super::resources::Physical;
use super::{Bound, Executor, Turn};
use crate::declare::ResourceId;
use crate::error::GraphError;
use crate::plan::{Plan, aspects};

pub(super) const ANY_WRITE: gpu::Access =
    gpu::Access { stages: vk::PipelineStageFlags2::ALL_COMMANDS, access: vk::AccessFlags2::MEMORY_WRITE };
pub(super) const ANY: gpu::Access = gpu::Access {
    stages: vk::PipelineStageFlags2::ALL_COMMANDS,
    access: vk::AccessFlags2::from_raw(
        vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
    ),
};
pub(super) const COPY_READ: gpu::Access =
    gpu::Access { stages: vk::PipelineStageFlags2::ALL_TRANSFER, access: vk::AccessFlags2::TRANSFER_READ };

/// Names a resource of a plan: by its name or by its id.
pub trait ResourceKey {
    /// Returns the resource, if the plan has it.
    fn find(&self, plan: &Plan) -> Option<ResourceId>;
    /// Returns how an error message calls it.
    fn label(&self) -> String;
}

impl ResourceKey for ResourceId {
    fn find(&self, plan: &Plan) -> Option<ResourceId> {
        ((self.0 as usize) < plan.resources.len()).then_some(*self)
    }

    fn label(&self) -> String {
        format!("#{}", self.0)
    }
}

impl ResourceKey for &str {
    fn find(&self, plan: &Plan) -> Option<ResourceId> {
        plan.resource(self)
    }

    fn label(&self) -> String {
        (*self).to_owned()
    }
}

impl Executor {
    pub(super) fn find(&self, key: &impl ResourceKey) -> Result<ResourceId, GraphError> {
        let kept = |found| {
            let kept = self.plan.resources.iter().filter(|resource| resource.kept || resource.imported);
            let names: Vec<&str> = kept.map(|resource| resource.name.as_str()).collect();
            GraphError::NotReadable { name: key.label(), found, expected: names.join(", ") }
        };
        let id = key.find(&self.plan).ok_or_else(|| kept("no resource of that name"))?;
        let resource = &self.plan.resources[id.0 as usize];
        if !resource.kept && !resource.imported {
            return Err(kept("not kept: its memory may hold another resource"));
        }
        if matches!(self.bound[0].physical[id.0 as usize], Physical::Unused) {
            return Err(kept("used by no pass"));
        }
        Ok(id)
    }

    fn not_readable(&self, key: &impl ResourceKey, found: &'static str, expected: &str) -> GraphError {
        GraphError::NotReadable { name: key.label(), found, expected: expected.to_owned() }
    }

    /// Returns a buffer of the frame that was kept or imported; with history, as the last [`Executor::run`] has it.
    ///
    /// # Errors
    /// No such resource, or one that is not kept.
    pub fn buffer(&self, key: impl ResourceKey) -> Result<&gpu::Buffer, GraphError> {
        let id = self.find(&key)?;
        match &self.last_bound().physical[id.0 as usize] {
            Physical::Buffer(buffer) => Ok(buffer),
            _ => Err(self.not_readable(&key, "an image", "a buffer")),
        }
    }

    /// Returns an image of the frame that was kept or imported; with history, as the last [`Executor::run`] has it.
    ///
    /// # Errors
    /// No such resource, or one that is not kept.
    pub fn image(&self, key: impl ResourceKey) -> Result<&gpu::Image, GraphError> {
        let id = self.find(&key)?;
        match &self.last_bound().physical[id.0 as usize] {
            Physical::Image(image) => Ok(image),
            _ => Err(self.not_readable(&key, "a buffer", "an image")),
        }
    }

    /// What the last run has recorded.
    fn last_bound(&self) -> &Bound {
        self.bound(self.last.unwrap_or_default())
    }

    fn read_back(
        &self,
        bytes: u64,
        record: impl FnOnce(&mut gpu::Encoder, &gpu::Buffer) -> Result<(), GpuError>,
    ) -> Result<Vec<u8>, GraphError> {
        let target = self.device.create_buffer(&gpu::BufferDesc {
            name: "read back",
            bytes,
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: gpu::MemoryKind::Readback,
        })?;
        let mut encoder = self.device.encoder()?;
        record(&mut encoder, &target)?;
        self.device.submit(encoder)?;
        let mut out = vec![0; usize::try_from(bytes).unwrap_or(usize::MAX)];
        target.read(0, &mut out)?;
        Ok(out)
    }

    /// Reads a kept or imported buffer back, whole.
    ///
    /// # Errors
    /// No such resource, one that is not kept, or no memory.
    pub fn read_buffer(&self, key: impl ResourceKey) -> Result<Vec<u8>, GraphError> {
        let buffer = self.buffer(key)?;
        self.read_back(buffer.bytes(), |encoder, target| {
            let all = gpu::MemoryBarrier { before: ANY_WRITE, after: COPY_READ };
            encoder.barriers(&[all], &[], &[]);
            encoder.copy_buffer(buffer, 0, target, 0, buffer.bytes())
        })
    }

    /// Reads mip level 0 of a kept or imported image back: rows from top to bottom, layer after layer, tightly packed in
    /// the image's format; of a depth-stencil image the depth.
    ///
    /// # Errors
    /// No such resource, one that is not kept or has several samples, or no memory.
    pub fn read_image(&self, key: impl ResourceKey) -> Result<Vec<u8>, GraphError> {
        let copy = self.image_copy(&key, self.last.unwrap_or_default())?;
        self.read_back(copy.bytes(), |encoder, target| {
            copy.record(encoder, target, 0);
            Ok(())
        })
    }

    /// A copy of mip level 0 of a kept or imported image, as frames of a turn have it.
    pub(super) fn image_copy(&self, key: &impl ResourceKey, turn: Turn) -> Result<ImageCopy, GraphError> {
        let id = self.find(key)?;
        let image = match &self.bound(turn).physical[id.0 as usize] {
            Physical::Image(image) => image,
            _ => return Err(self.not_readable(key, "a buffer", "an image")),
        };
        if image.samples() > 1 {
            return Err(self.not_readable(
                key,
                "an image of several samples",
                "one sample (resolve it first)",
            ));
        }
        let Some(info) = gpu::format_info(image.format()) else {
            return Err(self.not_readable(key, "an image of a format of unknown size", "a known format"));
        };
        let planned = &self.plan.resources[id.0 as usize];
        let mut layouts = Vec::new();
        for layer in 0..image.layers() {
            let layout =
                planned.final_layouts.get((layer * image.mips()) as usize).copied().unwrap_or_default();
            if layout == vk::ImageLayout::UNDEFINED {
                return Err(self.not_readable(key, "a layer that no pass has written", "a written image"));
            }
            layouts.push(layout);
        }
        let layer_bytes = info.level_bytes(image.extent()[0], image.extent()[1]);
        Ok(ImageCopy { image: image.clone(), layouts, layer_bytes })
    }
}

/// A copy of an image's mip level 0 to a buffer, after which the image is as it was.
pub(super) struct ImageCopy {
    image: gpu::Image,
    /// The layout that each layer is in.
    layouts: Vec<vk::ImageLayout>,
    layer_bytes: u64,
}

impl ImageCopy {
    /// Bytes that are copied.
    pub(super) fn bytes(&self) -> u64 {
        self.layer_bytes * self.layouts.len() as u64
    }

    /// Adds a copy of the first layer to another program's commands.
    pub(super) fn to_target(
        &self,
        device: &gpu::Device,
        commands: &gpu::CallersCommands,
        target: &gpu::Target,
    ) -> Result<(), GraphError> {
        Ok(device.copy_to_target(commands, &self.image, self.layouts[0], target)?)
    }

    /// Records the copy to `offset` bytes in `target`.
    pub(super) fn record(&self, encoder: &mut gpu::Encoder, target: &gpu::Buffer, offset: u64) {
        let image = &self.image;
        let full = aspects(image.format());
        let copied =
            if full.contains(vk::ImageAspectFlags::DEPTH) { vk::ImageAspectFlags::DEPTH } else { full };
        let mut barriers = Vec::new();
        let mut regions = Vec::new();
        for (layer, layout) in (0..).zip(&self.layouts) {
            barriers.push(gpu::ImageBarrier {
                image,
                range: vk::ImageSubresourceRange {
                    aspect_mask: full,
                    base_mip_level: 0,
                    level_count: 1,
                    base_array_layer: layer,
                    layer_count: 1,
                },
                before: ANY_WRITE,
                after: COPY_READ,
                old_layout: *layout,
                new_layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            });
            let at = offset + u64::from(layer) * self.layer_bytes;
            regions.push(image_to_buffer(image, copied, 0, layer, at));
        }
        encoder.barriers(&[], &[], &barriers);
        encoder.copy_image_to_buffer(image, target, &regions);
        for barrier in &mut barriers {
            std::mem::swap(&mut barrier.old_layout, &mut barrier.new_layout);
            (barrier.before, barrier.after) = (COPY_READ, ANY);
        }
        encoder.barriers(&[], &[], &barriers);
    }
}
