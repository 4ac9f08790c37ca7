//! Recording commands, submitting them, and what comes back: timestamps and statistics.

use crate::device::c_name;
use crate::recorder::{CHECKPOINTS_MAX, QUERIES_PER_POOL, Recorder, query_pool};
use crate::{Buffer, DescriptorSet, Device, GpuError, Image, ImageView, Pipeline, PushSet, Recording};
use ash::vk;

/// What is counted, in the order of the flags' bits, which is the order of the results.
const STATISTICS: [vk::QueryPipelineStatisticFlags; 7] = [
    vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_VERTICES,
    vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_PRIMITIVES,
    vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS,
    vk::QueryPipelineStatisticFlags::CLIPPING_INVOCATIONS,
    vk::QueryPipelineStatisticFlags::CLIPPING_PRIMITIVES,
    vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS,
    vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS,
];

/// Stages and accesses on one side of a barrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Access {
    /// Pipeline stages.
    pub stages: vk::PipelineStageFlags2,
    /// Memory accesses.
    pub access: vk::AccessFlags2,
}

/// Orders all memory accesses of `before` ahead of those of `after`.
#[derive(Clone, Copy, Debug)]
pub struct MemoryBarrier {
    /// What must be done.
    pub before: Access,
    /// What waits.
    pub after: Access,
}

/// Orders accesses to a range of a buffer.
#[derive(Clone, Copy, Debug)]
pub struct BufferBarrier<'a> {
    /// The buffer.
    pub buffer: &'a Buffer,
    /// Where the range begins, in bytes.
    pub offset: u64,
    /// Its length in bytes; `u64::MAX` reaches to the end.
    pub bytes: u64,
    /// What must be done.
    pub before: Access,
    /// What waits.
    pub after: Access,
}

/// Orders accesses to a part of an image and changes its layout.
#[derive(Clone, Copy, Debug)]
pub struct ImageBarrier<'a> {
    /// The image.
    pub image: &'a Image,
    /// Which part.
    pub range: vk::ImageSubresourceRange,
    /// What must be done.
    pub before: Access,
    /// What waits.
    pub after: Access,
    /// The layout that the part is in; `UNDEFINED` gives its contents up.
    pub old_layout: vk::ImageLayout,
    /// The layout that it gets.
    pub new_layout: vk::ImageLayout,
}

/// What happens to an attachment's contents at the start of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load<T> {
    /// Cleared to a value.
    Clear(T),
    /// Kept.
    Keep,
    /// The contents are undefined: the pass writes everything that is read later.
    DontCare,
}

impl<T> Load<T> {
    fn op(&self) -> vk::AttachmentLoadOp {
        match self {
            Load::Clear(_) => vk::AttachmentLoadOp::CLEAR,
            Load::Keep => vk::AttachmentLoadOp::LOAD,
            Load::DontCare => vk::AttachmentLoadOp::DONT_CARE,
        }
    }
}

/// A clear value in the kind of the format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearColor {
    /// For float and normalised formats.
    Float([f32; 4]),
    /// For unsigned integer formats.
    Uint([u32; 4]),
    /// For signed integer formats.
    Sint([i32; 4]),
}

impl ClearColor {
    fn raw(self) -> vk::ClearColorValue {
        match self {
            ClearColor::Float(float32) => vk::ClearColorValue { float32 },
            ClearColor::Uint(uint32) => vk::ClearColorValue { uint32 },
            ClearColor::Sint(int32) => vk::ClearColorValue { int32 },
        }
    }
}

/// Where the samples of an attachment are resolved to at the end of a pass.
#[derive(Clone, Copy)]
pub struct Resolve<'a> {
    /// An image with one sample, in the layout `COLOR_ATTACHMENT_OPTIMAL`.
    pub view: &'a ImageView,
    /// How.
    pub mode: vk::ResolveModeFlags,
}

/// A colour attachment, in the layout `COLOR_ATTACHMENT_OPTIMAL`.
#[derive(Clone, Copy)]
pub struct ColorAttachment<'a> {
    /// The image: one level.
    pub view: &'a ImageView,
    /// What happens to its contents at the start of the pass.
    pub load: Load<ClearColor>,
    /// Whether what is drawn is kept.
    pub store: bool,
    /// Where its samples are resolved to.
    pub resolve: Option<Resolve<'a>>,
}

/// The depth attachment.
#[derive(Clone, Copy)]
pub struct DepthAttachment<'a> {
    /// The image: one level, with all aspects of its format.
    pub view: &'a ImageView,
    /// The layout that it is in.
    pub layout: vk::ImageLayout,
    /// What happens to its contents at the start of the pass.
    pub load: Load<f32>,
    /// Whether what is drawn is kept.
    pub store: bool,
}

/// The stencil attachment.
#[derive(Clone, Copy)]
pub struct StencilAttachment<'a> {
    /// The image: one level, with all aspects of its format.
    pub view: &'a ImageView,
    /// The layout that it is in.
    pub layout: vk::ImageLayout,
    /// What happens to its contents at the start of the pass.
    pub load: Load<u32>,
    /// Whether what is drawn is kept.
    pub store: bool,
}

/// What a pass draws to.
#[derive(Clone, Copy)]
pub struct Rendering<'a> {
    /// Width and height in pixels; the viewport and the scissor are set to it.
    pub extent: [u32; 2],
    /// Layers; 1 without layered drawing.
    pub layers: u32,
    /// Colour attachments in order of location.
    pub colors: &'a [ColorAttachment<'a>],
    /// Depth.
    pub depth: Option<DepthAttachment<'a>>,
    /// Stencil.
    pub stencil: Option<StencilAttachment<'a>>,
}

/// A timestamp of an encoder, to be looked up in its [`Completed`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TimestampId(u32);

/// A statistics query of an encoder, to be looked up in its [`Completed`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StatisticsId(u32);

/// What the pipeline counted between the begin and the end of a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Vertices fetched.
    pub input_vertices: u64,
    /// Primitives assembled.
    pub input_primitives: u64,
    /// Runs of the vertex shader.
    pub vertex_invocations: u64,
    /// Primitives that reached clipping.
    pub clipping_invocations: u64,
    /// Primitives that came out of clipping.
    pub clipping_primitives: u64,
    /// Runs of the fragment shader.
    pub fragment_invocations: u64,
    /// Runs of compute shaders.
    pub compute_invocations: u64,
}

/// What a submission brought back.
#[derive(Clone, Debug, Default)]
pub struct Completed {
    pub(crate) ticks: Vec<u64>,
    pub(crate) tick_ns: f64,
    pub(crate) tick_mask: u64,
    pub(crate) statistics: Vec<Statistics>,
}

impl Completed {
    /// Nanoseconds from `from` to `to`, right across one overflow of the counter; `None` where the queue has no
    /// timestamps.
    ///
    /// # Panics
    /// If a timestamp is of another encoder with more of them.
    pub fn elapsed_ns(&self, from: TimestampId, to: TimestampId) -> Option<f64> {
        if self.tick_mask == 0 {
            return None;
        }
        let ticks = self.ticks[to.0 as usize].wrapping_sub(self.ticks[from.0 as usize]) & self.tick_mask;
        Some(ticks as f64 * self.tick_ns)
    }

    /// The device's time of a timestamp, nanoseconds since some moment of its own; `None` where the queue has no timestamps. It begins anew
    /// where the device's counter does.
    ///
    /// # Panics
    /// If the timestamp is of another encoder with more of them.
    pub fn ns(&self, id: TimestampId) -> Option<f64> {
        (self.tick_mask != 0).then(|| (self.ticks[id.0 as usize] & self.tick_mask) as f64 * self.tick_ns)
    }

    /// What a query counted; `None` where the device has no statistics queries.
    pub fn statistics(&self, id: StatisticsId) -> Option<Statistics> {
        self.statistics.get(id.0 as usize).copied()
    }
}

/// The resources that recorded commands use, kept alive until the device is done with them.
#[allow(dead_code)] // Held for its drop alone.
pub(crate) enum Held {
    Buffer(Buffer),
    Image(Image),
    PushSet(PushSet),
    Set(DescriptorSet),
}

/// Records commands. What it records it keeps alive until the submission is done.
///
/// Barriers and layouts are the caller's: see [`Encoder::barriers`].
pub struct Encoder {
    device: Device,
    /// `None` only once submitted or dropped.
    recorder: Option<Recorder>,
    commands: vk::CommandBuffer,
    kept: Vec<Held>,
    bound: Option<Pipeline>,
    is_rendering: bool,
    timestamp_count: u32,
    statistics_count: u32,
    /// The query that counts at the moment.
    counting: Option<StatisticsId>,
    open_labels: Vec<usize>,
    labels: Vec<String>,
}

impl Encoder {
    pub(crate) fn new(
        device: Device,
        mut recorder: Recorder,
        how_often: vk::CommandBufferUsageFlags,
    ) -> Result<Encoder, GpuError> {
        if let Err(error) = recorder.begin(&device.0.raw, how_often) {
            device.give_back(recorder);
            return Err(error);
        }
        let commands = recorder.commands;
        Ok(Encoder {
            device,
            recorder: Some(recorder),
            commands,
            kept: Vec::with_capacity(64),
            bound: None,
            is_rendering: false,
            timestamp_count: 0,
            statistics_count: 0,
            counting: None,
            open_labels: Vec::new(),
            labels: Vec::new(),
        })
    }

    fn raw(&self) -> &ash::Device {
        &self.device.0.raw
    }

    fn keep_buffer(&mut self, buffer: &Buffer) {
        self.kept.push(Held::Buffer(buffer.clone()));
    }

    fn keep_image(&mut self, image: &Image) {
        self.kept.push(Held::Image(image.clone()));
    }

    /// Records barriers, all at once.
    pub fn barriers(
        &mut self,
        memory: &[MemoryBarrier],
        buffers: &[BufferBarrier<'_>],
        images: &[ImageBarrier<'_>],
    ) {
        if memory.is_empty() && buffers.is_empty() && images.is_empty() {
            return;
        }
        let memory: Vec<_> = memory
            .iter()
            .map(|b| {
                vk::MemoryBarrier2::default()
                    .src_stage_mask(b.before.stages)
                    .src_access_mask(b.before.access)
                    .dst_stage_mask(b.after.stages)
                    .dst_access_mask(b.after.access)
            })
            .collect();
        let raw_buffers: Vec<_> = buffers
            .iter()
            .map(|b| {
                vk::BufferMemoryBarrier2::default()
                    .src_stage_mask(b.before.stages)
                    .src_access_mask(b.before.access)
                    .dst_stage_mask(b.after.stages)
                    .dst_access_mask(b.after.access)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .buffer(b.buffer.0.raw)
                    .offset(b.offset)
                    .size(if b.bytes == 0 { vk::WHOLE_SIZE } else { b.bytes })
            })
            .collect();
        let raw_images: Vec<_> = images
            .iter()
            .map(|b| {
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(b.before.stages)
                    .src_access_mask(b.before.access)
                    .dst_stage_mask(b.after.stages)
                    .dst_access_mask(b.after.access)
                    .old_layout(b.old_layout)
                    .new_layout(b.new_layout)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .image(b.image.0.raw)
                    .subresource_range(b.range)
            })
            .collect();
        let info = vk::DependencyInfo::default()
            .memory_barriers(&memory)
            .buffer_memory_barriers(&raw_buffers)
            .image_memory_barriers(&raw_images);
        // SAFETY: the command buffer is recording; the resources are alive, and kept below. So for every command.
        unsafe { self.raw().cmd_pipeline_barrier2(self.commands, &info) };
        self.kept.extend(buffers.iter().map(|b| Held::Buffer(b.buffer.clone())));
        self.kept.extend(images.iter().map(|b| Held::Image(b.image.clone())));
    }

    /// Begins to draw. Viewport and scissor become the whole extent, culling is off, front faces are counter-clockwise in
    /// framebuffer space, the stencil reference and the depth bias are 0.
    ///
    /// # Panics
    /// If drawing has begun already.
    pub fn begin_rendering(&mut self, rendering: &Rendering<'_>) {
        assert!(!self.is_rendering, "begin_rendering within rendering");
        self.is_rendering = true;
        let colors: Vec<_> = rendering.colors.iter().map(color_attachment).collect();
        let depth = rendering.depth.as_ref().map(depth_attachment);
        let stencil = rendering.stencil.as_ref().map(stencil_attachment);
        let area = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D { width: rendering.extent[0], height: rendering.extent[1] },
        };
        let mut info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(rendering.layers)
            .color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        if let Some(stencil) = &stencil {
            info = info.stencil_attachment(stencil);
        }
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_begin_rendering(self.commands, &info) };
        for color in rendering.colors {
            self.keep_image(color.view.image());
            if let Some(resolve) = &color.resolve {
                self.keep_image(resolve.view.image());
            }
        }
        let depth_view = rendering.depth.map(|d| d.view).or(rendering.stencil.map(|s| s.view));
        if let Some(view) = depth_view {
            self.keep_image(view.image());
        }
        let [width, height] = rendering.extent;
        self.set_viewport([0.0, 0.0, width as f32, height as f32], [0.0, 1.0]);
        self.set_scissor(area);
        self.set_cull_mode(vk::CullModeFlags::NONE);
        self.set_front_face(vk::FrontFace::COUNTER_CLOCKWISE);
        self.set_stencil_reference(0);
        self.set_depth_bias(0.0, 0.0, 0.0);
    }

    /// Ends drawing.
    ///
    /// # Panics
    /// If drawing has not begun.
    pub fn end_rendering(&mut self) {
        assert!(self.is_rendering, "end_rendering without begin_rendering");
        self.is_rendering = false;
        // SAFETY: as in `barriers`; rendering has begun.
        unsafe { self.raw().cmd_end_rendering(self.commands) };
    }

    /// Makes `pipeline` the one that draws, or that is dispatched.
    pub fn bind_pipeline(&mut self, pipeline: &Pipeline) {
        // SAFETY: as in `barriers`; pipelines live as long as the device.
        unsafe { self.raw().cmd_bind_pipeline(self.commands, pipeline.inner.bind_point, pipeline.inner.raw) };
        self.bound = Some(pipeline.clone());
    }

    fn bound(&self) -> &Pipeline {
        self.bound.as_ref().expect("a pipeline must be bound first")
    }

    /// Pushes descriptors to set 0 of the bound pipeline.
    ///
    /// # Panics
    /// If no pipeline is bound.
    pub fn push_descriptors(&mut self, set: &PushSet) {
        if set.0.writes.is_empty() {
            return;
        }
        let pipeline = &self.bound().inner;
        // SAFETY: as in `barriers`; the set keeps its resources.
        unsafe {
            let push = &self.device.0.push;
            push.cmd_push_descriptor_set(
                self.commands,
                pipeline.bind_point,
                pipeline.layout,
                0,
                &set.0.writes,
            );
        }
        self.kept.push(Held::PushSet(set.clone()));
    }

    /// Binds a long-lived set as set 1 of the bound pipeline.
    ///
    /// # Panics
    /// If no pipeline is bound.
    pub fn bind_descriptor_set(&mut self, set: &DescriptorSet) {
        let pipeline = &self.bound().inner;
        // SAFETY: as in `barriers`; the set keeps its resources.
        unsafe {
            let (point, layout) = (pipeline.bind_point, pipeline.layout);
            self.raw().cmd_bind_descriptor_sets(self.commands, point, layout, 1, &[set.0.raw], &[]);
        }
        self.kept.push(Held::Set(set.clone()));
    }

    /// Sets push constants of the bound pipeline, from their begin.
    ///
    /// # Panics
    /// If no pipeline is bound, or it has fewer bytes of push constants.
    pub fn push_constants(&mut self, data: &[u8]) {
        if data.is_empty() {
            return;
        }
        let pipeline = &self.bound().inner;
        assert!(
            data.len() <= pipeline.push_constant_bytes as usize && data.len().is_multiple_of(4),
            "{}: {} bytes of push constants, the pipeline has {}",
            self.bound().name(),
            data.len(),
            pipeline.push_constant_bytes
        );
        // SAFETY: as in `barriers`; the range has been checked.
        unsafe {
            self.raw().cmd_push_constants(self.commands, pipeline.layout, pipeline.push_stages, 0, data);
        }
    }

    /// Sets the viewport: x, y, width, height in pixels, and the range of depth.
    pub fn set_viewport(&mut self, rect_px: [f32; 4], depth: [f32; 2]) {
        let [x, y, width, height] = rect_px;
        let viewport = vk::Viewport { x, y, width, height, min_depth: depth[0], max_depth: depth[1] };
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_set_viewport(self.commands, 0, &[viewport]) };
    }

    /// Sets the scissor rectangle, in pixels.
    pub fn set_scissor(&mut self, rect: vk::Rect2D) {
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_set_scissor(self.commands, 0, &[rect]) };
    }

    /// Sets which faces are dropped.
    pub fn set_cull_mode(&mut self, cull: vk::CullModeFlags) {
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_set_cull_mode(self.commands, cull) };
    }

    /// Sets which winding, in framebuffer space, is the front.
    pub fn set_front_face(&mut self, front: vk::FrontFace) {
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_set_front_face(self.commands, front) };
    }

    /// Sets the stencil reference of both faces.
    pub fn set_stencil_reference(&mut self, reference: u32) {
        // SAFETY: as in `barriers`.
        unsafe {
            self.raw().cmd_set_stencil_reference(
                self.commands,
                vk::StencilFaceFlags::FRONT_AND_BACK,
                reference,
            )
        };
    }

    /// Sets the depth bias: constant in the depth format's smallest steps, clamp in depth, slope in depth a pixel.
    /// The clamp is 0 where the device has none.
    pub fn set_depth_bias(&mut self, constant: f32, clamp: f32, slope: f32) {
        let clamp = if self.device.features().depth_bias_clamp { clamp } else { 0.0 };
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_set_depth_bias(self.commands, constant, clamp, slope) };
    }

    /// Binds vertex buffers from `first` on: each with its offset in bytes.
    pub fn bind_vertex_buffers(&mut self, first: u32, buffers: &[(&Buffer, u64)]) {
        if buffers.is_empty() {
            return;
        }
        let raw: Vec<_> = buffers.iter().map(|(b, _)| b.0.raw).collect();
        let offsets: Vec<_> = buffers.iter().map(|(_, offset)| *offset).collect();
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_bind_vertex_buffers(self.commands, first, &raw, &offsets) };
        self.kept.extend(buffers.iter().map(|(b, _)| Held::Buffer((*b).clone())));
    }

    /// Binds the index buffer from `offset` bytes on.
    pub fn bind_index_buffer(&mut self, buffer: &Buffer, offset: u64, index_type: vk::IndexType) {
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_bind_index_buffer(self.commands, buffer.0.raw, offset, index_type) };
        self.keep_buffer(buffer);
    }

    /// Draws.
    pub fn draw(&mut self, vertices: u32, instances: u32, first_vertex: u32, first_instance: u32) {
        // SAFETY: as in `barriers`; a pipeline is bound.
        unsafe { self.raw().cmd_draw(self.commands, vertices, instances, first_vertex, first_instance) };
    }

    /// Draws with indices.
    pub fn draw_indexed(
        &mut self,
        indices: u32,
        instances: u32,
        first_index: u32,
        vertex_offset: i32,
        first_instance: u32,
    ) {
        // SAFETY: as in `barriers`; a pipeline and an index buffer are bound.
        unsafe {
            self.raw().cmd_draw_indexed(
                self.commands,
                indices,
                instances,
                first_index,
                vertex_offset,
                first_instance,
            );
        }
    }

    /// Draws `count` times with arguments from `buffer` (`VkDrawIndexedIndirectCommand`), `stride` bytes apart.
    pub fn draw_indexed_indirect(&mut self, buffer: &Buffer, offset: u64, count: u32, stride: u32) {
        self.for_each_batch(offset, count, stride, |raw, commands, offset, count| {
            // SAFETY: as in `barriers`.
            unsafe { raw.cmd_draw_indexed_indirect(commands, buffer.0.raw, offset, count, stride) };
        });
        self.keep_buffer(buffer);
    }

    /// Splits an indirect call into as many as the device needs: one draw each without `multiDrawIndirect`.
    fn for_each_batch(
        &self,
        offset: u64,
        count: u32,
        stride: u32,
        record: impl Fn(&ash::Device, vk::CommandBuffer, u64, u32),
    ) {
        let features = self.device.features();
        let batch = if features.multi_draw_indirect { features.max_draw_indirect_count.max(1) } else { 1 };
        let mut done = 0;
        while done < count {
            let next = batch.min(count - done);
            record(self.raw(), self.commands, offset + u64::from(done) * u64::from(stride), next);
            done += next;
        }
    }

    /// Draws as often as the word at `count_offset` of `count_buffer` says, at most `max_count` times, with arguments
    /// from `buffer` (`VkDrawIndexedIndirectCommand`). Needs [`crate::Features::draw_indirect_count`].
    pub fn draw_indexed_indirect_count(
        &mut self,
        buffer: &Buffer,
        offset: u64,
        count_buffer: &Buffer,
        count_offset: u64,
        max_count: u32,
        stride: u32,
    ) {
        let (arguments, count) = (buffer.0.raw, count_buffer.0.raw);
        // SAFETY: as in `barriers`.
        unsafe {
            self.raw().cmd_draw_indexed_indirect_count(
                self.commands,
                arguments,
                offset,
                count,
                count_offset,
                max_count,
                stride,
            );
        }
        self.keep_buffer(buffer);
        self.keep_buffer(count_buffer);
    }

    /// Runs the bound compute pipeline over `groups` workgroups. A dimension of 0 does nothing.
    pub fn dispatch(&mut self, groups: [u32; 3]) {
        if groups.contains(&0) {
            return;
        }
        // SAFETY: as in `barriers`; a compute pipeline is bound.
        unsafe { self.raw().cmd_dispatch(self.commands, groups[0], groups[1], groups[2]) };
    }

    /// Runs the bound compute pipeline over the workgroups that `buffer` says (`VkDispatchIndirectCommand`).
    pub fn dispatch_indirect(&mut self, buffer: &Buffer, offset: u64) {
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_dispatch_indirect(self.commands, buffer.0.raw, offset) };
        self.keep_buffer(buffer);
    }

    /// Clears the stencil of the current attachment within `rect`.
    pub fn clear_stencil(&mut self, value: u32, rect: vk::Rect2D, layers: u32) {
        assert!(self.is_rendering, "attachments are cleared within rendering");
        let clear = vk::ClearAttachment {
            aspect_mask: vk::ImageAspectFlags::STENCIL,
            color_attachment: 0,
            clear_value: vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: value },
            },
        };
        let rect = vk::ClearRect { rect, base_array_layer: 0, layer_count: layers };
        // SAFETY: as in `barriers`; rendering has begun.
        unsafe { self.raw().cmd_clear_attachments(self.commands, &[clear], &[rect]) };
    }

    /// Copies bytes from buffer to buffer.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`] with the buffer's name.
    pub fn copy_buffer(
        &mut self,
        from: &Buffer,
        from_offset: u64,
        to: &Buffer,
        to_offset: u64,
        bytes: u64,
    ) -> Result<(), GpuError> {
        from.check_range(from_offset, bytes)?;
        to.check_range(to_offset, bytes)?;
        if bytes > 0 {
            let region = vk::BufferCopy { src_offset: from_offset, dst_offset: to_offset, size: bytes };
            // SAFETY: as in `barriers`; the ranges have been checked.
            unsafe { self.raw().cmd_copy_buffer(self.commands, from.0.raw, to.0.raw, &[region]) };
            self.keep_buffer(from);
            self.keep_buffer(to);
        }
        Ok(())
    }

    /// Copies texels from image (in `TRANSFER_SRC_OPTIMAL`) to image (in `TRANSFER_DST_OPTIMAL`).
    pub fn copy_image(&mut self, from: &Image, to: &Image, regions: &[vk::ImageCopy]) {
        let (src, dst) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_copy_image(self.commands, from.0.raw, src, to.0.raw, dst, regions) };
        self.keep_image(from);
        self.keep_image(to);
    }

    /// Copies texels from a buffer to an image in `TRANSFER_DST_OPTIMAL`.
    pub fn copy_buffer_to_image(&mut self, from: &Buffer, to: &Image, regions: &[vk::BufferImageCopy]) {
        let dst = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_copy_buffer_to_image(self.commands, from.0.raw, to.0.raw, dst, regions) };
        self.keep_buffer(from);
        self.keep_image(to);
    }

    /// Copies from an image in `TRANSFER_SRC_OPTIMAL` to a buffer.
    pub fn copy_image_to_buffer(&mut self, from: &Image, to: &Buffer, regions: &[vk::BufferImageCopy]) {
        let src = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: as in `barriers`.
        unsafe { self.raw().cmd_copy_image_to_buffer(self.commands, from.0.raw, src, to.0.raw, regions) };
        self.keep_image(from);
        self.keep_buffer(to);
    }

    /// Fills the whole of a buffer with a word.
    pub fn fill_buffer(&mut self, buffer: &Buffer, value: u32) {
        // SAFETY: as in `barriers`; buffers are multiples of 16 bytes on the device.
        unsafe { self.raw().cmd_fill_buffer(self.commands, buffer.0.raw, 0, vk::WHOLE_SIZE, value) };
        self.keep_buffer(buffer);
    }

    /// Clears colour images outside a pass; `layout` is `TRANSFER_DST_OPTIMAL` or `GENERAL`.
    pub fn clear_color_image(
        &mut self,
        image: &Image,
        layout: vk::ImageLayout,
        value: ClearColor,
        range: vk::ImageSubresourceRange,
    ) {
        // SAFETY: as in `barriers`.
        unsafe {
            self.raw().cmd_clear_color_image(self.commands, image.0.raw, layout, &value.raw(), &[range]);
        }
        self.keep_image(image);
    }

    /// Clears depth images outside a pass, and their stencils, to zero; `layout` is `TRANSFER_DST_OPTIMAL` or `GENERAL`.
    pub fn clear_depth_image(
        &mut self,
        image: &Image,
        layout: vk::ImageLayout,
        range: vk::ImageSubresourceRange,
    ) {
        let zero = vk::ClearDepthStencilValue::default();
        // SAFETY: as in `barriers`.
        unsafe {
            self.raw().cmd_clear_depth_stencil_image(self.commands, image.0.raw, layout, &zero, &[range]);
        }
        self.keep_image(image);
    }

    /// Opens a label: what follows belongs to the pass `name`, in captures and where the device is lost.
    pub fn begin_label(&mut self, name: &str) {
        if let Some(debug) = &self.device.0.debug {
            let c = c_name(name);
            let info = vk::DebugUtilsLabelEXT::default().label_name(&c);
            // SAFETY: as in `barriers`; the name is copied.
            unsafe { debug.cmd_begin_debug_utils_label(self.commands, &info) };
        }
        self.open_labels.push(self.labels.len());
        self.labels.push(name.to_owned());
    }

    /// Closes the label opened last. Outside rendering a checkpoint is written, by which a lost device names the pass.
    /// It orders nothing, so that measuring costs no overlap: where nothing else makes the device wait for the pass, the
    /// pass named may be one that was still running.
    ///
    /// # Panics
    /// If no label is open.
    pub fn end_label(&mut self) {
        let index = self.open_labels.pop().expect("end_label without begin_label");
        if let Some(debug) = &self.device.0.debug {
            // SAFETY: as in `barriers`; a label is open.
            unsafe { debug.cmd_end_debug_utils_label(self.commands) };
        }
        if self.is_rendering || index >= CHECKPOINTS_MAX {
            return;
        }
        if let Some(checkpoints) = self.recorder.as_ref().and_then(|r| r.checkpoints.as_ref()) {
            // SAFETY: the word lies within the buffer, which belongs to the recorder.
            unsafe { self.raw().cmd_fill_buffer(self.commands, checkpoints.buffer, 4 * index as u64, 4, 1) };
        }
    }

    /// Takes the time at which all earlier commands have completed `stage`.
    ///
    /// # Errors
    /// A driver that has no more query pools.
    pub fn timestamp(&mut self, stage: vk::PipelineStageFlags2) -> Result<TimestampId, GpuError> {
        let id = TimestampId(self.timestamp_count);
        if self.device.features().timestamp_valid_bits > 0 {
            let recorder = self.recorder.as_mut().expect("the encoder is recording");
            let pool = query_pool(
                &self.device.0.raw,
                &mut recorder.timestamp_pools,
                id.0,
                &vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP),
            )?;
            // SAFETY: as in `barriers`; the query has been reset and is used once.
            unsafe { self.raw().cmd_write_timestamp2(self.commands, stage, pool, id.0 % QUERIES_PER_POOL) };
        }
        self.timestamp_count += 1;
        Ok(id)
    }

    /// Begins to count what the pipeline does. Queries do not nest, and begin and end outside rendering.
    ///
    /// # Errors
    /// A driver that has no more query pools.
    ///
    /// # Panics
    /// Within rendering, or while another query counts.
    pub fn begin_statistics(&mut self) -> Result<StatisticsId, GpuError> {
        assert!(!self.is_rendering, "statistics begin outside rendering");
        assert!(self.counting.is_none(), "statistics begin while {:?} counts", self.counting);
        let id = StatisticsId(self.statistics_count);
        if self.device.features().pipeline_statistics {
            let recorder = self.recorder.as_mut().expect("the encoder is recording");
            let counted = STATISTICS.iter().fold(vk::QueryPipelineStatisticFlags::empty(), |all, &f| all | f);
            let pool = query_pool(
                &self.device.0.raw,
                &mut recorder.statistics_pools,
                id.0,
                &vk::QueryPoolCreateInfo::default()
                    .query_type(vk::QueryType::PIPELINE_STATISTICS)
                    .pipeline_statistics(counted),
            )?;
            let flags = vk::QueryControlFlags::empty();
            // SAFETY: as in `barriers`; the query has been reset and is used once.
            unsafe { self.raw().cmd_begin_query(self.commands, pool, id.0 % QUERIES_PER_POOL, flags) };
        }
        self.statistics_count += 1;
        self.counting = Some(id);
        Ok(id)
    }

    /// Ends the counting that `id` began.
    ///
    /// # Panics
    /// Within rendering, or if another query counts.
    pub fn end_statistics(&mut self, id: StatisticsId) {
        assert!(!self.is_rendering, "statistics end outside rendering");
        assert!(self.counting == Some(id), "{id:?} ends while {:?} counts", self.counting);
        self.counting = None;
        if self.device.features().pipeline_statistics {
            let recorder = self.recorder.as_ref().expect("the encoder is recording");
            let pool = recorder.statistics_pools[(id.0 / QUERIES_PER_POOL) as usize];
            // SAFETY: as in `barriers`; the query has begun.
            unsafe { self.raw().cmd_end_query(self.commands, pool, id.0 % QUERIES_PER_POOL) };
        }
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// Commands that the driver refuses.
    ///
    /// # Panics
    /// Within rendering, or while a query counts.
    pub fn finish(mut self) -> Result<Recording, GpuError> {
        assert!(!self.is_rendering, "submit within rendering");
        // A query without an end would be waited for without end.
        assert!(self.counting.is_none(), "submit while {:?} counts", self.counting);
        // What the device wrote becomes visible to the host, checkpoints and read-back buffers alike.
        let to_host = MemoryBarrier {
            before: Access {
                stages: vk::PipelineStageFlags2::ALL_COMMANDS,
                access: vk::AccessFlags2::MEMORY_WRITE,
            },
            after: Access { stages: vk::PipelineStageFlags2::HOST, access: vk::AccessFlags2::HOST_READ },
        };
        self.barriers(&[to_host], &[], &[]);
        // SAFETY: the command buffer is recording and outside rendering.
        unsafe { self.raw().end_command_buffer(self.commands) }
            .map_err(GpuError::call("vkEndCommandBuffer"))?;
        let recorder = self.recorder.take().expect("the encoder is recording");
        let counts = [self.timestamp_count, self.statistics_count];
        let (held, labels) = (std::mem::take(&mut self.kept), std::mem::take(&mut self.labels));
        Ok(Recording::new(self.device.clone(), recorder, held, labels, counts))
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            self.device.give_back(recorder);
        }
    }
}

/// In the order of [`STATISTICS`].
pub(crate) fn statistics(counts: [u64; 7]) -> Statistics {
    let [
        input_vertices,
        input_primitives,
        vertex_invocations,
        clipping_invocations,
        clipping_primitives,
        fragment_invocations,
        compute_invocations,
    ] = counts;
    Statistics {
        input_vertices,
        input_primitives,
        vertex_invocations,
        clipping_invocations,
        clipping_primitives,
        fragment_invocations,
        compute_invocations,
    }
}

/// Attachments in read-only layouts are not stored: a store counts as a write. `mixed` is the layout in which the
/// attachment's aspect alone is read-only.
fn store_op(layout: vk::ImageLayout, mixed: Option<vk::ImageLayout>, store: bool) -> vk::AttachmentStoreOp {
    let read_only = [
        vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL,
        vk::ImageLayout::STENCIL_READ_ONLY_OPTIMAL,
        vk::ImageLayout::READ_ONLY_OPTIMAL,
    ];
    match (read_only.contains(&layout) || mixed == Some(layout), store) {
        (true, _) => vk::AttachmentStoreOp::NONE,
        (false, true) => vk::AttachmentStoreOp::STORE,
        (false, false) => vk::AttachmentStoreOp::DONT_CARE,
    }
}

fn color_attachment(color: &ColorAttachment<'_>) -> vk::RenderingAttachmentInfo<'static> {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let mut info = vk::RenderingAttachmentInfo::default()
        .image_view(color.view.raw)
        .image_layout(layout)
        .load_op(color.load.op())
        .store_op(store_op(layout, None, color.store));
    if let Load::Clear(value) = color.load {
        info = info.clear_value(vk::ClearValue { color: value.raw() });
    }
    if let Some(resolve) = &color.resolve {
        info = info
            .resolve_mode(resolve.mode)
            .resolve_image_view(resolve.view.raw)
            .resolve_image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
    }
    info
}

fn depth_attachment(depth: &DepthAttachment<'_>) -> vk::RenderingAttachmentInfo<'static> {
    let cleared = if let Load::Clear(value) = depth.load { value } else { 0.0 };
    vk::RenderingAttachmentInfo::default()
        .image_view(depth.view.raw)
        .image_layout(depth.layout)
        .load_op(depth.load.op())
        .store_op(store_op(
            depth.layout,
            Some(vk::ImageLayout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL),
            depth.store,
        ))
        .clear_value(vk::ClearValue {
            depth_stencil: vk::ClearDepthStencilValue { depth: cleared, stencil: 0 },
        })
}

fn stencil_attachment(stencil: &StencilAttachment<'_>) -> vk::RenderingAttachmentInfo<'static> {
    let cleared = if let Load::Clear(value) = stencil.load { value } else { 0 };
    vk::RenderingAttachmentInfo::default()
        .image_view(stencil.view.raw)
        .image_layout(stencil.layout)
        .load_op(stencil.load.op())
        .store_op(store_op(
            stencil.layout,
            Some(vk::ImageLayout::DEPTH_ATTACHMENT_STENCIL_READ_ONLY_OPTIMAL),
            stencil.store,
        ))
        .clear_value(vk::ClearValue {
            depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: cleared },
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_passes_over_an_overflow_of_the_counter() {
        let completed = Completed {
            ticks: vec![0xffff_fff0, 0x10],
            tick_ns: 2.0,
            tick_mask: 0xffff_ffff,
            statistics: vec![],
        };
        assert_eq!(completed.elapsed_ns(TimestampId(0), TimestampId(1)), Some(64.0));
        let without = Completed { tick_mask: 0, ..completed };
        assert_eq!(without.elapsed_ns(TimestampId(0), TimestampId(1)), None);
    }
}
