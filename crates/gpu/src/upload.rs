//! Bringing data to the device at load time, and back for a look.
//!
//! Uploads pass through a ring of staging memory: while the device copies one part of it the next is filled. Where the
//! host can map the target itself (CPU devices, integrated GPUs) buffers are written without a copy.

use crate::device::{Submission, lost};
use crate::encoder::{Access, ImageBarrier};
use crate::format::format_info;
use crate::recorder::Recorder;
use crate::{Buffer, BufferDesc, Device, GpuError, Image, MemoryKind};
use ash::vk;

/// Staging memory of an uploader, all parts together, in bytes.
pub const UPLOAD_RING_BYTES: u64 = 32 << 20;
/// Parts of the ring: enough that filling and copying overlap.
const PARTS_COUNT: usize = 4;
const PART_BYTES: u64 = UPLOAD_RING_BYTES / PARTS_COUNT as u64;
/// Alignment of image data in the ring: a multiple of every texel block's bytes (12 and 16 among them).
const IMAGE_ALIGNMENT: u64 = 48;

/// Copies data into buffers and images. Nothing may be read by the device before [`Uploader::finish`].
pub struct Uploader {
    device: Device,
    /// Made as they are needed.
    parts: Vec<Part>,
    /// The part being filled.
    current: usize,
    /// Images that have left the undefined layout, each once.
    images: Vec<Image>,
}

struct Part {
    /// `None` only in `drop`.
    recorder: Option<Recorder>,
    staging: Buffer,
    used_bytes: u64,
    is_recording: bool,
    in_flight: Option<Submission>,
    /// Targets of copies, held until they are done.
    buffers: Vec<Buffer>,
}

impl Device {
    /// Begins uploads.
    ///
    /// # Errors
    /// None yet: staging memory is made at first need.
    pub fn uploader(&self) -> Result<Uploader, GpuError> {
        Ok(Uploader { device: self.clone(), parts: Vec::new(), current: 0, images: Vec::new() })
    }

    /// Copies `bytes` bytes at `offset` of a buffer to the host; waits for the device.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`], [`GpuError::OutOfMemory`], [`GpuError::DeviceLost`].
    pub fn download_buffer(&self, buffer: &Buffer, offset: u64, bytes: u64) -> Result<Vec<u8>, GpuError> {
        buffer.check_range(offset, bytes)?;
        let mut out = vec![0; bytes as usize];
        if buffer.is_mapped() {
            buffer.read(offset, &mut out)?;
            return Ok(out);
        }
        let staging = self.readback(buffer.name(), bytes)?;
        let mut encoder = self.encoder()?;
        encoder.copy_buffer(buffer, offset, &staging, 0, bytes)?;
        self.submit(encoder)?;
        staging.read(0, &mut out)?;
        Ok(out)
    }

    /// Copies one aspect of one level and layer of an image to the host, tightly packed rows from the top; waits for the
    /// device. The image is in `layout` before and after.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::DeviceLost`], [`GpuError::UnsupportedFormat`] for formats without a
    /// known size and images without the use `TRANSFER_SRC`.
    ///
    /// # Panics
    /// If the image is multisampled, or has no such level or layer.
    pub fn download_image(
        &self,
        image: &Image,
        layout: vk::ImageLayout,
        aspect: vk::ImageAspectFlags,
        mip: u32,
        layer: u32,
    ) -> Result<Vec<u8>, GpuError> {
        assert!(
            image.samples() == 1 && mip < image.mips() && layer < image.layers(),
            "download of level {mip}, layer {layer} of {image:?}"
        );
        let needed = vk::ImageUsageFlags::TRANSFER_SRC;
        let info =
            format_info(image.format()).filter(|_| image.usage().contains(needed)).ok_or_else(|| {
                GpuError::UnsupportedFormat {
                    resource: image.name().to_owned(),
                    format: image.format(),
                    usage: needed,
                }
            })?;
        let [width, height] = image.mip_extent(mip);
        let bytes = if aspect == vk::ImageAspectFlags::STENCIL {
            u64::from(width) * u64::from(height)
        } else {
            info.level_bytes(width, height)
        };
        let staging = self.readback(image.name(), bytes)?;
        let mut encoder = self.encoder()?;
        let all = Access {
            stages: vk::PipelineStageFlags2::ALL_COMMANDS,
            access: vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
        };
        let copy = Access { stages: vk::PipelineStageFlags2::COPY, access: vk::AccessFlags2::TRANSFER_READ };
        let source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let range = vk::ImageSubresourceRange {
            aspect_mask: image.aspect(),
            base_mip_level: mip,
            level_count: 1,
            base_array_layer: layer,
            layer_count: 1,
        };
        let there =
            ImageBarrier { image, range, before: all, after: copy, old_layout: layout, new_layout: source };
        encoder.barriers(&[], &[], &[there]);
        encoder.copy_image_to_buffer(
            image,
            &staging,
            &[copy_region(0, aspect, mip, layer, [0, height], width)],
        );
        let back =
            ImageBarrier { image, range, before: copy, after: all, old_layout: source, new_layout: layout };
        encoder.barriers(&[], &[], &[back]);
        self.submit(encoder)?;
        let mut out = vec![0; bytes as usize];
        staging.read(0, &mut out)?;
        Ok(out)
    }

    fn readback(&self, of: &str, bytes: u64) -> Result<Buffer, GpuError> {
        self.create_buffer(&BufferDesc {
            name: &format!("read-back of {of}"),
            bytes,
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryKind::Readback,
        })
    }
}

impl Uploader {
    /// Copies `data` to `offset` of `buffer`.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`], [`GpuError::OutOfMemory`], [`GpuError::DeviceLost`].
    pub fn buffer(&mut self, buffer: &Buffer, offset: u64, data: &[u8]) -> Result<(), GpuError> {
        if buffer.is_mapped() {
            return buffer.write(offset, data);
        }
        buffer.check_range(offset, data.len() as u64)?;
        let mut done = 0;
        while done < data.len() {
            let (place, bytes) = self.reserve(4, 1, (data.len() - done) as u64)?;
            let part = &mut self.parts[self.current];
            part.staging.write(place, &data[done..done + bytes as usize])?;
            let region = vk::BufferCopy { src_offset: place, dst_offset: offset + done as u64, size: bytes };
            let (commands, from) = (part.commands(), part.staging.0.raw);
            part.buffers.push(buffer.clone());
            // SAFETY: the command buffer is recording; the ranges have been checked; both buffers are held.
            unsafe { self.device.0.raw.cmd_copy_buffer(commands, from, buffer.0.raw, &[region]) };
            done += bytes as usize;
        }
        Ok(())
    }

    /// Copies `data`, the tightly packed texels of level `mip` of layer `layer`, rows from the top. The image leaves
    /// the uploader in `SHADER_READ_ONLY_OPTIMAL`; what was in it before the first call is lost.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`] where the length is not the level's, [`GpuError::UnsupportedFormat`] for formats without
    /// a known size and images without the use `TRANSFER_DST`, [`GpuError::OutOfMemory`], [`GpuError::DeviceLost`].
    ///
    /// # Panics
    /// If the image is multisampled, or has no such level or layer.
    pub fn image(&mut self, image: &Image, mip: u32, layer: u32, data: &[u8]) -> Result<(), GpuError> {
        assert!(
            image.samples() == 1 && mip < image.mips() && layer < image.layers(),
            "upload to level {mip}, layer {layer} of {image:?}"
        );
        let needed = vk::ImageUsageFlags::TRANSFER_DST;
        let info =
            format_info(image.format()).filter(|_| image.usage().contains(needed)).ok_or_else(|| {
                GpuError::UnsupportedFormat {
                    resource: image.name().to_owned(),
                    format: image.format(),
                    usage: needed,
                }
            })?;
        let [width, height] = image.mip_extent(mip);
        let level_bytes = info.level_bytes(width, height);
        if data.len() as u64 != level_bytes {
            return Err(GpuError::OutOfRange {
                resource: image.name().to_owned(),
                offset: 0,
                bytes: data.len() as u64,
                size: level_bytes,
            });
        }
        let row_bytes = info.level_bytes(width, 1);
        let mut done = 0;
        while done < data.len() {
            let (place, bytes) = self.reserve(IMAGE_ALIGNMENT, row_bytes, (data.len() - done) as u64)?;
            self.prepare_image(image);
            let first_row = (done as u64 / row_bytes) as u32 * info.block_texels[1];
            let row_count = ((bytes / row_bytes) as u32 * info.block_texels[1]).min(height - first_row);
            let part = &self.parts[self.current];
            part.staging.write(place, &data[done..done + bytes as usize])?;
            let region = copy_region(place, info.aspect, mip, layer, [first_row, row_count], width);
            let (commands, from) = (part.commands(), part.staging.0.raw);
            let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            // SAFETY: the command buffer is recording; the region lies in the level; buffer and image are held.
            unsafe {
                self.device.0.raw.cmd_copy_buffer_to_image(commands, from, image.0.raw, layout, &[region])
            };
            done += bytes as usize;
        }
        Ok(())
    }

    /// Waits until all is in place; images are then in `SHADER_READ_ONLY_OPTIMAL`.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`].
    pub fn finish(mut self) -> Result<(), GpuError> {
        let any = self.parts.iter().any(|p| p.is_recording);
        if any || !self.images.is_empty() {
            self.reserve(1, 1, 0)?;
            let commands = self.parts[self.current].commands();
            let barriers: Vec<_> = self
                .images
                .iter()
                .map(|image| {
                    layout_change(
                        image,
                        vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                        vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
                    )
                })
                .collect();
            let memory = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COPY)
                .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
            let info =
                vk::DependencyInfo::default().memory_barriers(&memory).image_memory_barriers(&barriers);
            // SAFETY: the command buffer is recording; the images are held by the uploader.
            unsafe { self.device.0.raw.cmd_pipeline_barrier2(commands, &info) };
            self.submit_current()?;
        }
        self.wait_all()
    }

    /// Finds room in the ring for `wanted` bytes, or for as many whole `unit`s as a part holds: offset and bytes.
    /// The current part is recording afterwards.
    fn reserve(&mut self, alignment: u64, unit: u64, wanted: u64) -> Result<(u64, u64), GpuError> {
        loop {
            self.begin_current()?;
            let part = &mut self.parts[self.current];
            let place = part.used_bytes.next_multiple_of(alignment);
            let room = PART_BYTES.saturating_sub(place) / unit * unit;
            // A part that is nearly full is left, unless it holds all that is wanted.
            if wanted <= room || room >= PART_BYTES / 2 {
                let bytes = wanted.min(room);
                part.used_bytes = place + bytes;
                return Ok((place, bytes));
            }
            self.submit_current()?;
            self.current = (self.current + 1) % PARTS_COUNT;
        }
    }

    fn begin_current(&mut self) -> Result<(), GpuError> {
        if self.current == self.parts.len() {
            let staging = self.device.create_buffer(&BufferDesc {
                name: "upload ring",
                bytes: PART_BYTES,
                usage: vk::BufferUsageFlags::TRANSFER_SRC,
                memory: MemoryKind::Upload,
            })?;
            let recorder = self.device.recorder()?;
            self.parts.push(Part {
                recorder: Some(recorder),
                staging,
                used_bytes: 0,
                is_recording: false,
                in_flight: None,
                buffers: Vec::new(),
            });
        }
        let part = &mut self.parts[self.current];
        part.wait(&self.device)?;
        if !part.is_recording {
            part.recorder_mut().begin(&self.device.0.raw, vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT)?;
            part.is_recording = true;
            part.used_bytes = 0;
        }
        Ok(())
    }

    fn submit_current(&mut self) -> Result<(), GpuError> {
        let part = &mut self.parts[self.current];
        let commands = part.commands();
        // SAFETY: the command buffer is recording.
        unsafe { self.device.0.raw.end_command_buffer(commands) }
            .map_err(GpuError::call("vkEndCommandBuffer"))?;
        part.is_recording = false;
        part.in_flight = Some(self.device.submit_raw(commands).map_err(lost("vkQueueSubmit2", "upload"))?);
        Ok(())
    }

    fn wait_all(&mut self) -> Result<(), GpuError> {
        self.parts.iter_mut().try_for_each(|part| part.wait(&self.device))
    }

    /// Brings an image to the layout of copies at its first use.
    fn prepare_image(&mut self, image: &Image) {
        if self.images.last().is_some_and(|i| i.same(image)) || self.images.iter().any(|i| i.same(image)) {
            return;
        }
        let change =
            [layout_change(image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::TRANSFER_DST_OPTIMAL)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&change);
        // SAFETY: the command buffer is recording; the image is held below.
        unsafe { self.device.0.raw.cmd_pipeline_barrier2(self.parts[self.current].commands(), &info) };
        self.images.push(image.clone());
    }
}

impl Part {
    fn recorder_mut(&mut self) -> &mut Recorder {
        self.recorder.as_mut().expect("a part has its recorder until it is dropped")
    }

    fn commands(&self) -> vk::CommandBuffer {
        self.recorder.as_ref().map_or(vk::CommandBuffer::null(), |r| r.commands)
    }

    fn wait(&mut self, device: &Device) -> Result<(), GpuError> {
        if let Some(submission) = self.in_flight {
            device.wait_for(submission).map_err(lost("vkWaitSemaphores", "upload"))?;
            self.in_flight = None;
            self.buffers.clear();
        }
        Ok(())
    }
}

impl Drop for Uploader {
    fn drop(&mut self) {
        // A lost device has stopped using its resources too, so that they may go.
        let _ = self.wait_all();
        for part in &mut self.parts {
            if let Some(recorder) = part.recorder.take() {
                self.device.give_back(recorder);
            }
        }
    }
}

fn layout_change<'a>(
    image: &Image,
    from: vk::ImageLayout,
    to: vk::ImageLayout,
) -> vk::ImageMemoryBarrier2<'a> {
    let copies = (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE);
    let (before, after) = if from == vk::ImageLayout::UNDEFINED {
        ((vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_WRITE), copies)
    } else {
        (copies, (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_READ))
    };
    vk::ImageMemoryBarrier2::default()
        .src_stage_mask(before.0)
        .src_access_mask(before.1)
        .dst_stage_mask(after.0)
        .dst_access_mask(after.1)
        .old_layout(from)
        .new_layout(to)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.0.raw)
        .subresource_range(image.full_range())
}

/// A copy between tightly packed rows at `offset` of a buffer and rows `[first, count]` of a level of one layer.
fn copy_region(
    offset: u64,
    aspect: vk::ImageAspectFlags,
    mip: u32,
    layer: u32,
    [first_row, row_count]: [u32; 2],
    width: u32,
) -> vk::BufferImageCopy {
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
        image_offset: vk::Offset3D { x: 0, y: first_row as i32, z: 0 },
        image_extent: vk::Extent3D { width, height: row_count, depth: 1 },
    }
}
