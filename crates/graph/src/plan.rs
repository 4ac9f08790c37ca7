//! The pure planner: from a declared frame to passes in order, barriers, lifetimes, places in memory and bytes.
//!
//! Passes keep the order in which they were declared; those whose results nobody uses are dropped. For each part of a
//! resource (a mip level of a layer; a buffer whole) the planner follows the last write, the stages that have read since
//! and to whom the write is visible, and puts before a pass the least barrier that its accesses need. The first read
//! after a write makes it visible to all reads up to the next write, so that they need no barrier of their own.

use std::collections::BTreeMap;

use afterlight_gpu::{GpuError, vk};
use afterlight_roles::{BufferRole, PassRole, PassWork};
use afterlight_shader::{BindingKind, Shader, Stage};

use crate::bind::{self, BoundSlot};
use crate::declare::{
    CallNode, DispatchCall, Graph, ImageInfo, Import, Intent, Load, PassKind, PassNode, RasterCommand,
    ResourceId, ResourceKind, ResourceNode, Subresource, TransferNode,
};
use crate::error::GraphError;

/// What a resource needs of memory, as the device says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryNeed {
    /// Size in bytes.
    pub bytes: u64,
    /// Alignment of its offset in bytes: a power of two.
    pub alignment: u64,
    /// Memory types it may live in, as a bit mask.
    pub type_bits: u32,
}

/// Answers what images and buffers need of memory: a device, or a stand-in for tests.
pub trait Requirements {
    /// Returns what an image of that description and usage needs.
    ///
    /// # Errors
    /// The device cannot make such an image.
    fn image(&self, name: &str, info: &ImageInfo, usage: vk::ImageUsageFlags)
    -> Result<MemoryNeed, GpuError>;

    /// Returns what a buffer of that size and usage needs.
    ///
    /// # Errors
    /// The device cannot make such a buffer.
    fn buffer(&self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> Result<MemoryNeed, GpuError>;
}

/// Access bits that write.
const WRITES: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::SHADER_WRITE.as_raw()
        | vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
        | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::TRANSFER_WRITE.as_raw()
        | vk::AccessFlags2::HOST_WRITE.as_raw()
        | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
);

/// One barrier of a plan. Without a resource it is a memory barrier: the memory changes its owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// The resource; `None` where memory passes from one resource to another.
    pub resource: Option<ResourceId>,
    /// Levels and layers of an image; level 0 and layer 0 of a buffer.
    pub range: Subresource,
    /// Stages that must have finished.
    pub src_stages: vk::PipelineStageFlags2,
    /// Writes that are made available.
    pub src_access: vk::AccessFlags2,
    /// Stages that wait.
    pub dst_stages: vk::PipelineStageFlags2,
    /// Accesses to which the writes become visible.
    pub dst_access: vk::AccessFlags2,
    /// Layout before; `UNDEFINED` drops the contents. Equal to the new layout where there is no transition.
    pub old_layout: vk::ImageLayout,
    /// Layout after; `UNDEFINED` for buffers and memory.
    pub new_layout: vk::ImageLayout,
}

/// One use of a part of a resource by a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// The resource.
    pub resource: ResourceId,
    /// Levels and layers of an image; level 0 and layer 0 of a buffer.
    pub range: Subresource,
    /// Aspects of an image; colour for buffers.
    pub aspects: vk::ImageAspectFlags,
    /// Stages that access it.
    pub stages: vk::PipelineStageFlags2,
    /// How they access it.
    pub access: vk::AccessFlags2,
    /// Layout of the image during the pass; `UNDEFINED` for buffers.
    pub layout: vk::ImageLayout,
    /// Whether the pass writes it.
    pub write: bool,
    /// Whether earlier contents do not matter.
    pub discard: bool,
    /// How an error message calls this use.
    pub what: &'static str,
}

/// A pass of a plan.
#[derive(Clone)]
pub struct PlannedPass {
    /// The pass's name.
    pub name: String,
    /// What it is for.
    pub role: PassRole,
    /// By what kind of commands the device does it.
    pub work: PassWork,
    /// Barriers before the pass.
    pub barriers: Vec<Barrier>,
    /// What the pass uses.
    pub accesses: Vec<Access>,
    pub(crate) node: PassNode,
    /// Descriptors of each draw (raster) or of the one shader (compute).
    pub(crate) bindings: Vec<Vec<BoundSlot>>,
}

/// Where a transient resource lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// Index into [`Plan::heaps`].
    pub heap: usize,
    /// Offset in the heap in bytes.
    pub offset: u64,
}

/// A resource that the frame allocates, as one pass uses it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Traffic<'a> {
    /// The resource's name.
    pub name: &'a str,
    /// What it holds.
    pub role: BufferRole,
    /// Bytes by the device's memory requirements, of the whole resource.
    pub bytes: u64,
    /// Whether the pass reads what stood there before it.
    pub read: bool,
    /// Whether it writes.
    pub written: bool,
}

/// A resource of a plan.
#[derive(Clone)]
pub struct PlannedResource {
    /// The resource's name.
    pub name: String,
    /// What it holds.
    pub role: BufferRole,
    /// What it needs of memory; zero bytes for imported and unused resources.
    pub need: MemoryNeed,
    /// First and last pass (indices into [`Plan::passes`]) that use it; kept resources last to the end. `None` is unused.
    pub lifetime: Option<(usize, usize)>,
    /// Its place; `None` for imported and unused resources.
    pub placement: Option<Placement>,
    /// Whether it was kept to be read back.
    pub kept: bool,
    /// Whether it is the final colour target.
    pub output: bool,
    /// Whether it lives outside the graph.
    pub imported: bool,
    /// Usage that the passes need, for images.
    pub image_usage: vk::ImageUsageFlags,
    /// Usage that the passes need, for buffers.
    pub buffer_usage: vk::BufferUsageFlags,
    pub(crate) kind: ResourceKind,
    pub(crate) import: Option<Import>,
    /// Layout of each part after the frame (`layer * mips + mip`).
    pub(crate) final_layouts: Vec<vk::ImageLayout>,
}

impl PlannedResource {
    /// Returns whether it belongs to work that techniques share.
    pub fn shared(&self) -> bool {
        self.role.is_shared()
    }
}

/// Memory that transient resources share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedHeap {
    /// Size in bytes.
    pub bytes: u64,
    /// Alignment of the heap's start in bytes.
    pub alignment: u64,
    /// Memory types it may be of.
    pub type_bits: u32,
}

/// A frame ready to be executed.
#[derive(Clone)]
pub struct Plan {
    /// Passes in the order in which they run.
    pub passes: Vec<PlannedPass>,
    /// Every declared resource.
    pub resources: Vec<PlannedResource>,
    /// Memory that transient resources share.
    pub heaps: Vec<PlannedHeap>,
    /// Barriers after the last pass: imported images return to their layout.
    pub final_barriers: Vec<Barrier>,
    /// Names of passes that were dropped since nobody uses their results.
    pub dropped: Vec<String>,
    /// Slots that a pass binds for reading and none of its shaders has, as `pass: slot`.
    pub unused_slots: Vec<String>,
}

impl Plan {
    /// Returns the resource of that name.
    pub fn resource(&self, name: &str) -> Option<ResourceId> {
        let index = self.resources.iter().position(|resource| resource.name == name)?;
        u32::try_from(index).ok().map(ResourceId)
    }

    /// What a pass reads and writes of the resources that the frame allocates, each once, in the order of first use; imported ones are
    /// left out. How much of each it touches the plan does not know.
    pub fn traffic(&self, pass: &PlannedPass) -> Vec<Traffic<'_>> {
        let mut traffic: Vec<Traffic<'_>> = Vec::new();
        for access in &pass.accesses {
            let resource = &self.resources[access.resource.0 as usize];
            if resource.imported {
                continue;
            }
            let index = traffic.iter().position(|one| one.name == resource.name).unwrap_or_else(|| {
                let (name, role, bytes) = (resource.name.as_str(), resource.role, resource.need.bytes);
                traffic.push(Traffic { name, role, bytes, read: false, written: false });
                traffic.len() - 1
            });
            let reads = !access.discard && access.access.as_raw() & !WRITES.as_raw() != 0;
            traffic[index].read |= reads;
            traffic[index].written |= access.write;
        }
        traffic
    }

    /// Bytes of all heaps: the most that the frame's transient resources hold at once, as allocated.
    pub fn peak_bytes(&self) -> u64 {
        self.heaps.iter().map(|heap| heap.bytes).sum()
    }

    /// Bytes of everything that the technique allocates: without imported resources, the final colour target, and
    /// resources whose role is shared work. Aliased resources count in full.
    pub fn technique_bytes(&self) -> u64 {
        self.resources
            .iter()
            .filter(|resource| !resource.imported && !resource.output && !resource.shared())
            .map(|resource| resource.need.bytes)
            .sum()
    }
}

/// Returns the aspects of a format.
pub(crate) fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    match format {
        vk::Format::D16_UNORM | vk::Format::D32_SFLOAT | vk::Format::X8_D24_UNORM_PACK32 => {
            vk::ImageAspectFlags::DEPTH
        }
        vk::Format::S8_UINT => vk::ImageAspectFlags::STENCIL,
        vk::Format::D16_UNORM_S8_UINT | vk::Format::D24_UNORM_S8_UINT | vk::Format::D32_SFLOAT_S8_UINT => {
            vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL
        }
        _ => vk::ImageAspectFlags::COLOR,
    }
}

fn is_depth(aspects: vk::ImageAspectFlags) -> bool {
    aspects.intersects(vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL)
}

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
struct Resolved {
    accesses: Vec<Access>,
    bindings: Vec<Vec<BoundSlot>>,
    image_usage: Vec<(ResourceId, vk::ImageUsageFlags)>,
    buffer_usage: Vec<(ResourceId, vk::BufferUsageFlags)>,
    unused: Vec<String>,
}

struct Resolver<'a> {
    pass: &'a PassNode,
    resources: &'a [ResourceNode],
    out: Resolved,
}

impl<'a> Resolver<'a> {
    fn node(&self, id: ResourceId) -> &'a ResourceNode {
        &self.resources[id.0 as usize]
    }

    fn info(&self, id: ResourceId) -> Option<ImageInfo> {
        match self.node(id).kind {
            ResourceKind::Image(info) => Some(info),
            ResourceKind::Buffer { .. } => None,
        }
    }

    fn range(&self, id: ResourceId, range: Subresource) -> Result<Subresource, GraphError> {
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

    fn aspects(&self, id: ResourceId) -> vk::ImageAspectFlags {
        self.info(id).map_or(vk::ImageAspectFlags::COLOR, |info| aspects(info.format))
    }

    fn buffer(&mut self, id: ResourceId, usage: vk::BufferUsageFlags, access: Access) {
        self.out.buffer_usage.push((id, usage));
        self.out.accesses.push(access);
    }

    fn fixed_buffer(
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

    fn attachment_error(&self, what: &'static str, found: String, expected: String) -> GraphError {
        GraphError::Attachment { pass: self.pass.name.clone(), what, found, expected }
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

    fn raster(&mut self) -> Result<(), GraphError> {
        let PassKind::Raster(node) = &self.pass.kind else { return Ok(()) };
        let mut extent: Option<(u32, u32)> = node.extent;
        let mut samples: Option<u32> = None;
        let attach = |resolver: &Self, id: ResourceId, range: Subresource, is_color: bool| {
            let name = &resolver.node(id).name;
            let Some(info) = resolver.info(id) else {
                return Err(resolver.attachment_error(
                    "attachment",
                    format!("the buffer {name:?}"),
                    "an image".to_owned(),
                ));
            };
            if is_color == is_depth(aspects(info.format)) {
                let expected = if is_color { "a colour format" } else { "a depth format" };
                return Err(resolver.attachment_error(
                    "attachment's format",
                    format!("{:?} of {name:?}", info.format),
                    expected.to_owned(),
                ));
            }
            let range = resolver.range(id, range)?;
            if range.mip_count != 1 {
                return Err(resolver.attachment_error(
                    "mip levels of the attachment",
                    range.mip_count.to_string(),
                    "1".to_owned(),
                ));
            }
            Ok((info, range))
        };
        let fits = |resolver: &Self,
                    id: ResourceId,
                    size: (u32, u32),
                    count: u32,
                    extent: &mut Option<(u32, u32)>,
                    samples: &mut Option<u32>| {
            let name = &resolver.node(id).name;
            let first = *extent.get_or_insert(size);
            if first != size {
                return Err(resolver.attachment_error(
                    "extent of an attachment",
                    format!("{}x{} of {name:?}", size.0, size.1),
                    format!("{}x{}, as the attachment before", first.0, first.1),
                ));
            }
            let first = *samples.get_or_insert(count);
            if first != count {
                return Err(resolver.attachment_error(
                    "samples of an attachment",
                    format!("{count} of {name:?}"),
                    format!("{first}, as the attachment before"),
                ));
            }
            Ok(())
        };
        for color in &node.colors {
            let (info, range) = attach(self, color.resource, color.range, true)?;
            fits(
                self,
                color.resource,
                mip_extent(&info, range.mip),
                info.samples,
                &mut extent,
                &mut samples,
            )?;
            self.out.image_usage.push((color.resource, vk::ImageUsageFlags::COLOR_ATTACHMENT));
            self.out.accesses.push(color_access(
                color.resource,
                range,
                !color.load.keeps(),
                "colour attachment",
            ));
            if let Some((target, target_range)) = color.resolve {
                let (target_info, target_range) = attach(self, target, target_range, true)?;
                if (target_info.format, target_info.samples) != (info.format, 1)
                    || mip_extent(&target_info, target_range.mip) != mip_extent(&info, range.mip)
                    || info.samples == 1
                {
                    return Err(self.attachment_error(
                        "resolve target",
                        format!("{target_info:?} for {info:?}"),
                        "one sample, the attachment's format and extent, and an attachment of several samples"
                            .to_owned(),
                    ));
                }
                self.out.image_usage.push((target, vk::ImageUsageFlags::COLOR_ATTACHMENT));
                self.out.accesses.push(color_access(target, target_range, true, "resolve target"));
            }
        }
        if let Some(depth) = &node.depth {
            let (info, range) = attach(self, depth.resource, depth.range, false)?;
            fits(
                self,
                depth.resource,
                mip_extent(&info, range.mip),
                info.samples,
                &mut extent,
                &mut samples,
            )?;
            self.out.image_usage.push((depth.resource, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT));
            self.depth_accesses(depth, range, aspects(info.format))?;
        }
        if extent.is_none() {
            return Err(self.attachment_error(
                "attachments",
                "none, and no extent".to_owned(),
                "at least one attachment, or an extent".to_owned(),
            ));
        }
        self.draws(node)
    }

    fn depth_accesses(
        &mut self,
        depth: &crate::declare::DepthNode,
        range: Subresource,
        format_aspects: vk::ImageAspectFlags,
    ) -> Result<(), GraphError> {
        let has_stencil = format_aspects.contains(vk::ImageAspectFlags::STENCIL);
        let clears_stencil = matches!(depth.stencil, Some(Load::Clear(_)));
        if !has_stencil && (clears_stencil || depth.depth.is_none() && depth.stencil.is_some()) {
            return Err(self.attachment_error(
                "stencil of the depth attachment",
                format!("a format without stencil in {:?}", self.node(depth.resource).name),
                "a format with stencil, such as D32_SFLOAT_S8_UINT".to_owned(),
            ));
        }
        let mut push = |aspect: vk::ImageAspectFlags, write: bool, keeps: bool| {
            if !format_aspects.contains(aspect) {
                return;
            }
            let mut access = vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ;
            if write {
                access |= vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE;
            }
            self.out.accesses.push(Access {
                resource: depth.resource,
                range,
                aspects: aspect,
                stages: vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS
                    | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS,
                access,
                layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
                write,
                discard: write && !keeps,
                what: if aspect == vk::ImageAspectFlags::DEPTH {
                    "depth attachment"
                } else {
                    "stencil attachment"
                },
            });
        };
        let depth_keeps = matches!(depth.depth, Some(Load::Keep));
        let stencil_keeps = matches!(depth.stencil, Some(Load::Keep));
        push(vk::ImageAspectFlags::DEPTH, depth.depth.is_some(), depth_keeps);
        push(vk::ImageAspectFlags::STENCIL, depth.stencil.is_some(), stencil_keeps);
        Ok(())
    }

    fn draws(&mut self, node: &crate::declare::RasterNode) -> Result<(), GraphError> {
        let color_count = node.colors.len();
        for command in &node.commands {
            let draw = match command {
                RasterCommand::Draw(draw) => draw,
                RasterCommand::ClearStencil { .. } => {
                    let writes = node.depth.as_ref().is_some_and(|depth| {
                        depth.stencil.is_some()
                            && self.aspects(depth.resource).contains(vk::ImageAspectFlags::STENCIL)
                    });
                    if !writes {
                        return Err(self.attachment_error(
                            "stencil clear between draws",
                            "no stencil attachment that the pass writes".to_owned(),
                            "a call of depth or stencil with a format with stencil".to_owned(),
                        ));
                    }
                    continue;
                }
            };
            self.draw_state(node, draw, color_count)?;
            for id in &draw.vertex_buffers {
                self.fixed_buffer(
                    *id,
                    vk::BufferUsageFlags::VERTEX_BUFFER,
                    vk::PipelineStageFlags2::VERTEX_ATTRIBUTE_INPUT,
                    vk::AccessFlags2::VERTEX_ATTRIBUTE_READ,
                    "vertex buffer",
                );
            }
            if let Some((id, _)) = draw.index_buffer {
                self.fixed_buffer(
                    id,
                    vk::BufferUsageFlags::INDEX_BUFFER,
                    vk::PipelineStageFlags2::INDEX_INPUT,
                    vk::AccessFlags2::INDEX_READ,
                    "index buffer",
                );
            }
            let indirect = match draw.call {
                CallNode::Direct { .. } | CallNode::Indexed { .. } => [None, None],
                CallNode::Indirect { buffer, .. } | CallNode::IndexedIndirect { buffer, .. } => {
                    [Some(buffer), None]
                }
                CallNode::IndexedIndirectCount { buffer, count_buffer, .. } => {
                    [Some(buffer), Some(count_buffer)]
                }
            };
            for id in indirect.into_iter().flatten() {
                self.indirect(id);
            }
        }
        Ok(())
    }

    fn indirect(&mut self, id: ResourceId) {
        self.fixed_buffer(
            id,
            vk::BufferUsageFlags::INDIRECT_BUFFER,
            vk::PipelineStageFlags2::DRAW_INDIRECT,
            vk::AccessFlags2::INDIRECT_COMMAND_READ,
            "indirect arguments",
        );
    }

    fn draw_state(
        &self,
        node: &crate::declare::RasterNode,
        draw: &crate::declare::DrawNode,
        color_count: usize,
    ) -> Result<(), GraphError> {
        let state = &draw.state;
        let pass = &self.pass.name;
        bind::check_stage(pass, &state.vertex, Stage::Vertex, "Vertex")?;
        if let Some((control, evaluation)) = &state.tessellation {
            bind::check_stage(pass, control, Stage::TessControl, "TessControl")?;
            bind::check_stage(pass, evaluation, Stage::TessEvaluation, "TessEvaluation")?;
            if state.topology != vk::PrimitiveTopology::TRIANGLE_LIST {
                return Err(self.attachment_error(
                    "topology of a draw with tessellation",
                    format!("{:?}", state.topology),
                    "TRIANGLE_LIST, a patch a triangle".to_owned(),
                ));
            }
        }
        if let Some(geometry) = &state.geometry {
            bind::check_stage(pass, geometry, Stage::Geometry, "Geometry")?;
        }
        if let Some(fragment) = &state.fragment {
            bind::check_stage(pass, fragment, Stage::Fragment, "Fragment")?;
            let beyond =
                fragment.reflection.outputs.iter().find(|output| output.location as usize >= color_count);
            if let Some(output) = beyond {
                return Err(self.attachment_error(
                    "output of the fragment shader",
                    format!(
                        "{:?} of {} at location {}",
                        output.name.as_str(),
                        fragment.name,
                        output.location
                    ),
                    format!("a location below {color_count}, the number of colour attachments"),
                ));
            }
        }
        if !state.blend.is_empty() && state.blend.len() != color_count {
            return Err(self.attachment_error(
                "blend entries",
                state.blend.len().to_string(),
                format!("{color_count}, one a colour attachment, or none"),
            ));
        }
        let writes_depth = node.depth.as_ref().is_some_and(|depth| depth.depth.is_some());
        let writes_stencil = node.depth.as_ref().is_some_and(|depth| depth.stencil.is_some());
        if state.depth.write && !writes_depth {
            return Err(self.attachment_error(
                "depth test",
                "a draw that writes depth".to_owned(),
                "a depth attachment that the pass writes (RasterPass::depth)".to_owned(),
            ));
        }
        if state.stencil.is_some_and(|stencil| stencil.writes()) && !writes_stencil {
            return Err(self.attachment_error(
                "stencil test",
                "a draw that writes the stencil".to_owned(),
                "a stencil that the pass writes (RasterPass::stencil or depth)".to_owned(),
            ));
        }
        for input in &state.vertex.reflection.inputs {
            if !state.layout.attributes.iter().any(|attribute| attribute.location == input.location) {
                return Err(GraphError::MissingAttribute {
                    pass: pass.clone(),
                    shader: state.vertex.name.to_string(),
                    input: input.name.to_string(),
                    location: input.location,
                });
            }
        }
        if draw.vertex_buffers.len() != state.layout.streams.len() {
            return Err(self.attachment_error(
                "vertex buffers of a draw",
                draw.vertex_buffers.len().to_string(),
                format!("{}, the layout's streams", state.layout.streams.len()),
            ));
        }
        let indexed = !matches!(draw.call, CallNode::Direct { .. } | CallNode::Indirect { .. });
        if indexed && draw.index_buffer.is_none() {
            return Err(self.attachment_error(
                "index buffer of an indexed draw",
                "none".to_owned(),
                "an index buffer".to_owned(),
            ));
        }
        bind::check_constants(pass, &state.shaders(), &state.constants, &draw.push)
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

    fn transfer(&mut self) -> Result<(), GraphError> {
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

fn color_access(resource: ResourceId, range: Subresource, discard: bool, what: &'static str) -> Access {
    Access {
        resource,
        range,
        aspects: vk::ImageAspectFlags::COLOR,
        stages: vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        access: vk::AccessFlags2::COLOR_ATTACHMENT_READ | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
        layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        write: true,
        discard,
        what,
    }
}

/// Extent in pixels of a mip level.
pub(crate) fn mip_extent(info: &ImageInfo, mip: u32) -> (u32, u32) {
    let shrink = |size: u32| (size.checked_shr(mip).unwrap_or(0)).max(1);
    (shrink(info.width), shrink(info.height))
}

fn resolve_pass(pass: &PassNode, resources: &[ResourceNode]) -> Result<Resolved, GraphError> {
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

/// A part of a resource: its level and layer (`layer * mips + mip`), or 0 for a buffer.
type Cell = (ResourceId, usize);

/// The one use that a pass makes of a part of a resource.
#[derive(Clone, Copy, Debug)]
struct CellUse {
    stages: vk::PipelineStageFlags2,
    access: vk::AccessFlags2,
    layout: vk::ImageLayout,
    write: bool,
    discard: bool,
    /// Whether earlier contents are read.
    reads: bool,
    read_aspects: vk::ImageAspectFlags,
    write_aspects: vk::ImageAspectFlags,
    what: &'static str,
}

fn mips_of(kind: &ResourceKind) -> usize {
    match kind {
        ResourceKind::Image(info) => info.mips as usize,
        ResourceKind::Buffer { .. } => 1,
    }
}

fn cell_count(kind: &ResourceKind) -> usize {
    match kind {
        ResourceKind::Image(info) => info.mips as usize * info.layers as usize,
        ResourceKind::Buffer { .. } => 1,
    }
}

fn cells_of(range: &Subresource, mips: usize) -> impl Iterator<Item = usize> + use<> {
    let range = *range;
    (range.layer as usize..(range.layer + range.layer_count) as usize).flat_map(move |layer| {
        (range.mip as usize..(range.mip + range.mip_count) as usize).map(move |mip| layer * mips + mip)
    })
}

/// Joins a pass's uses of each part; two uses that exclude each other are an error.
fn join_uses(
    pass: &str,
    accesses: &[Access],
    resources: &[ResourceNode],
) -> Result<BTreeMap<Cell, CellUse>, GraphError> {
    let mut uses: BTreeMap<Cell, CellUse> = BTreeMap::new();
    for access in accesses {
        let node = &resources[access.resource.0 as usize];
        let none = vk::ImageAspectFlags::empty();
        let one = CellUse {
            stages: access.stages,
            access: access.access,
            layout: access.layout,
            write: access.write,
            discard: access.discard,
            reads: !access.write || (!access.discard && access.access.intersects(!WRITES)),
            read_aspects: if access.write { none } else { access.aspects },
            write_aspects: if access.write { access.aspects } else { none },
            what: access.what,
        };
        for cell in cells_of(&access.range, mips_of(&node.kind)) {
            match uses.get_mut(&(access.resource, cell)) {
                None => {
                    uses.insert((access.resource, cell), one);
                }
                Some(first) => join(first, &one).map_err(|()| GraphError::Conflict {
                    pass: pass.to_owned(),
                    resource: node.name.clone(),
                    first: first.what.to_owned(),
                    second: one.what.to_owned(),
                })?,
            }
        }
    }
    for ((id, _), cell_use) in &mut uses {
        if let ResourceKind::Image(info) = resources[id.0 as usize].kind {
            settle_depth_layout(cell_use, aspects(info.format));
        }
    }
    Ok(uses)
}

/// Joins two uses of one part by one pass.
fn join(first: &mut CellUse, second: &CellUse) -> Result<(), ()> {
    let storage = vk::AccessFlags2::SHADER_STORAGE_READ | vk::AccessFlags2::SHADER_STORAGE_WRITE;
    let overlap = first.write_aspects.intersects(second.write_aspects | second.read_aspects)
        || second.write_aspects.intersects(first.read_aspects);
    let both_storage_writes =
        first.write && second.write && storage.contains(first.access) && storage.contains(second.access);
    if overlap && !both_storage_writes {
        return Err(());
    }
    if first.layout != second.layout {
        let depth = |layout| {
            matches!(
                layout,
                vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL
                    | vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL
            )
        };
        let shader =
            |layout| matches!(layout, vk::ImageLayout::GENERAL | vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        first.layout = if depth(first.layout) && depth(second.layout) {
            vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL
        } else if shader(first.layout) && shader(second.layout) {
            vk::ImageLayout::GENERAL
        } else {
            return Err(());
        };
    }
    first.stages |= second.stages;
    first.access |= second.access;
    // Depth and stencil are one part: contents may be dropped only where both aspects allow it.
    first.discard &= second.discard;
    first.write |= second.write;
    first.reads |= second.reads;
    first.read_aspects |= second.read_aspects;
    first.write_aspects |= second.write_aspects;
    Ok(())
}

/// Picks the layout of a depth image from which aspects the pass writes.
fn settle_depth_layout(cell_use: &mut CellUse, format_aspects: vk::ImageAspectFlags) {
    let attachment =
        vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE;
    if !is_depth(format_aspects) || !cell_use.access.intersects(attachment) {
        return;
    }
    let depth = cell_use.write_aspects.contains(vk::ImageAspectFlags::DEPTH);
    let stencil = cell_use.write_aspects.contains(vk::ImageAspectFlags::STENCIL);
    cell_use.layout = match (depth, stencil) {
        (false, false) => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        (false, true) => vk::ImageLayout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL,
        (true, _) => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    };
}

/// Finds the passes whose results are used, from the last to the first.
fn live_passes(graph: &Graph, uses: &[BTreeMap<Cell, CellUse>]) -> Vec<bool> {
    let mut wanted: BTreeMap<Cell, bool> = BTreeMap::new();
    for (index, resource) in graph.resources.iter().enumerate() {
        let id = ResourceId(index as u32);
        for cell in 0..cell_count(&resource.kind) {
            wanted.insert((id, cell), resource.kept || resource.import.is_some());
        }
    }
    let mut live = vec![false; graph.passes.len()];
    for (index, pass) in graph.passes.iter().enumerate().rev() {
        let used = uses[index].iter().any(|(cell, cell_use)| cell_use.write && wanted[cell]);
        if !used && !pass.has_effect {
            continue;
        }
        live[index] = true;
        for (cell, cell_use) in &uses[index] {
            let needs_before = cell_use.reads || cell_use.write && !cell_use.discard && wanted[cell];
            wanted.insert(*cell, needs_before);
        }
    }
    live
}

fn check_reads_after_writes(
    graph: &Graph,
    uses: &[BTreeMap<Cell, CellUse>],
    accesses: &[Resolved],
) -> Result<(), GraphError> {
    let mut written: BTreeMap<Cell, vk::ImageAspectFlags> = BTreeMap::new();
    let has_contents = |resource: &ResourceNode| match &resource.import {
        None => false,
        Some(Import::Buffer(_)) => true,
        Some(Import::Image { layout, .. }) => *layout != vk::ImageLayout::UNDEFINED,
        #[cfg(test)]
        Some(Import::Fake { layout }) => *layout != vk::ImageLayout::UNDEFINED,
    };
    for (index, pass) in graph.passes.iter().enumerate() {
        for access in &accesses[index].accesses {
            let resource = &graph.resources[access.resource.0 as usize];
            if has_contents(resource) {
                continue;
            }
            // A storage write may be meant to fill the whole; a read, or an attachment that keeps, is not.
            let keeps = access.write && !access.discard && access.layout != vk::ImageLayout::GENERAL;
            let is_buffer = matches!(resource.kind, ResourceKind::Buffer { .. });
            // Stencil that was never written is undefined, which only a stencil test would show.
            let aspects = access.aspects;
            if !access.write || (keeps && !is_buffer) {
                let unwritten = |cell: usize| {
                    !written.get(&(access.resource, cell)).is_some_and(|written| written.intersects(aspects))
                };
                let stencil_alone = aspects == vk::ImageAspectFlags::STENCIL;
                if !stencil_alone && cells_of(&access.range, mips_of(&resource.kind)).any(unwritten) {
                    return Err(GraphError::ReadBeforeWrite {
                        pass: pass.name.clone(),
                        resource: resource.name.clone(),
                    });
                }
            }
        }
        for (cell, cell_use) in uses[index].iter().filter(|(_, cell_use)| cell_use.write) {
            *written.entry(*cell).or_default() |= cell_use.write_aspects;
        }
    }
    Ok(())
}

/// What the planner knows of a part of a resource between two passes.
#[derive(Clone, Default)]
struct CellState {
    layout: vk::ImageLayout,
    touched: bool,
    write_stages: vk::PipelineStageFlags2,
    write_access: vk::AccessFlags2,
    readers: vk::PipelineStageFlags2,
    /// To whom the last write is visible.
    visible: Vec<(vk::PipelineStageFlags2, vk::AccessFlags2)>,
}

impl CellState {
    fn stages(&self) -> vk::PipelineStageFlags2 {
        self.write_stages | self.readers
    }

    fn sees(&self, cell_use: &CellUse) -> bool {
        self.visible
            .iter()
            .any(|(stages, access)| stages.contains(cell_use.stages) && access.contains(cell_use.access))
    }
}

/// First and last live pass that uses each resource.
fn lifetimes(graph: &Graph, uses: &[&BTreeMap<Cell, CellUse>]) -> Vec<Option<(usize, usize)>> {
    let mut lifetimes: Vec<Option<(usize, usize)>> = vec![None; graph.resources.len()];
    for (pass, uses) in uses.iter().enumerate() {
        for (id, _) in uses.keys() {
            let lifetime = lifetimes[id.0 as usize].get_or_insert((pass, pass));
            lifetime.1 = pass;
        }
    }
    for (resource, lifetime) in graph.resources.iter().zip(&mut lifetimes) {
        if let (true, Some(lifetime)) = (resource.kept, lifetime) {
            lifetime.1 = usize::MAX;
        }
    }
    lifetimes
}

/// Places resources: large ones first, each at the lowest offset that no resource alive at the same time holds. Images
/// and buffers have heaps of their own, so that no granularity between them matters.
fn place(resources: &mut [PlannedResource]) -> Vec<PlannedHeap> {
    let mut heaps: Vec<PlannedHeap> = Vec::new();
    let mut keys: Vec<(u32, bool)> = Vec::new();
    let mut order: Vec<usize> = (0..resources.len())
        .filter(|index| resources[*index].lifetime.is_some() && !resources[*index].imported)
        .collect();
    order.sort_by_key(|index| (std::cmp::Reverse(resources[*index].need.bytes), *index));
    for (placed, index) in order.iter().copied().enumerate() {
        let resource = &resources[index];
        let key = (resource.need.type_bits, matches!(resource.kind, ResourceKind::Image(_)));
        let heap = keys.iter().position(|other| *other == key).unwrap_or_else(|| {
            keys.push(key);
            heaps.push(PlannedHeap { bytes: 0, alignment: 1, type_bits: key.0 });
            heaps.len() - 1
        });
        let mut taken: Vec<(u64, u64)> = order[..placed]
            .iter()
            .map(|other| &resources[*other])
            .filter(|other| {
                other.placement.is_some_and(|place| place.heap == heap) && overlap(other, resource)
            })
            .filter_map(|other| Some((other.placement?.offset, other.placement?.offset + other.need.bytes)))
            .collect();
        taken.sort_unstable();
        let mut offset = 0u64;
        for (start, end) in taken {
            if start >= offset + resource.need.bytes {
                break;
            }
            offset = offset.max(end).next_multiple_of(resource.need.alignment);
        }
        let end = offset + resource.need.bytes;
        heaps[heap].bytes = heaps[heap].bytes.max(end);
        heaps[heap].alignment = heaps[heap].alignment.max(resource.need.alignment);
        resources[index].placement = Some(Placement { heap, offset });
    }
    heaps
}

/// Whether two resources are alive at the same time.
fn overlap(a: &PlannedResource, b: &PlannedResource) -> bool {
    match (a.lifetime, b.lifetime) {
        (Some(a), Some(b)) => a.0 <= b.1 && b.0 <= a.1,
        _ => false,
    }
}

fn shares_memory(a: &PlannedResource, b: &PlannedResource) -> bool {
    match (a.placement, b.placement) {
        (Some(place_a), Some(place_b)) => {
            place_a.heap == place_b.heap
                && place_a.offset < place_b.offset + b.need.bytes
                && place_b.offset < place_a.offset + a.need.bytes
        }
        _ => false,
    }
}

struct BarrierPlanner<'a> {
    resources: &'a [PlannedResource],
    uses: &'a [&'a BTreeMap<Cell, CellUse>],
    states: Vec<Vec<CellState>>,
    /// Whether some pass writes the resource.
    written: Vec<bool>,
}

/// A barrier of one part, before parts are joined.
#[derive(Clone, Copy, PartialEq, Eq)]
struct CellBarrier {
    src_stages: vk::PipelineStageFlags2,
    src_access: vk::AccessFlags2,
    dst_stages: vk::PipelineStageFlags2,
    dst_access: vk::AccessFlags2,
    old_layout: vk::ImageLayout,
    new_layout: vk::ImageLayout,
}

impl<'a> BarrierPlanner<'a> {
    fn new(resources: &'a [PlannedResource], uses: &'a [&'a BTreeMap<Cell, CellUse>]) -> Self {
        let states = resources
            .iter()
            .map(|resource| {
                let layout = match &resource.import {
                    Some(Import::Image { layout, .. }) => *layout,
                    #[cfg(test)]
                    Some(Import::Fake { layout }) => *layout,
                    _ => vk::ImageLayout::UNDEFINED,
                };
                vec![CellState { layout, ..CellState::default() }; cell_count(&resource.kind)]
            })
            .collect();
        let mut written = vec![false; resources.len()];
        for ((id, _), cell_use) in uses.iter().flat_map(|uses| uses.iter()) {
            written[id.0 as usize] |= cell_use.write;
        }
        Self { resources, uses, states, written }
    }

    /// The union of this read and those that follow it up to the next write or layout change.
    fn reads_from(&self, pass: usize, cell: &Cell) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        let first = &self.uses[pass][cell];
        let mut all = (first.stages, first.access);
        for uses in &self.uses[pass + 1..] {
            let Some(next) = uses.get(cell) else { continue };
            if next.write || next.layout != first.layout {
                break;
            }
            all = (all.0 | next.stages, all.1 | next.access);
        }
        all
    }

    /// What must have happened before the first use of a part in the frame.
    fn before_first(&self, pass: usize, id: ResourceId) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        let resource = &self.resources[id.0 as usize];
        if resource.imported {
            // Earlier frames, and uploads, may have used it in any way.
            return if self.written[id.0 as usize] {
                (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_WRITE)
            } else {
                (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE)
            };
        }
        let mut before = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE);
        for (index, other) in self.resources.iter().enumerate() {
            let earlier = other.lifetime.is_some_and(|lifetime| lifetime.1 < pass);
            if index != id.0 as usize && earlier && shares_memory(other, resource) {
                for state in &self.states[index] {
                    before = (before.0 | state.stages(), before.1 | state.write_access);
                }
            }
        }
        before
    }

    fn cell_barrier(&mut self, pass: usize, cell: &Cell) -> (Option<CellBarrier>, Option<CellBarrier>) {
        let cell_use = self.uses[pass][cell];
        let is_image = matches!(self.resources[cell.0.0 as usize].kind, ResourceKind::Image(_));
        let is_transient = !self.resources[cell.0.0 as usize].imported;
        let state = &self.states[cell.0.0 as usize][cell.1];
        let first = !state.touched;
        let (src_stages, src_access) =
            if first { self.before_first(pass, cell.0) } else { (state.stages(), state.write_access) };
        let transition = is_image && state.layout != cell_use.layout;
        let hazard = if cell_use.write {
            !src_stages.is_empty()
        } else {
            !(state.write_stages | if first { src_stages } else { vk::PipelineStageFlags2::NONE }).is_empty()
                && !state.sees(&cell_use)
        };
        let mut memory = None;
        let mut barrier = None;
        let mut dst = (cell_use.stages, cell_use.access);
        if !cell_use.write {
            dst = self.reads_from(pass, cell);
        }
        if transition || hazard {
            // A read that needs no transition waits for the last write alone, not for other readers.
            let (src_stages, src_access) = if cell_use.write || transition || first {
                (src_stages, src_access)
            } else {
                (state.write_stages, state.write_access)
            };
            let keep = if cell_use.discard && transition { vk::ImageLayout::UNDEFINED } else { state.layout };
            let one = CellBarrier {
                src_stages,
                src_access,
                dst_stages: dst.0,
                dst_access: dst.1,
                old_layout: if is_image { keep } else { vk::ImageLayout::UNDEFINED },
                new_layout: if is_image { cell_use.layout } else { vk::ImageLayout::UNDEFINED },
            };
            if first && is_transient && !src_stages.is_empty() {
                let none = vk::ImageLayout::UNDEFINED;
                memory = Some(CellBarrier { old_layout: none, new_layout: none, ..one });
            }
            if is_image || memory.is_none() {
                barrier = Some(one);
            }
        }
        let state = &mut self.states[cell.0.0 as usize][cell.1];
        state.touched = true;
        if cell_use.write {
            *state = CellState {
                layout: cell_use.layout,
                touched: true,
                write_stages: cell_use.stages,
                write_access: cell_use.access & WRITES,
                ..CellState::default()
            };
        } else if transition || first && hazard {
            // The transition counts as a write that has happened once the barrier's second scope begins.
            *state = CellState {
                layout: cell_use.layout,
                touched: true,
                write_stages: dst.0,
                readers: cell_use.stages,
                visible: vec![dst],
                ..CellState::default()
            };
        } else {
            if hazard {
                state.visible.push(dst);
            }
            state.readers |= cell_use.stages;
        }
        (memory, barrier)
    }

    fn pass(&mut self, pass: usize) -> Vec<Barrier> {
        let mut out: Vec<Barrier> = Vec::new();
        let mut memory: Option<Barrier> = None;
        let cells: Vec<Cell> = self.uses[pass].keys().copied().collect();
        let mut start = 0;
        while start < cells.len() {
            let id = cells[start].0;
            let count = cells[start..].iter().take_while(|cell| cell.0 == id).count();
            let mut grid: Vec<Option<CellBarrier>> =
                vec![None; cell_count(&self.resources[id.0 as usize].kind)];
            for cell in &cells[start..start + count] {
                let (owner, barrier) = self.cell_barrier(pass, cell);
                grid[cell.1] = barrier;
                if let Some(owner) = owner {
                    let one = lower(None, Subresource::mip_layer(0, 0), &owner);
                    let all = memory.get_or_insert(one);
                    all.src_stages |= one.src_stages;
                    all.src_access |= one.src_access;
                    all.dst_stages |= one.dst_stages;
                    all.dst_access |= one.dst_access;
                }
            }
            out.extend(join_cells(id, &grid, mips_of(&self.resources[id.0 as usize].kind)));
            start += count;
        }
        out.splice(0..0, memory);
        out
    }

    /// Returns imported images to the layout in which they came.
    fn finish(&self) -> Vec<Barrier> {
        let mut out = Vec::new();
        for (index, resource) in self.resources.iter().enumerate() {
            let home = match &resource.import {
                Some(Import::Image { layout, .. }) => *layout,
                #[cfg(test)]
                Some(Import::Fake { layout }) => *layout,
                _ => continue,
            };
            if home == vk::ImageLayout::UNDEFINED {
                continue;
            }
            let grid: Vec<Option<CellBarrier>> = self.states[index]
                .iter()
                .map(|state| {
                    (state.layout != home).then_some(CellBarrier {
                        src_stages: state.stages(),
                        src_access: state.write_access,
                        dst_stages: vk::PipelineStageFlags2::ALL_COMMANDS,
                        dst_access: vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
                        old_layout: state.layout,
                        new_layout: home,
                    })
                })
                .collect();
            out.extend(join_cells(ResourceId(index as u32), &grid, mips_of(&resource.kind)));
        }
        out
    }
}

fn lower(resource: Option<ResourceId>, range: Subresource, barrier: &CellBarrier) -> Barrier {
    Barrier {
        resource,
        range,
        src_stages: barrier.src_stages,
        src_access: barrier.src_access,
        dst_stages: barrier.dst_stages,
        dst_access: barrier.dst_access,
        old_layout: barrier.old_layout,
        new_layout: barrier.new_layout,
    }
}

/// Joins equal barriers of neighbouring parts: levels of a layer first, then layers with equal runs of levels.
fn join_cells(id: ResourceId, grid: &[Option<CellBarrier>], mips: usize) -> Vec<Barrier> {
    let mut out: Vec<(Subresource, CellBarrier)> = Vec::new();
    for (layer, row) in grid.chunks(mips).enumerate() {
        let mut mip = 0;
        while mip < row.len() {
            let count = row[mip..].iter().take_while(|other| **other == row[mip]).count();
            if let Some(barrier) = row[mip] {
                let above = out.iter_mut().find(|(range, other)| {
                    *other == barrier
                        && range.mip as usize == mip
                        && range.mip_count as usize == count
                        && (range.layer + range.layer_count) as usize == layer
                });
                match above {
                    Some((range, _)) => range.layer_count += 1,
                    None => out.push((
                        Subresource {
                            mip: mip as u32,
                            mip_count: count as u32,
                            layer: layer as u32,
                            layer_count: 1,
                        },
                        barrier,
                    )),
                }
            }
            mip += count;
        }
    }
    out.iter().map(|(range, barrier)| lower(Some(id), *range, barrier)).collect()
}

impl Graph {
    /// Plans the frame: checks it, drops passes that nobody needs, and derives order, barriers, lifetimes and places.
    ///
    /// # Errors
    /// The first error of the declaration, a slot that does not fit its shader, a use that excludes another, a read
    /// before any write, or an image or buffer that `requirements` cannot make.
    pub fn plan(mut self, requirements: &dyn Requirements) -> Result<Plan, GraphError> {
        if !self.errors.is_empty() {
            return Err(self.errors.swap_remove(0));
        }
        let mut resolved: Vec<Resolved> =
            self.passes.iter().map(|pass| resolve_pass(pass, &self.resources)).collect::<Result<_, _>>()?;
        let uses: Vec<BTreeMap<Cell, CellUse>> = self
            .passes
            .iter()
            .zip(&resolved)
            .map(|(pass, resolved)| join_uses(&pass.name, &resolved.accesses, &self.resources))
            .collect::<Result<_, _>>()?;
        check_reads_after_writes(&self, &uses, &resolved)?;
        for ((pass, resolved), uses) in self.passes.iter().zip(&mut resolved).zip(&uses) {
            settle_layouts(&pass.name, &mut resolved.accesses, uses, &self.resources)?;
        }

        let live = live_passes(&self, &uses);
        let live_uses: Vec<&BTreeMap<Cell, CellUse>> =
            uses.iter().zip(&live).filter(|(_, live)| **live).map(|(uses, _)| uses).collect();
        let lifetimes = lifetimes(&self, &live_uses);
        let mut resources = planned_resources(&self, &resolved, &live, &lifetimes, requirements)?;
        let heaps = place(&mut resources);

        let mut planner = BarrierPlanner::new(&resources, &live_uses);
        let barriers: Vec<Vec<Barrier>> = (0..live_uses.len()).map(|pass| planner.pass(pass)).collect();
        let final_barriers = planner.finish();
        let final_layouts: Vec<Vec<vk::ImageLayout>> =
            planner.states.iter().map(|cells| cells.iter().map(|cell| cell.layout).collect()).collect();
        for (resource, layouts) in resources.iter_mut().zip(final_layouts) {
            resource.final_layouts = layouts;
        }

        let mut barriers = barriers.into_iter();
        let mut plan = Plan {
            passes: Vec::new(),
            resources,
            heaps,
            final_barriers,
            dropped: Vec::new(),
            unused_slots: Vec::new(),
        };
        for ((node, resolved), live) in self.passes.into_iter().zip(resolved).zip(live) {
            if !live {
                plan.dropped.push(node.name);
                continue;
            }
            plan.unused_slots.extend(resolved.unused);
            plan.passes.push(PlannedPass {
                name: node.name.clone(),
                role: node.role,
                work: node.kind.work(),
                barriers: barriers.next().unwrap_or_default(),
                accesses: resolved.accesses,
                node,
                bindings: resolved.bindings,
            });
        }
        Ok(plan)
    }
}

/// Gives each access the layout that its parts have in the pass; parts of one access must agree.
fn settle_layouts(
    pass: &str,
    accesses: &mut [Access],
    uses: &BTreeMap<Cell, CellUse>,
    resources: &[ResourceNode],
) -> Result<(), GraphError> {
    for access in accesses {
        let node = &resources[access.resource.0 as usize];
        let mut layouts =
            cells_of(&access.range, mips_of(&node.kind)).map(|cell| uses[&(access.resource, cell)].layout);
        let Some(first) = layouts.next() else { continue };
        if let Some(other) = layouts.find(|layout| *layout != first) {
            return Err(GraphError::Conflict {
                pass: pass.to_owned(),
                resource: node.name.clone(),
                first: format!("{} in layout {first:?}", access.what),
                second: format!("a range in layout {other:?}"),
            });
        }
        access.layout = first;
    }
    Ok(())
}

fn planned_resources(
    graph: &Graph,
    resolved: &[Resolved],
    live: &[bool],
    lifetimes: &[Option<(usize, usize)>],
    requirements: &dyn Requirements,
) -> Result<Vec<PlannedResource>, GraphError> {
    let mut image_usage = vec![vk::ImageUsageFlags::empty(); graph.resources.len()];
    let mut buffer_usage = vec![vk::BufferUsageFlags::empty(); graph.resources.len()];
    for (resolved, _) in resolved.iter().zip(live).filter(|(_, live)| **live) {
        for (id, usage) in &resolved.image_usage {
            image_usage[id.0 as usize] |= *usage;
        }
        for (id, usage) in &resolved.buffer_usage {
            buffer_usage[id.0 as usize] |= *usage;
        }
    }
    let mut out = Vec::with_capacity(graph.resources.len());
    for (index, node) in graph.resources.iter().enumerate() {
        if node.kept {
            image_usage[index] |= vk::ImageUsageFlags::TRANSFER_SRC;
            buffer_usage[index] |= vk::BufferUsageFlags::TRANSFER_SRC;
        }
        let used = lifetimes[index].is_some() && node.import.is_none();
        let need = match &node.kind {
            _ if !used => MemoryNeed { bytes: 0, alignment: 1, type_bits: 0 },
            ResourceKind::Image(info) => requirements.image(&node.name, info, image_usage[index])?,
            ResourceKind::Buffer { bytes } => requirements.buffer(&node.name, *bytes, buffer_usage[index])?,
        };
        out.push(PlannedResource {
            name: node.name.clone(),
            role: node.role,
            need,
            lifetime: lifetimes[index],
            placement: None,
            kept: node.kept,
            output: node.output,
            imported: node.import.is_some(),
            image_usage: image_usage[index],
            buffer_usage: buffer_usage[index],
            kind: node.kind.clone(),
            import: node.import.clone(),
            final_layouts: Vec::new(),
        });
    }
    Ok(out)
}
