//! The executor: makes what a plan needs once, then records and runs the frame any number of times.
//!
//! Everything that recording needs is resolved ahead into flat lists (pipelines, descriptor writes, barriers, views), so
//! that a frame of twenty passes is recorded in a fraction of a millisecond.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use afterlight_gpu::{self as gpu, Device, GpuError, vk};
use afterlight_roles::{PassRole, PassWork};
use afterlight_shader::{BindingKind, Shader, Stage};

use crate::bind::{self, BoundSlot, TEXTURE_SET};
use crate::declare::{
    Blend, CallNode, ColorLoad, ColorNode, DepthNode, DepthTest, DispatchCall, DrawNode, ImageInfo, Import,
    Load, PassKind, RasterCommand, RasterNode, RasterState, Rect, ResourceId, ResourceKind, StencilFace,
    StencilTest, Subresource, TransferNode,
};
use crate::error::GraphError;
use crate::plan::{Barrier, MemoryNeed, Placement, Plan, PlannedPass, Requirements, aspects, mip_extent};
use crate::report::{FrameReport, PassReport, ResourceReport};

impl Requirements for Device {
    fn image(
        &self,
        name: &str,
        info: &ImageInfo,
        usage: vk::ImageUsageFlags,
    ) -> Result<MemoryNeed, GpuError> {
        self.image_requirements(&image_desc(name, info, usage)).map(need)
    }

    fn buffer(&self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> Result<MemoryNeed, GpuError> {
        self.buffer_requirements(&buffer_desc(name, bytes, usage)).map(need)
    }
}

fn need(from: gpu::MemoryRequirements) -> MemoryNeed {
    MemoryNeed { bytes: from.bytes, alignment: from.alignment, type_bits: from.type_bits }
}

fn image_desc<'a>(name: &'a str, info: &ImageInfo, usage: vk::ImageUsageFlags) -> gpu::ImageDesc<'a> {
    gpu::ImageDesc {
        name,
        format: info.format,
        width: info.width,
        height: info.height,
        layers: info.layers,
        mips: info.mips,
        samples: info.samples,
        usage,
    }
}

fn buffer_desc(name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> gpu::BufferDesc<'_> {
    gpu::BufferDesc { name, bytes, usage, memory: gpu::MemoryKind::DeviceLocal }
}

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

#[derive(Clone)]
enum Physical {
    Image(gpu::Image),
    Buffer(gpu::Buffer),
    Unused,
}

/// Barriers ready to be recorded: one for all memory, one for each part of an image that changes its layout.
#[derive(Default)]
struct BarrierList {
    memory: Option<gpu::MemoryBarrier>,
    images: Vec<ImageTransition>,
}

struct ImageTransition {
    image: gpu::Image,
    range: vk::ImageSubresourceRange,
    before: gpu::Access,
    after: gpu::Access,
    old_layout: vk::ImageLayout,
    new_layout: vk::ImageLayout,
}

struct ColorTarget {
    view: gpu::ImageView,
    load: gpu::Load<gpu::ClearColor>,
    resolve: Option<gpu::ImageView>,
}

struct DepthTarget {
    view: gpu::ImageView,
    layout: vk::ImageLayout,
    depth: Option<(gpu::Load<f32>, bool)>,
    stencil: Option<(gpu::Load<u32>, bool)>,
}

/// A pipeline with the descriptors that are bound with it.
struct Bindings {
    pipeline: gpu::Pipeline,
    push_set: gpu::PushSet,
    texture_set: Option<gpu::DescriptorSet>,
}

struct DrawCommand {
    /// Index into the pass's pipelines.
    pipeline: usize,
    push: Vec<u8>,
    cull: vk::CullModeFlags,
    front_face: vk::FrontFace,
    depth_bias_slope: f32,
    stencil_reference: u32,
    scissor: vk::Rect2D,
    vertex_buffers: Vec<gpu::Buffer>,
    index_buffer: Option<(gpu::Buffer, vk::IndexType)>,
    call: BoundCall,
}

enum BoundCall {
    Direct {
        vertices: u32,
        instances: u32,
        first_vertex: u32,
        first_instance: u32,
    },
    Indexed {
        indices: u32,
        instances: u32,
        first_index: u32,
        vertex_offset: i32,
        first_instance: u32,
    },
    Indirect {
        buffer: gpu::Buffer,
        offset: u64,
        count: u32,
        stride: u32,
    },
    IndexedIndirect {
        buffer: gpu::Buffer,
        offset: u64,
        count: u32,
        stride: u32,
    },
    IndexedIndirectCount {
        buffer: gpu::Buffer,
        offset: u64,
        count_buffer: gpu::Buffer,
        count_offset: u64,
        max: u32,
        stride: u32,
    },
}

enum BoundCommand {
    Draw(Box<DrawCommand>),
    ClearStencil { value: u32, rect: vk::Rect2D },
}

enum BoundDispatch {
    Direct([u32; 3]),
    Indirect(gpu::Buffer, u64),
}

enum Body {
    Raster {
        extent: [u32; 2],
        viewport: Option<[f32; 4]>,
        layers: u32,
        colors: Vec<ColorTarget>,
        depth: Option<DepthTarget>,
        pipelines: Vec<Bindings>,
        commands: Vec<BoundCommand>,
    },
    Compute {
        bindings: Bindings,
        dispatches: Vec<(Vec<u8>, BoundDispatch)>,
    },
    Fill {
        buffer: gpu::Buffer,
        value: u32,
    },
    ClearImage {
        image: gpu::Image,
        value: gpu::ClearColor,
        range: vk::ImageSubresourceRange,
    },
    CopyBuffer {
        src: gpu::Buffer,
        dst: gpu::Buffer,
        bytes: u64,
    },
    CopyImage {
        src: gpu::Image,
        dst: gpu::Image,
        regions: Vec<vk::ImageCopy>,
    },
    CopyImageToBuffer {
        src: gpu::Image,
        dst: gpu::Buffer,
        regions: Vec<vk::BufferImageCopy>,
    },
}

struct BoundPass {
    name: String,
    role: PassRole,
    work: PassWork,
    barriers: BarrierList,
    body: Body,
}

/// A plan with everything that it needs on a device.
pub struct Executor {
    device: Device,
    plan: Plan,
    physical: Vec<Physical>,
    passes: Vec<BoundPass>,
    final_barriers: BarrierList,
    memory: Vec<ResourceReport>,
}

impl Executor {
    /// Allocates the plan's memory, makes its images, buffers, pipelines (in parallel) and descriptor writes.
    ///
    /// # Errors
    /// No memory, a limit of the device, a shader that the driver refuses; an imported resource without the usage that
    /// the passes need.
    pub fn new(device: &Device, plan: Plan) -> Result<Self, GraphError> {
        let physical = make_resources(device, &plan)?;
        let builder = Builder { device, plan: &plan, physical: &physical };
        let passes = builder.passes()?;
        let final_barriers = builder.barriers(&plan.final_barriers);
        let memory = plan
            .resources
            .iter()
            .filter(|resource| resource.placement.is_some())
            .map(|resource| ResourceReport {
                name: resource.name.clone(),
                role: resource.role,
                bytes: resource.need.bytes,
                shared: resource.shared(),
                output: resource.output,
            })
            .collect();
        Ok(Self { device: device.clone(), physical, passes, final_barriers, memory, plan })
    }

    /// Returns the plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Records the frame, runs it, waits for it, and reports what it took.
    ///
    /// # Errors
    /// The device was lost, or refuses the recording.
    pub fn run(&mut self) -> Result<FrameReport, GraphError> {
        let start = Instant::now();
        let mut encoder = self.device.encoder()?;
        let mut times = Vec::with_capacity(self.passes.len() + 1);
        let mut statistics = Vec::with_capacity(self.passes.len());
        times.push(encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS)?);
        for pass in &self.passes {
            encoder.begin_label(&pass.name);
            pass.barriers.record(&mut encoder);
            // A query spans the whole of a rendering scope: it may neither begin nor end within.
            let query = encoder.begin_statistics()?;
            pass.body.record(&mut encoder)?;
            encoder.end_statistics(query);
            encoder.end_label();
            times.push(encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS)?);
            statistics.push(query);
        }
        self.final_barriers.record(&mut encoder);
        let recorded = Instant::now();
        let completed = self.device.submit(encoder)?;
        let done = Instant::now();

        let passes = self
            .passes
            .iter()
            .enumerate()
            .map(|(index, pass)| PassReport {
                name: pass.name.clone(),
                role: pass.role,
                work: pass.work,
                time_ns: completed.elapsed_ns(times[index], times[index + 1]),
                statistics: completed.statistics(statistics[index]),
                shared: pass.role.is_shared(),
            })
            .collect();
        let last = times[self.passes.len()];
        Ok(FrameReport {
            passes,
            frame_ns: completed.elapsed_ns(times[0], last),
            cpu_record_ns: nanoseconds(recorded - start),
            cpu_wait_ns: nanoseconds(done - recorded),
            memory: self.memory.clone(),
            peak_bytes: self.plan.peak_bytes(),
            technique_bytes: self.plan.technique_bytes(),
        })
    }

    fn find(&self, key: &impl ResourceKey) -> Result<ResourceId, GraphError> {
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
        if matches!(self.physical[id.0 as usize], Physical::Unused) {
            return Err(kept("used by no pass"));
        }
        Ok(id)
    }

    fn not_readable(&self, key: &impl ResourceKey, found: &'static str, expected: &str) -> GraphError {
        GraphError::NotReadable { name: key.label(), found, expected: expected.to_owned() }
    }

    /// Returns a buffer of the frame that was kept or imported.
    ///
    /// # Errors
    /// No such resource, or one that is not kept.
    pub fn buffer(&self, key: impl ResourceKey) -> Result<&gpu::Buffer, GraphError> {
        let id = self.find(&key)?;
        match &self.physical[id.0 as usize] {
            Physical::Buffer(buffer) => Ok(buffer),
            _ => Err(self.not_readable(&key, "an image", "a buffer")),
        }
    }

    /// Returns an image of the frame that was kept or imported.
    ///
    /// # Errors
    /// No such resource, or one that is not kept.
    pub fn image(&self, key: impl ResourceKey) -> Result<&gpu::Image, GraphError> {
        let id = self.find(&key)?;
        match &self.physical[id.0 as usize] {
            Physical::Image(image) => Ok(image),
            _ => Err(self.not_readable(&key, "a buffer", "an image")),
        }
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
        let id = self.find(&key)?;
        let image = match &self.physical[id.0 as usize] {
            Physical::Image(image) => image,
            _ => return Err(self.not_readable(&key, "a buffer", "an image")),
        };
        if image.samples() > 1 {
            return Err(self.not_readable(
                &key,
                "an image of several samples",
                "one sample (resolve it first)",
            ));
        }
        let Some(info) = gpu::format_info(image.format()) else {
            return Err(self.not_readable(&key, "an image of a format of unknown size", "a known format"));
        };
        let planned = &self.plan.resources[id.0 as usize];
        let layer_bytes = info.level_bytes(image.extent()[0], image.extent()[1]);
        let full = aspects(image.format());
        let copied =
            if full.contains(vk::ImageAspectFlags::DEPTH) { vk::ImageAspectFlags::DEPTH } else { full };
        let mut barriers = Vec::new();
        let mut regions = Vec::new();
        for layer in 0..image.layers() {
            let layout =
                planned.final_layouts.get((layer * image.mips()) as usize).copied().unwrap_or_default();
            if layout == vk::ImageLayout::UNDEFINED {
                return Err(self.not_readable(&key, "a layer that no pass has written", "a written image"));
            }
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
                old_layout: layout,
                new_layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            });
            regions.push(image_to_buffer(image, copied, 0, layer, u64::from(layer) * layer_bytes));
        }
        self.read_back(layer_bytes * u64::from(image.layers()), |encoder, target| {
            encoder.barriers(&[], &[], &barriers);
            encoder.copy_image_to_buffer(image, target, &regions);
            for barrier in &mut barriers {
                std::mem::swap(&mut barrier.old_layout, &mut barrier.new_layout);
                (barrier.before, barrier.after) = (COPY_READ, ANY);
            }
            encoder.barriers(&[], &[], &barriers);
            Ok(())
        })
    }
}

const ANY_WRITE: gpu::Access =
    gpu::Access { stages: vk::PipelineStageFlags2::ALL_COMMANDS, access: vk::AccessFlags2::MEMORY_WRITE };
const ANY: gpu::Access = gpu::Access {
    stages: vk::PipelineStageFlags2::ALL_COMMANDS,
    access: vk::AccessFlags2::from_raw(
        vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
    ),
};
const COPY_READ: gpu::Access =
    gpu::Access { stages: vk::PipelineStageFlags2::ALL_TRANSFER, access: vk::AccessFlags2::TRANSFER_READ };

fn nanoseconds(duration: std::time::Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

fn image_to_buffer(
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

fn make_resources(device: &Device, plan: &Plan) -> Result<Vec<Physical>, GraphError> {
    let heaps: Vec<gpu::Heap> = plan
        .heaps
        .iter()
        .enumerate()
        .map(|(index, heap)| {
            let inside = |place: Option<Placement>| place.is_some_and(|place| place.heap == index);
            let residents = plan.resources.iter().filter(|resource| inside(resource.placement));
            let largest =
                residents.max_by_key(|resource| resource.need.bytes).map_or("", |resource| &resource.name);
            device.create_heap(&format!("frame heap of {largest} and others"), heap.bytes, heap.type_bits)
        })
        .collect::<Result<_, _>>()?;
    plan.resources
        .iter()
        .map(|resource| {
            let missing = |found: String, expected: String| GraphError::BadResource {
                name: resource.name.clone(),
                what: "usage of the imported resource",
                found,
                expected,
            };
            match (&resource.import, &resource.kind, resource.placement) {
                (Some(Import::Image { image, .. }), ..) => {
                    if !image.usage().contains(resource.image_usage) {
                        return Err(missing(
                            format!("{:?}", image.usage()),
                            format!("{:?}", resource.image_usage),
                        ));
                    }
                    Ok(Physical::Image(image.clone()))
                }
                (Some(Import::Buffer(buffer)), ..) => {
                    if !buffer.usage().contains(resource.buffer_usage) {
                        return Err(missing(
                            format!("{:?}", buffer.usage()),
                            format!("{:?}", resource.buffer_usage),
                        ));
                    }
                    Ok(Physical::Buffer(buffer.clone()))
                }
                (None, ResourceKind::Image(info), Some(place)) => {
                    let desc = image_desc(&resource.name, info, resource.image_usage);
                    Ok(Physical::Image(device.create_image_in(&desc, &heaps[place.heap], place.offset)?))
                }
                (None, ResourceKind::Buffer { bytes }, Some(place)) => {
                    let desc = buffer_desc(&resource.name, *bytes, resource.buffer_usage);
                    Ok(Physical::Buffer(device.create_buffer_in(&desc, &heaps[place.heap], place.offset)?))
                }
                _ => Ok(Physical::Unused),
            }
        })
        .collect()
}

/// Turns planned passes into bound ones.
struct Builder<'a> {
    device: &'a Device,
    plan: &'a Plan,
    physical: &'a [Physical],
}

/// A pipeline to be made: the pass, and the draw that first uses it (0 for compute).
#[derive(Clone, Copy)]
struct Job {
    pass: usize,
    draw: usize,
}

impl Builder<'_> {
    fn image(&self, id: ResourceId) -> &gpu::Image {
        match &self.physical[id.0 as usize] {
            Physical::Image(image) => image,
            _ => unreachable!("the plan has checked that resource {} is a used image", id.0),
        }
    }

    fn buffer(&self, id: ResourceId) -> &gpu::Buffer {
        match &self.physical[id.0 as usize] {
            Physical::Buffer(buffer) => buffer,
            _ => unreachable!("the plan has checked that resource {} is a used buffer", id.0),
        }
    }

    fn view(
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

    fn barriers(&self, barriers: &[Barrier]) -> BarrierList {
        let mut list = BarrierList::default();
        for barrier in barriers {
            let before = gpu::Access { stages: barrier.src_stages, access: barrier.src_access };
            let after = gpu::Access { stages: barrier.dst_stages, access: barrier.dst_access };
            let image = barrier.resource.and_then(|id| match &self.physical[id.0 as usize] {
                Physical::Image(image) => Some(image),
                _ => None,
            });
            // Drivers flush whole caches: barriers without a change of layout are one for all.
            match image {
                Some(image) if barrier.old_layout != barrier.new_layout => {
                    list.images.push(ImageTransition {
                        image: image.clone(),
                        range: vk::ImageSubresourceRange {
                            aspect_mask: aspects(image.format()),
                            base_mip_level: barrier.range.mip,
                            level_count: barrier.range.mip_count,
                            base_array_layer: barrier.range.layer,
                            layer_count: barrier.range.layer_count,
                        },
                        before,
                        after,
                        old_layout: barrier.old_layout,
                        new_layout: barrier.new_layout,
                    })
                }
                _ => {
                    let all = list.memory.get_or_insert(gpu::MemoryBarrier {
                        before: gpu::Access::default(),
                        after: gpu::Access::default(),
                    });
                    all.before.stages |= before.stages;
                    all.before.access |= before.access;
                    all.after.stages |= after.stages;
                    all.after.access |= after.access;
                }
            }
        }
        list
    }

    fn passes(&self) -> Result<Vec<BoundPass>, GraphError> {
        let (jobs, pipeline_of) = self.jobs();
        let pipelines = self.make_pipelines(&jobs)?;
        let mut passes = Vec::with_capacity(self.plan.passes.len());
        for (index, pass) in self.plan.passes.iter().enumerate() {
            let made: Vec<(Job, gpu::Pipeline)> = jobs
                .iter()
                .zip(&pipelines)
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

    /// Lists the distinct pipelines, and for each pass and draw the index of its pipeline among those of the pass.
    fn jobs(&self) -> (Vec<Job>, Vec<Vec<usize>>) {
        let mut jobs = Vec::new();
        let mut pipeline_of = Vec::new();
        for (index, pass) in self.plan.passes.iter().enumerate() {
            let mut of_pass: Vec<usize> = Vec::new();
            match &pass.node.kind {
                PassKind::Raster(node) => {
                    let mut firsts: Vec<(usize, &RasterState)> = Vec::new();
                    for (draw, state) in draws(node).map(|draw| &draw.state).enumerate() {
                        let known = firsts.iter().position(|(_, other)| same_pipeline(other, state));
                        of_pass.push(known.unwrap_or_else(|| {
                            firsts.push((draw, state));
                            jobs.push(Job { pass: index, draw });
                            firsts.len() - 1
                        }));
                    }
                }
                PassKind::Compute(_) => jobs.push(Job { pass: index, draw: 0 }),
                PassKind::Transfer(_) => {}
            }
            pipeline_of.push(of_pass);
        }
        (jobs, pipeline_of)
    }

    /// Makes pipelines on as many threads as the host has.
    fn make_pipelines(&self, jobs: &[Job]) -> Result<Vec<gpu::Pipeline>, GraphError> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
        let next = AtomicUsize::new(0);
        let made: Mutex<Vec<Option<Result<gpu::Pipeline, GraphError>>>> =
            Mutex::new((0..jobs.len()).map(|_| None).collect());
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(job) = jobs.get(index) else { return };
                let pipeline = self.make_pipeline(*job);
                made.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(pipeline);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads {
                scope.spawn(work);
            }
            work();
        });
        let made = made.into_inner().unwrap_or_else(PoisonError::into_inner);
        made.into_iter().flatten().collect()
    }

    fn make_pipeline(&self, job: Job) -> Result<gpu::Pipeline, GraphError> {
        let pass = &self.plan.passes[job.pass];
        match &pass.node.kind {
            PassKind::Compute(node) => {
                let slots = slot_layouts(&pass.bindings[0]);
                let constants = constants_of(&node.shader, &node.constants);
                let texture_set = texture_set(pass, &[&node.shader]);
                Ok(self.device.compute_pipeline(&gpu::ComputePipelineDesc {
                    shader: code(&node.shader, &constants),
                    slots: &slots,
                    long_lived: texture_set.map(gpu::DescriptorSet::slots),
                    push_constant_bytes: bind::push_bytes(&[&node.shader]),
                })?)
            }
            PassKind::Raster(node) => {
                let draw =
                    draws(node).nth(job.draw).unwrap_or_else(|| unreachable!("jobs list draws that exist"));
                self.raster_pipeline(pass, node, &draw.state, &pass.bindings[job.draw])
            }
            PassKind::Transfer(_) => unreachable!("transfers have no pipeline"),
        }
    }

    fn raster_pipeline(
        &self,
        pass: &PlannedPass,
        node: &RasterNode,
        state: &RasterState,
        bindings: &[BoundSlot],
    ) -> Result<gpu::Pipeline, GraphError> {
        let shaders = state.shaders();
        // In the order of `shaders`: each stage takes the constants that it has.
        let constants: Vec<_> = shaders.iter().map(|shader| constants_of(shader, &state.constants)).collect();
        let stage_code = |stage: Stage| {
            let (shader, constants) =
                shaders.iter().zip(&constants).find(|(shader, _)| shader.stage == stage)?;
            Some(code(shader, constants))
        };
        let patches = stage_code(Stage::TessControl).zip(stage_code(Stage::TessEvaluation));
        let formats: Vec<vk::Format> =
            node.colors.iter().map(|color| self.image(color.resource).format()).collect();
        let blend: Vec<gpu::BlendState> = match state.blend.is_empty() {
            true => vec![gpu::BlendState::OVERWRITE; formats.len()],
            false => state.blend.iter().map(blend_state).collect(),
        };
        let depth_format = node.depth.as_ref().map(|depth| self.image(depth.resource).format());
        let attached = node.colors.first().map(|color| color.resource);
        let attached = attached.or(node.depth.as_ref().map(|depth| depth.resource));
        let vertex_bindings: Vec<gpu::VertexBinding> = state
            .layout
            .streams
            .iter()
            .zip(0..)
            .map(|(stream, binding)| gpu::VertexBinding {
                binding,
                stride_bytes: stream.stride_bytes,
                per_instance: stream.per_instance,
            })
            .collect();
        let vertex_attributes: Vec<gpu::VertexAttribute> = state
            .layout
            .attributes
            .iter()
            .map(|attribute| gpu::VertexAttribute {
                location: attribute.location,
                binding: attribute.stream,
                format: attribute.format,
                offset_bytes: attribute.offset_bytes,
            })
            .collect();
        Ok(self.device.raster_pipeline(&gpu::RasterPipelineDesc {
            vertex: code(&state.vertex, &constants[0]),
            tessellation: patches.map(|(control, evaluation)| [control, evaluation]),
            patch_control_points: if patches.is_some() { 3 } else { 0 },
            geometry: stage_code(Stage::Geometry),
            fragment: stage_code(Stage::Fragment),
            slots: &slot_layouts(bindings),
            long_lived: texture_set(pass, &shaders).map(gpu::DescriptorSet::slots),
            push_constant_bytes: bind::push_bytes(&shaders),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            topology: if patches.is_some() { vk::PrimitiveTopology::PATCH_LIST } else { state.topology },
            polygon_mode: vk::PolygonMode::FILL,
            depth: (state.depth != DepthTest::OFF)
                .then_some(gpu::DepthState { compare: state.depth.compare, write: state.depth.write }),
            depth_clamp: state.depth_clamp,
            depth_bias: is_biased(state),
            stencil: state.stencil.as_ref().map(stencil_state),
            blend: &blend,
            blend_constants: state.blend_constants,
            color_formats: &formats,
            depth_format,
            samples: attached.map_or(1, |id| self.image(id).samples()),
            sample_shading: false,
            alpha_to_coverage: false,
        })?)
    }

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

    fn bindings(
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

    fn raster(
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
        })
    }

    fn draw(&self, draw: &DrawNode, pipeline: usize, all: Rect, extent: [u32; 2]) -> DrawCommand {
        let declared = bind::push_bytes(&draw.state.shaders()) as usize;
        let call = match draw.call {
            CallNode::Direct { vertices, instances, first_vertex, first_instance } => {
                BoundCall::Direct { vertices, instances, first_vertex, first_instance }
            }
            CallNode::Indexed { indices, instances, first_index, vertex_offset, first_instance } => {
                BoundCall::Indexed { indices, instances, first_index, vertex_offset, first_instance }
            }
            CallNode::Indirect { buffer, offset, count, stride } => {
                BoundCall::Indirect { buffer: self.buffer(buffer).clone(), offset, count, stride }
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

fn draws(node: &RasterNode) -> impl Iterator<Item = &DrawNode> {
    node.commands.iter().filter_map(|command| match command {
        RasterCommand::Draw(draw) => Some(&**draw),
        RasterCommand::ClearStencil { .. } => None,
    })
}

fn same_shader(a: &Shader, b: &Shader) -> bool {
    a.name == b.name && a.spirv.len() == b.spirv.len() && std::ptr::eq(a.spirv.as_ptr(), b.spirv.as_ptr())
}

/// Whether a bias is added to depth.
fn is_biased(state: &RasterState) -> bool {
    state.depth_bias_slope != 0.0
}

/// Whether two states make the same pipeline; cull mode, front face and the depth bias are set with the draw.
fn same_pipeline(a: &RasterState, b: &RasterState) -> bool {
    // A shader knows its stage, so that lists of one length that agree hold the same stages.
    let (of_a, of_b) = (a.shaders(), b.shaders());
    of_a.len() == of_b.len()
        && of_a.iter().zip(of_b).all(|(a, b)| same_shader(a, b))
        && a.constants == b.constants
        && a.topology == b.topology
        && a.depth == b.depth
        && a.depth_clamp == b.depth_clamp
        && is_biased(a) == is_biased(b)
        && a.stencil == b.stencil
        && a.blend == b.blend
        && a.blend_constants == b.blend_constants
        && a.layout == b.layout
}

fn texture_set<'a>(pass: &'a PlannedPass, shaders: &[&Shader]) -> Option<&'a gpu::DescriptorSet> {
    let used =
        shaders.iter().flat_map(|shader| shader.reflection.bindings.iter()).any(|b| b.set == TEXTURE_SET);
    pass.node.texture_set.as_ref().filter(|_| used)
}

fn constants_of(shader: &Shader, constants: &[(String, u32)]) -> Vec<(u32, u32)> {
    constants
        .iter()
        .filter_map(|(name, bits)| Some((shader.reflection.spec_constant(name)?.id, *bits)))
        .collect()
}

fn code<'a>(shader: &'a Shader, constants: &'a [(u32, u32)]) -> gpu::ShaderCode<'a> {
    gpu::ShaderCode { name: shader.name.as_str(), spirv: &shader.spirv, constants }
}

fn slot_layouts(bindings: &[BoundSlot]) -> Vec<gpu::SlotLayout> {
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

fn blend_state(blend: &Blend) -> gpu::BlendState {
    gpu::BlendState {
        write: blend.write_mask,
        equation: blend.equation.map(|equation| gpu::BlendEquation {
            color: [equation.src_color, equation.dst_color],
            color_op: equation.color_op,
            alpha: [equation.src_alpha, equation.dst_alpha],
            alpha_op: equation.alpha_op,
        }),
    }
}

fn stencil_state(test: &StencilTest) -> gpu::StencilState {
    let face = |face: &StencilFace| gpu::StencilFace {
        compare: face.compare,
        compare_mask: test.compare_mask,
        write_mask: test.write_mask,
        pass: face.pass,
        fail: face.fail,
        depth_fail: face.depth_fail,
    };
    gpu::StencilState { front: face(&test.front), back: face(&test.back) }
}

/// A clear value in the kind of the format; integer formats take the rounded numbers.
fn clear_color(format: vk::Format, color: [f32; 4]) -> gpu::ClearColor {
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
fn rect_2d(rect: Rect, extent: [u32; 2]) -> vk::Rect2D {
    let (x, y) = (rect.x_px.min(extent[0]), rect.y_px.min(extent[1]));
    vk::Rect2D {
        offset: vk::Offset2D { x: x.cast_signed(), y: y.cast_signed() },
        extent: vk::Extent2D {
            width: rect.width_px.min(extent[0] - x),
            height: rect.height_px.min(extent[1] - y),
        },
    }
}

impl BarrierList {
    fn record(&self, encoder: &mut gpu::Encoder) {
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
    fn record(&self, encoder: &mut gpu::Encoder) {
        encoder.bind_pipeline(&self.pipeline);
        encoder.push_descriptors(&self.push_set);
        if let Some(set) = &self.texture_set {
            encoder.bind_descriptor_set(set);
        }
    }
}

impl Body {
    fn record(&self, encoder: &mut gpu::Encoder) -> Result<(), GpuError> {
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
    fn record(&self, encoder: &mut gpu::Encoder) {
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
            BoundCall::Indirect { buffer, offset, count, stride } => {
                encoder.draw_indirect(buffer, *offset, *count, *stride);
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
