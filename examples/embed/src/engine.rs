//! The program's own Vulkan: instance, device, a canvas that it draws to, a triangle, a swapchain that shows the canvas.

use std::ffi::CStr;

use afterlight_techniques::graph::gpu::Needs;
use ash::{khr, vk};
use winit::{
    raw_window_handle::{HasDisplayHandle, HasWindowHandle},
    window::Window,
};

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

pub type Error = Box<dyn std::error::Error>;

/// Width and height of each half of the canvas, pixels.
pub const HALF: [u32; 2] = [320, 240];
pub const CANVAS_FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
/// Frames that are recorded before the first of them is waited for.
pub const IN_FLIGHT: u64 = 2;

/// The swapchain, for as long as the surface has its size.
struct Swapchain {
    raw: vk::SwapchainKHR,
    images: Vec<vk::Image>,
    /// Signalled when an image is ready to be shown: one an image, since a frame's number says nothing of when it is free again.
    drawn: Vec<vk::Semaphore>,
    extent: vk::Extent2D,
}

/// What a frame on its way has for itself.
struct Frame {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    acquired: vk::Semaphore,
    done: vk::Fence,
}

pub struct Engine {
    entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical: vk::PhysicalDevice,
    pub needs: Needs,
    pub device: ash::Device,
    pub queue: vk::Queue,
    surfaces: khr::surface::Instance,
    swapchains: khr::swapchain::Device,
    surface: vk::SurfaceKHR,
    swapchain: Option<Swapchain>,
    frames: Vec<Frame>,
    pub canvas: vk::Image,
    canvas_memory: vk::DeviceMemory,
    canvas_view: vk::ImageView,
    layout: vk::PipelineLayout,
    triangle: vk::Pipeline,
}

/// Extensions of the device: Afterlight's, and the program's own.
pub fn extensions(needs: &Needs) -> Vec<&'static CStr> {
    [needs.extensions(), &[khr::swapchain::NAME]].concat()
}

impl Engine {
    pub fn new(window: &Window) -> Result<Engine, Error> {
        // SAFETY: handles of this function are used while what they were made of lives; all infos live until their call returns.
        unsafe {
            let entry = ash::Entry::load()?;
            let windowing = ash_window::enumerate_required_extensions(window.display_handle()?.as_raw())?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let info = vk::InstanceCreateInfo::default()
                .application_info(&application)
                .enabled_extension_names(windowing);
            let instance = entry.create_instance(&info, None)?;
            let surfaces = khr::surface::Instance::new(&entry, &instance);
            let surface = create_surface(&entry, &instance, window)?;
            let shows = |physical: &vk::PhysicalDevice| {
                let needs = Needs::of(&instance, *physical);
                let family = needs.queue_family();
                let shows = surfaces.get_physical_device_surface_support(*physical, family, surface);
                needs.missing().is_empty() && shows.unwrap_or(false)
            };
            let physical = instance.enumerate_physical_devices()?.into_iter().find(shows);
            let physical = physical.ok_or("no device has what Afterlight needs and shows this window")?;
            let mut needs = Needs::of(&instance, physical);
            let names: Vec<_> = extensions(&needs).iter().map(|name| name.as_ptr()).collect();
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(needs.queue_family())
                .queue_priorities(&[1.0])];
            let mut features = needs.features();
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&names)
                .push_next(&mut features);
            let device = instance.create_device(physical, &info, None)?;
            let queue = device.get_device_queue(needs.queue_family(), 0);
            let swapchains = khr::swapchain::Device::new(&instance, &device);
            let (canvas, canvas_memory, canvas_view) = create_canvas(&instance, physical, &device)?;
            let (layout, triangle) = create_triangle(&device)?;
            let frames = (0..IN_FLIGHT).map(|_| create_frame(&device, needs.queue_family()));
            let frames = frames.collect::<Result<_, _>>()?;
            Ok(Engine {
                entry,
                instance,
                physical,
                needs,
                device,
                queue,
                surfaces,
                swapchains,
                surface,
                swapchain: None,
                frames,
                canvas,
                canvas_memory,
                canvas_view,
                layout,
                triangle,
            })
        }
    }

    /// Waits until the device is done with frame `index - IN_FLIGHT`, and takes an image to show frame `index` in: `None` where there is none
    /// at the moment, because the window has no size, or the surface has changed or is lost.
    pub fn begin(&mut self, window: &Window, index: u64) -> Result<Option<(vk::CommandBuffer, u32)>, Error> {
        let size = window.inner_size();
        if size.width == 0 || size.height == 0 {
            return Ok(None);
        }
        let frame = &self.frames[(index % IN_FLIGHT) as usize];
        let (fence, acquired, pool, commands) = (frame.done, frame.acquired, frame.pool, frame.commands);
        // SAFETY: all handles are alive; the frame's commands are done once its fence is.
        unsafe {
            self.device.wait_for_fences(&[fence], true, u64::MAX)?;
            if self.surface == vk::SurfaceKHR::null() {
                self.surface = create_surface(&self.entry, &self.instance, window)?;
            }
            if self.swapchain.is_none() {
                match self.create_swapchain([size.width, size.height]) {
                    Ok(swapchain) => self.swapchain = swapchain,
                    Err(result) => return self.lost(result).map(|()| None),
                }
            }
            let Some(swapchain) = &self.swapchain else { return Ok(None) };
            let next =
                self.swapchains.acquire_next_image(swapchain.raw, u64::MAX, acquired, vk::Fence::null());
            let image = match next {
                // What is suboptimal is shown all the same, and made anew after it.
                Ok((image, _)) => image,
                Err(result) => return self.lost(result).map(|()| None),
            };
            self.device.reset_fences(&[fence])?;
            self.device.reset_command_pool(pool, vk::CommandPoolResetFlags::empty())?;
            let once =
                vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            self.device.begin_command_buffer(commands, &once)?;
            Ok(Some((commands, image)))
        }
    }

    /// Draws the triangle into the left half of the canvas, which is then in `GENERAL`.
    pub fn draw_triangle(&self, commands: vk::CommandBuffer) {
        let half = vk::Rect2D { offset: vk::Offset2D::default(), extent: extent(HALF) };
        let color = [vk::RenderingAttachmentInfo::default()
            .image_view(self.canvas_view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: [0.0, 0.0, 0.0, 1.0] } })
            .store_op(vk::AttachmentStoreOp::STORE)];
        let info = vk::RenderingInfo::default().render_area(half).layer_count(1).color_attachments(&color);
        let [width, height] = HALF.map(|size| size as f32);
        let viewport = vk::Viewport { width, height, max_depth: 1.0, ..vk::Viewport::default() };
        self.change(commands, self.canvas, [vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL]);
        // SAFETY: the commands are recording, all handles are alive.
        unsafe {
            self.device.cmd_begin_rendering(commands, &info);
            self.device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.triangle);
            self.device.cmd_set_viewport(commands, 0, &[viewport]);
            self.device.cmd_set_scissor(commands, 0, &[half]);
            self.device.cmd_draw(commands, 3, 1, 0, 0);
            self.device.cmd_end_rendering(commands);
        }
    }

    /// Shows the canvas, which is in `TRANSFER_SRC_OPTIMAL`, as large as the window is.
    pub fn end(&mut self, commands: vk::CommandBuffer, image: u32, index: u64) -> Result<(), Error> {
        let Some(swapchain) = &self.swapchain else { return Ok(()) };
        let (shown, drawn) = (swapchain.images[image as usize], swapchain.drawn[image as usize]);
        let corner = |[x, y]: [u32; 2], z| vk::Offset3D { x: x as i32, y: y as i32, z };
        let (from, to) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let blit = vk::ImageBlit::default()
            .src_subresource(LAYER)
            .src_offsets([corner([0, 0], 0), corner([2 * HALF[0], HALF[1]], 1)])
            .dst_subresource(LAYER)
            .dst_offsets([corner([0, 0], 0), corner([swapchain.extent.width, swapchain.extent.height], 1)]);
        let frame = &self.frames[(index % IN_FLIGHT) as usize];
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        let waits = [vk::SemaphoreSubmitInfo::default().semaphore(frame.acquired).stage_mask(stage)];
        let signals = [vk::SemaphoreSubmitInfo::default().semaphore(drawn).stage_mask(stage)];
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
        let submit = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&buffers)
            .signal_semaphore_infos(&signals);
        let (drawn, raw, images) = ([drawn], [swapchain.raw], [image]);
        let present =
            vk::PresentInfoKHR::default().wait_semaphores(&drawn).swapchains(&raw).image_indices(&images);
        self.change(commands, shown, [vk::ImageLayout::UNDEFINED, to]);
        // SAFETY: as in `draw_triangle`; one thread alone uses the queue.
        let presented = unsafe {
            self.device.cmd_blit_image(commands, self.canvas, from, shown, to, &[blit], vk::Filter::NEAREST);
            self.change(commands, shown, [to, vk::ImageLayout::PRESENT_SRC_KHR]);
            self.device.end_command_buffer(commands)?;
            self.device.queue_submit2(self.queue, &[submit], frame.done)?;
            self.swapchains.queue_present(self.queue, &present)
        };
        match presented {
            Ok(false) => Ok(()),
            Ok(true) => self.lost(vk::Result::ERROR_OUT_OF_DATE_KHR),
            Err(result) => self.lost(result),
        }
    }

    /// Gives up what does not fit the surface any more; it is made anew for the next frame.
    fn lost(&mut self, result: vk::Result) -> Result<(), Error> {
        let is_surface_lost = result == vk::Result::ERROR_SURFACE_LOST_KHR;
        if !is_surface_lost && result != vk::Result::ERROR_OUT_OF_DATE_KHR {
            return Err(result.into());
        }
        // SAFETY: the device is done with the swapchain when it is idle; a surface goes after its swapchain.
        unsafe {
            self.device.device_wait_idle()?;
            self.drop_swapchain();
            if is_surface_lost {
                self.surfaces.destroy_surface(self.surface, None);
                self.surface = vk::SurfaceKHR::null();
            }
        }
        Ok(())
    }

    unsafe fn create_swapchain(&self, [width, height]: [u32; 2]) -> Result<Option<Swapchain>, vk::Result> {
        // SAFETY: all handles are alive.
        unsafe {
            let able = self.surfaces.get_physical_device_surface_capabilities(self.physical, self.surface)?;
            let formats = self.surfaces.get_physical_device_surface_formats(self.physical, self.surface)?;
            let unorm = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
            // The canvas is coded in sRGB as it is, so a format that codes once more is the last choice.
            let format = formats.iter().find(|one| unorm.contains(&one.format)).or(formats.first());
            let format = format.copied().ok_or(vk::Result::ERROR_FORMAT_NOT_SUPPORTED)?;
            let mut extent = able.current_extent;
            if extent.width == u32::MAX {
                extent.width = width.clamp(able.min_image_extent.width, able.max_image_extent.width);
                extent.height = height.clamp(able.min_image_extent.height, able.max_image_extent.height);
            }
            if extent.width == 0 || extent.height == 0 {
                return Ok(None);
            }
            let most = if able.max_image_count == 0 { u32::MAX } else { able.max_image_count };
            let info = vk::SwapchainCreateInfoKHR::default()
                .surface(self.surface)
                .min_image_count((able.min_image_count + 1).min(most))
                .image_format(format.format)
                .image_color_space(format.color_space)
                .image_extent(extent)
                .image_array_layers(1)
                .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
                .pre_transform(able.current_transform)
                .composite_alpha(vk::CompositeAlphaFlagsKHR::OPAQUE)
                .present_mode(vk::PresentModeKHR::FIFO)
                .clipped(true);
            let raw = self.swapchains.create_swapchain(&info, None)?;
            let mut made = Swapchain { raw, images: Vec::new(), drawn: Vec::new(), extent };
            made.images = self.swapchains.get_swapchain_images(raw)?;
            for _ in &made.images {
                made.drawn.push(self.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None)?);
            }
            Ok(Some(made))
        }
    }

    unsafe fn drop_swapchain(&mut self) {
        if let Some(swapchain) = self.swapchain.take() {
            // SAFETY: the caller has waited for the device.
            unsafe {
                swapchain.drawn.iter().for_each(|one| self.device.destroy_semaphore(*one, None));
                self.swapchains.destroy_swapchain(swapchain.raw, None);
            }
        }
    }

    fn change(&self, commands: vk::CommandBuffer, image: vk::Image, [from, to]: [vk::ImageLayout; 2]) {
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(stage)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(stage)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(from)
            .new_layout(to)
            .image(image)
            .subresource_range(WHOLE)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: as in `draw_triangle`.
        unsafe { self.device.cmd_pipeline_barrier2(commands, &info) };
    }

    /// The canvas, RGBA with 8 bits a channel, rows from the top. The device must be idle, the canvas in `TRANSFER_SRC_OPTIMAL`.
    pub fn read_canvas(&self) -> Result<Vec<u8>, Error> {
        let [width, height] = [2 * HALF[0], HALF[1]];
        let bytes = u64::from(4 * width * height);
        let region = vk::BufferImageCopy::default().image_subresource(LAYER).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        });
        let visible = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let commands = self.frames[0].commands;
        // SAFETY: the device is idle, so that frame 0 is free; the mapped memory is as long as the buffer.
        unsafe {
            let info = vk::BufferCreateInfo::default().size(bytes).usage(vk::BufferUsageFlags::TRANSFER_DST);
            let buffer = self.device.create_buffer(&info, None)?;
            let needs = self.device.get_buffer_memory_requirements(buffer);
            let memory = allocate(&self.instance, self.physical, &self.device, needs, visible)?;
            self.device.bind_buffer_memory(buffer, memory, 0)?;
            self.device.reset_command_pool(self.frames[0].pool, vk::CommandPoolResetFlags::empty())?;
            self.device.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default())?;
            let from = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
            self.device.cmd_copy_image_to_buffer(commands, self.canvas, from, buffer, &[region]);
            self.device.end_command_buffer(commands)?;
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
            let submit = vk::SubmitInfo2::default().command_buffer_infos(&buffers);
            self.device.queue_submit2(self.queue, &[submit], vk::Fence::null())?;
            self.device.device_wait_idle()?;
            let mapped = self.device.map_memory(memory, 0, bytes, vk::MemoryMapFlags::empty())?;
            let pixels = std::slice::from_raw_parts(mapped.cast::<u8>(), bytes as usize).to_vec();
            self.device.destroy_buffer(buffer, None);
            self.device.free_memory(memory, None);
            Ok(pixels)
        }
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        // SAFETY: everything was made by this engine and is used by nobody once the device is idle.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.drop_swapchain();
            for frame in &self.frames {
                self.device.destroy_fence(frame.done, None);
                self.device.destroy_semaphore(frame.acquired, None);
                self.device.destroy_command_pool(frame.pool, None);
            }
            self.device.destroy_pipeline(self.triangle, None);
            self.device.destroy_pipeline_layout(self.layout, None);
            self.device.destroy_image_view(self.canvas_view, None);
            self.device.destroy_image(self.canvas, None);
            self.device.free_memory(self.canvas_memory, None);
            self.device.destroy_device(None);
            self.surfaces.destroy_surface(self.surface, None);
            self.instance.destroy_instance(None);
        }
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

fn extent([width, height]: [u32; 2]) -> vk::Extent2D {
    vk::Extent2D { width, height }
}

unsafe fn create_surface(
    entry: &ash::Entry,
    instance: &ash::Instance,
    window: &Window,
) -> Result<vk::SurfaceKHR, Error> {
    let (display, handle) = (window.display_handle()?.as_raw(), window.window_handle()?.as_raw());
    // SAFETY: the window outlives the surface, and the instance has the extensions that the display needs.
    Ok(unsafe { ash_window::create_surface(entry, instance, display, handle, None) }?)
}

unsafe fn allocate(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    device: &ash::Device,
    needs: vk::MemoryRequirements,
    wanted: vk::MemoryPropertyFlags,
) -> Result<vk::DeviceMemory, Error> {
    // SAFETY: all handles are alive.
    unsafe {
        let there = instance.get_physical_device_memory_properties(physical);
        let fits = |(at, kind): &(usize, &vk::MemoryType)| {
            needs.memory_type_bits >> at & 1 == 1 && kind.property_flags.contains(wanted)
        };
        let (at, _) = there.memory_types_as_slice().iter().enumerate().find(fits).ok_or("no such memory")?;
        let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(at as u32);
        Ok(device.allocate_memory(&info, None)?)
    }
}

unsafe fn create_canvas(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    device: &ash::Device,
) -> Result<(vk::Image, vk::DeviceMemory, vk::ImageView), Error> {
    let [width, height] = [2 * HALF[0], HALF[1]];
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(CANVAS_FORMAT)
        .extent(vk::Extent3D { width, height, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(
            vk::ImageUsageFlags::COLOR_ATTACHMENT
                | vk::ImageUsageFlags::TRANSFER_SRC
                | vk::ImageUsageFlags::TRANSFER_DST,
        );
    // SAFETY: all handles are alive.
    unsafe {
        let image = device.create_image(&info, None)?;
        let needs = device.get_image_memory_requirements(image);
        let memory = allocate(instance, physical, device, needs, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
        device.bind_image_memory(image, memory, 0)?;
        let view = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(CANVAS_FORMAT)
            .subresource_range(WHOLE);
        Ok((image, memory, device.create_image_view(&view, None)?))
    }
}

unsafe fn create_triangle(device: &ash::Device) -> Result<(vk::PipelineLayout, vk::Pipeline), Error> {
    let spirv = |name: &str| {
        let shader = shader(name).ok_or("no such shader")?;
        Ok::<_, Error>(&*shader.spirv)
    };
    let (vertex, fragment) = (spirv("triangle/triangle.vert")?, spirv("triangle/triangle.frag")?);
    // SAFETY: the device is alive, and what the infos point to lives until the calls return.
    unsafe {
        let module =
            |code| device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(code), None);
        let (vertex, fragment) = (module(vertex)?, module(fragment)?);
        let stage = |stage, module| {
            vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
        };
        let stages =
            [stage(vk::ShaderStageFlags::VERTEX, vertex), stage(vk::ShaderStageFlags::FRAGMENT, fragment)];
        let layout = device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None)?;
        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let blends =
            [vk::PipelineColorBlendAttachmentState::default()
                .color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let formats = [CANVAS_FORMAT];
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut rendering);
        let made = device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
        device.destroy_shader_module(vertex, None);
        device.destroy_shader_module(fragment, None);
        Ok((layout, made.map_err(|(_, result)| result)?[0]))
    }
}

unsafe fn create_frame(device: &ash::Device, family: u32) -> Result<Frame, vk::Result> {
    // SAFETY: the device is alive.
    unsafe {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
        let pool = device.create_command_pool(&info, None)?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let done = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        Ok(Frame {
            pool,
            commands: device.allocate_command_buffers(&info)?[0],
            acquired: device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None)?,
            done: device.create_fence(&done, None)?,
        })
    }
}
