//! What a declared pass accesses: its slots by the shaders' bindings, and the kinds of its resources.

use afterlight_gpu::vk;
use afterlight_shader::{BindingKind, Shader, Stage};

use super::access::{Access, WRITES, aspects, is_depth};
use crate::bind::{self, BoundSlot};
use crate::declare::{
    DispatchCall, ImageInfo, Intent, PassKind, PassNode, RasterCommand, ResourceId, ResourceKind,
    ResourceNode, Subresource,
};
use crate::error::GraphError;

/// Shaders of every pipeline of a pass, one list a pipeline.
fn pipelines_of(pass: &PassNode) -> Vec<Vec<&Shader>> {
    match &pass.kind {
        PassKind::Raster(node) => node
            .commands
            .iter()
            .filter_map(|command| match command {
                RasterCommand::Draw(draw) => Some(draw.state.shaders()),
                RasterCommand::ClearStencil { .. } => None,
            })
            .collect(),
        PassKind::Compute(node) => vec![vec![&node.shader]],
        PassKind::Transfer(_) => Vec::new(),
    }
}

/// A pass with its slots resolved.
pub(super) struct Resolved {
    pub(super) accesses: Vec<Access>,
    pub(super) bindings: Vec<Vec<BoundSlot>>,
    pub(super) image_usage: Vec<(ResourceId, vk::ImageUsageFlags)>,
    pub(super) buffer_usage: Vec<(ResourceId, vk::BufferUsageFlags)>,
    pub(super) unused: Vec<String>,
}

pub(super) struct Resolver<'a> {
    pub(super) pass: &'a PassNode,
    pub(super) resources: &'a [ResourceNode],
    pub(super) out: Resolved,
}

impl<'a> Resolver<'a> {
    pub(super) fn node(&self, id: ResourceId) -> &'a ResourceNode {
        &self.resources[id.0 as usize]
    }

    pub(super) fn info(&self, id: ResourceId) -> Option<ImageInfo> {
        match self.node(id).kind {
            ResourceKind::Image(info) => Some(info),
            ResourceKind::Buffer { .. } => None,
        }
    }

    pub(super) fn range(&self, id: ResourceId, range: Subresource) -> Result<Subresource, GraphError> {
        let Some(info) = self.info(id) else { return Ok(Subresource::mip_layer(0, 0)) };
        range.resolve(info.mips, info.layers).ok_or_else(|| GraphError::Range {
            pass: self.pass.name.clone(),
            resource: self.node(id).name.clone(),
            found: format!(
                "mips {}+{}, layers {}+{}",
                range.mip, range.mip_count, range.layer, range.layer_count
            ),
            expected: format!("{} mips and {} layers", info.mips, info.layers),
        })
    }

    pub(super) fn aspects(&self, id: ResourceId) -> vk::ImageAspectFlags {
        self.info(id).map_or(vk::ImageAspectFlags::COLOR, |info| aspects(info.format))
    }

    pub(super) fn buffer(&mut self, id: ResourceId, usage: vk::BufferUsageFlags, access: Access) {
        self.out.buffer_usage.push((id, usage));
        self.out.accesses.push(access);
    }

    pub(super) fn fixed_buffer(
        &mut self,
        id: ResourceId,
        usage: vk::BufferUsageFlags,
        stages: vk::PipelineStageFlags2,
        access: vk::AccessFlags2,
        what: &'static str,
    ) {
        let access = Access {
            resource: id,
            range: Subresource::mip_layer(0, 0),
            aspects: vk::ImageAspectFlags::COLOR,
            stages,
            access,
            layout: vk::ImageLayout::UNDEFINED,
            write: access.intersects(WRITES),
            discard: false,
            what,
        };
        self.buffer(id, usage, access);
    }

    fn slots(&mut self) -> Result<(), GraphError> {
        let pipelines = pipelines_of(self.pass);
        let all: Vec<&Shader> = pipelines.iter().flatten().copied().collect();
        for shaders in &pipelines {
            self.out.bindings.push(bind::bind_shaders(self.pass, self.resources, shaders)?);
        }
        bind::check_reads(self.pass, &all)?;
        bind::check_writes(self.pass, &all)?;
        for (index, slot) in self.pass.slots.iter().enumerate() {
            let uses: Vec<&BoundSlot> =
                self.out.bindings.iter().flatten().filter(|bound| bound.slot == index).collect();
            if uses.is_empty() {
                self.out.unused.push(format!("{}: {}", self.pass.name, slot.slot));
                continue;
            }
            let Some(id) = slot.resource else { continue };
            let stages = uses.iter().fold(vk::ShaderStageFlags::empty(), |all, bound| all | bound.stages);
            let stages = bind::pipeline_stages(stages);
            let readable = uses.iter().any(|bound| bound.readable);
            let write = slot.intent == Intent::Write;
            let range = self.range(id, slot.range)?;
            if self.info(id).is_some() {
                self.view_fits(id, &slot.slot, range, &uses)?;
            }
            let kinds: Vec<BindingKind> = uses.iter().map(|bound| bound.kind).collect();
            self.slot_access(id, range, stages, &kinds, write, readable);
        }
        Ok(())
    }

    /// Checks that one view shows the range as the shader wants it: a storage image has one level, an image that is no
    /// array has one layer.
    fn view_fits(
        &self,
        id: ResourceId,
        slot: &str,
        range: Subresource,
        uses: &[&BoundSlot],
    ) -> Result<(), GraphError> {
        let name = &self.node(id).name;
        let one_level = uses.iter().any(|bound| bound.kind == BindingKind::StorageImage);
        let one_layer = uses.iter().any(|bound| !bound.arrayed);
        let (found, expected) = if one_level && range.mip_count != 1 {
            (format!("{} mip levels of {name:?}", range.mip_count), "1 level (a storage image)")
        } else if one_layer && range.layer_count != 1 {
            (format!("{} layers of {name:?}", range.layer_count), "1 layer (the shader's image is no array)")
        } else {
            return Ok(());
        };
        Err(GraphError::Range {
            pass: self.pass.name.clone(),
            resource: format!("{name} in slot {slot}"),
            found,
            expected: expected.to_owned(),
        })
    }

    fn slot_access(
        &mut self,
        id: ResourceId,
        range: Subresource,
        stages: vk::PipelineStageFlags2,
        kinds: &[BindingKind],
        write: bool,
        readable: bool,
    ) {
        let mut access = vk::AccessFlags2::NONE;
        let mut storage = false;
        let mut aspects = self.aspects(id);
        for kind in kinds {
            match kind {
                BindingKind::UniformBuffer => {
                    access |= vk::AccessFlags2::UNIFORM_READ;
                    self.out.buffer_usage.push((id, vk::BufferUsageFlags::UNIFORM_BUFFER));
                }
                BindingKind::StorageBuffer => {
                    storage = true;
                    self.out.buffer_usage.push((id, vk::BufferUsageFlags::STORAGE_BUFFER));
                }
                BindingKind::StorageImage => {
                    storage = true;
                    self.out.image_usage.push((id, vk::ImageUsageFlags::STORAGE));
                }
                BindingKind::SampledImage | BindingKind::CombinedImageSampler => {
                    access |= vk::AccessFlags2::SHADER_SAMPLED_READ;
                    self.out.image_usage.push((id, vk::ImageUsageFlags::SAMPLED));
                }
                BindingKind::Sampler => {}
            }
        }
        if storage {
            if readable || !write {
                access |= vk::AccessFlags2::SHADER_STORAGE_READ;
            }
            if write {
                access |= vk::AccessFlags2::SHADER_STORAGE_WRITE;
            }
        }
        let layout = match self.info(id) {
            None => vk::ImageLayout::UNDEFINED,
            Some(_) if storage => vk::ImageLayout::GENERAL,
            Some(_) if is_depth(aspects) => {
                // Shaders sample the depth of a depth-stencil image.
                if aspects.contains(vk::ImageAspectFlags::DEPTH) {
                    aspects = vk::ImageAspectFlags::DEPTH;
                }
                vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL
            }
            Some(_) => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        };
        let what = match (storage, write) {
            (true, true) => "storage written by shaders",
            (true, false) => "storage read by shaders",
            (false, _) => "input of shaders",
        };
        self.out.accesses.push(Access {
            resource: id,
            range,
            aspects,
            stages,
            access,
            layout,
            write,
            discard: false,
            what,
        });
    }

    fn compute(&mut self) -> Result<(), GraphError> {
        let PassKind::Compute(node) = &self.pass.kind else { return Ok(()) };
        bind::check_stage(&self.pass.name, &node.shader, Stage::Compute, "Compute")?;
        for dispatch in &node.dispatches {
            bind::check_constants(&self.pass.name, &[&node.shader], &node.constants, &dispatch.push)?;
            if let DispatchCall::Indirect { buffer, .. } = dispatch.call {
                self.indirect(buffer);
            }
        }
        Ok(())
    }
}

pub(super) fn resolve_pass(pass: &PassNode, resources: &[ResourceNode]) -> Result<Resolved, GraphError> {
    let out = Resolved {
        accesses: Vec::new(),
        bindings: Vec::new(),
        image_usage: Vec::new(),
        buffer_usage: Vec::new(),
        unused: Vec::new(),
    };
    let mut resolver = Resolver { pass, resources, out };
    match &pass.kind {
        PassKind::Raster(_) => resolver.raster()?,
        PassKind::Compute(_) => resolver.compute()?,
        PassKind::Transfer(_) => resolver.transfer()?,
    }
    resolver.slots()?;
    Ok(resolver.out)
}
