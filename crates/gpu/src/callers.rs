//! Commands and images of another program: what Afterlight records goes into its command buffer, a picture into its image.

use crate::{Device, GpuError, Image, Recording};
use ash::vk;

/// A command buffer of another program, which Afterlight adds to.
pub struct CallersCommands {
    raw: vk::CommandBuffer,
}

impl CallersCommands {
    /// Names a command buffer that is recording.
    ///
    /// # Safety
    /// - `raw` is a primary command buffer of the device that was adopted, of the family of its queue; while the value is used it records,
    ///   outside of rendering and without active queries, and no other thread uses it.
    /// - It is submitted once at most, to the queue that was adopted, and command buffers are submitted in the order in which frames were
    ///   recorded into them: frames of a technique share memory.
    /// - Nobody says that a frame is done before the device is done with the command buffer, or it is certain that it will never be
    ///   submitted. What recorded the frame is dropped only then.
    pub unsafe fn new(raw: vk::CommandBuffer) -> CallersCommands {
        CallersCommands { raw }
    }
}

/// Where in an image of another program a picture is put.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    image: vk::Image,
    /// Format of the image.
    pub format: vk::Format,
    /// Where the picture's first pixel goes, from the left and from the top, pixels.
    pub offset_px: [u32; 2],
    /// Layout before; `UNDEFINED` gives up what the image held, also beside the picture.
    pub layout_before: vk::ImageLayout,
    /// Layout after.
    pub layout_after: vk::ImageLayout,
}

impl Target {
    /// Names an image: colour, one sample; its first level and layer get the picture. The picture's pixels are coded in sRGB: they are copied
    /// as they are into `R8G8B8A8_UNORM` and `R8G8B8A8_SRGB`, and their channels exchanged for `B8G8R8A8_UNORM`.
    ///
    /// # Safety
    /// `image` is of the device that was adopted, has the usage `TRANSFER_DST`, is of `format`, will be in `layout_before` when the commands
    /// run, holds the picture at `offset_px`, and lives until they are done.
    pub unsafe fn new(
        image: vk::Image,
        format: vk::Format,
        offset_px: [u32; 2],
        [layout_before, layout_after]: [vk::ImageLayout; 2],
    ) -> Target {
        Target { image, format, offset_px, layout_before, layout_after }
    }
}

const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};
const LAYER: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

/// A change of layout that waits for all commands before and that all commands after wait for.
fn change(image: vk::Image, [from, to]: [vk::ImageLayout; 2]) -> vk::ImageMemoryBarrier2<'static> {
    let any = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
    vk::ImageMemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .dst_access_mask(any)
        .old_layout(from)
        .new_layout(to)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(WHOLE)
}

impl Device {
    /// Checks that a picture of `format` can be put into a target.
    ///
    /// # Errors
    /// [`GpuError::TargetFormat`].
    pub fn check_target(&self, target: &Target) -> Result<(), GpuError> {
        match target.format {
            vk::Format::R8G8B8A8_UNORM | vk::Format::R8G8B8A8_SRGB | vk::Format::B8G8R8A8_UNORM => Ok(()),
            found => Err(GpuError::TargetFormat { found }),
        }
    }

    /// Adds recorded commands to the caller's. They must have been recorded for it ([`Device::encoder_for_callers`]), and be with no other
    /// command buffer.
    ///
    /// # Panics
    /// If they were recorded to be submitted.
    pub fn execute_in(&self, commands: &CallersCommands, recording: &mut Recording) {
        let secondary = recording.hand_over();
        // SAFETY: the contract of `CallersCommands` holds for the one; the other has ended, is of the same family, and its resources are
        // held until the caller says that it is done.
        unsafe { self.0.raw.cmd_execute_commands(commands.raw, &[secondary]) };
    }

    /// Adds a copy of an image to the caller's commands: 8-bit RGBA in `layout`, in which it is afterwards too, one sample, first level and layer. The
    /// image must be held until the commands are done.
    ///
    /// # Errors
    /// [`GpuError::TargetFormat`].
    pub fn copy_to_target(
        &self,
        commands: &CallersCommands,
        image: &Image,
        layout: vk::ImageLayout,
        target: &Target,
    ) -> Result<(), GpuError> {
        self.check_target(target)?;
        let (from, to) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let source = image.0.raw;
        let [width, height] = image.extent();
        let [x, y] = target.offset_px.map(|at| at as i32);
        let barriers = |changes: [vk::ImageMemoryBarrier2<'_>; 2]| {
            let info = vk::DependencyInfo::default().image_memory_barriers(&changes);
            // SAFETY: the contracts of `CallersCommands` and `Target`; so for every command of this function. The source is held by the
            // frame that drew it.
            unsafe { self.0.raw.cmd_pipeline_barrier2(commands.raw, &info) };
        };
        barriers([change(source, [layout, from]), change(target.image, [target.layout_before, to])]);
        if target.format == vk::Format::B8G8R8A8_UNORM {
            let corner = |[x, y]: [i32; 2], z| vk::Offset3D { x, y, z };
            let [w, h] = [width, height].map(|size| size as i32);
            let region = vk::ImageBlit::default()
                .src_subresource(LAYER)
                .src_offsets([corner([0, 0], 0), corner([w, h], 1)])
                .dst_subresource(LAYER)
                .dst_offsets([corner([x, y], 0), corner([x + w, y + h], 1)]);
            // SAFETY: as above.
            unsafe {
                let nearest = vk::Filter::NEAREST;
                self.0.raw.cmd_blit_image(commands.raw, source, from, target.image, to, &[region], nearest);
            }
        } else {
            let region = vk::ImageCopy::default()
                .src_subresource(LAYER)
                .dst_subresource(LAYER)
                .dst_offset(vk::Offset3D { x, y, z: 0 })
                .extent(vk::Extent3D { width, height, depth: 1 });
            // SAFETY: as above.
            unsafe { self.0.raw.cmd_copy_image(commands.raw, source, from, target.image, to, &[region]) };
        }
        barriers([change(source, [from, layout]), change(target.image, [to, target.layout_after])]);
        Ok(())
    }
}
