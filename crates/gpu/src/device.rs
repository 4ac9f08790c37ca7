//! Choosing and opening a device; what all resources share.

use crate::descriptor::{SetLayoutCache, SlotLayout};
use crate::encoder::{Completed, Encoder};
use crate::features::Detected;
use crate::instance::Instance;
use crate::pipeline::PipelineStore;
use crate::recorder::Recorder;
use crate::sampler::SamplerStore;
use crate::{DeviceInfo, Features, GpuError, cache};
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::ffi::CString;
use std::path::PathBuf;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// An index in the loader's order, or a part of the name in any case; `None` takes the most able device.
    pub select: Option<String>,
    /// Turn on the validation layer with synchronization checks; see [`Device::validation_messages`].
    pub validate: bool,
    /// Folder of the pipeline cache; `None` keeps it in memory. A file that is corrupt or of another driver is ignored.
    pub pipeline_cache_dir: Option<PathBuf>,
    /// Do without 32-bit float depth with stencil even where the device has it, as on a device that has it not: for tests.
    pub without_float_stencil: bool,
}

/// A device of the list: what it is, what it can do, and what it lacks that the workbench needs.
pub type Listed = (DeviceInfo, Features, Vec<&'static str>);

/// An open device. Cloning is cheap; the device closes when the last clone and the last resource of it are gone.
#[derive(Clone)]
pub struct Device(pub(crate) Arc<DeviceInner>);

pub(crate) struct DeviceInner {
    pub raw: ash::Device,
    pub push: khr::push_descriptor::Device,
    pub debug: Option<ext::debug_utils::Device>,
    pub info: DeviceInfo,
    pub features: Features,
    pub physical: vk::PhysicalDevice,
    pub memory: vk::PhysicalDeviceMemoryProperties,
    pub queue_family: u32,
    without_float_stencil: bool,
    /// Whether another program owns device and instance.
    pub is_adopted: bool,
    queue: Mutex<Queue>,
    /// Counts submissions: its value is the number of the last one that is done, and all before it are.
    timeline: vk::Semaphore,
    /// Bytes that resources and heaps hold, see [`Device::held_bytes`].
    pub held_bytes: AtomicU64,
    /// `None` only while the device is being dropped.
    allocator: Mutex<Option<Allocator>>,
    pub set_layouts: SetLayoutCache,
    pub pipelines: PipelineStore,
    pub samplers: SamplerStore,
    /// Command pools and query pools that no encoder uses at the moment.
    recorders: Mutex<Vec<Recorder>>,
    /// Dropped last: everything above is a child of it.
    pub instance: Instance,
}

/// The queue, and how many submissions it has been given.
struct Queue {
    raw: vk::Queue,
    submitted: u64,
}

/// Number of a submission to the device's queue. They are done in this order.
pub(crate) type Submission = u64;

/// Locks `mutex`; the data that this crate guards stays valid when a thread panics, so a poisoned lock is taken all the same.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Device").field(&self.0.info.name).finish()
    }
}

impl Device {
    /// Lists the devices in the loader's order: what each is, what it can do, and what it lacks that the workbench needs
    /// (nothing where it can be opened).
    ///
    /// # Errors
    /// [`GpuError::NoLoader`] without a Vulkan loader. No device at all is an empty list.
    pub fn enumerate() -> Result<Vec<Listed>, GpuError> {
        let devices = match Instance::new(false) {
            Ok(instance) => instance.devices()?,
            Err(GpuError::NoDevice { .. }) => return Ok(Vec::new()),
            Err(error) => return Err(error),
        };
        Ok(devices.into_iter().map(|(_, d)| (d.info, d.features, d.missing)).collect())
    }

    /// Opens the device that `options` select.
    ///
    /// # Errors
    /// [`GpuError::NoLoader`], [`GpuError::NoDevice`] with the list of devices, [`GpuError::MissingFeature`],
    /// [`GpuError::NoValidationLayer`].
    pub fn open(options: &DeviceOptions) -> Result<Device, GpuError> {
        let instance = Instance::new(options.validate)?;
        let (physical, detected) = choose(instance.devices()?, options.select.as_deref())?;
        if !detected.missing.is_empty() {
            return Err(GpuError::MissingFeature {
                device: detected.info.name,
                missing: detected.missing.join(", "),
            });
        }
        let raw = create_device(&instance, physical, &detected)?;
        // SAFETY: the device was created with one queue of this family.
        let queue = unsafe { raw.get_device_queue(detected.queue_family, 0) };
        from_opened(Opened { instance, raw, physical, queue, is_adopted: false, detected }, options)
    }

    /// Pipelines that were made so far. They are kept: what was asked for once is there.
    pub fn pipeline_count(&self) -> usize {
        self.0.pipelines.count()
    }

    /// Which device it is.
    pub fn info(&self) -> &DeviceInfo {
        &self.0.info
    }

    /// What the device can do; what is true there is enabled.
    pub fn features(&self) -> &Features {
        &self.0.features
    }

    /// Waits until the device has nothing left to do; one that is adopted, until it has done what Afterlight submitted.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`].
    pub fn wait_idle(&self) -> Result<(), GpuError> {
        let queue = lock(&self.0.queue);
        if self.0.is_adopted {
            // Other threads may submit to other queues of the device meanwhile, which `vkDeviceWaitIdle` forbids.
            return self.wait_for(queue.submitted).map_err(lost("vkWaitSemaphores", "unknown"));
        }
        // SAFETY: the queue is locked, as `vkDeviceWaitIdle` asks.
        unsafe { self.0.raw.device_wait_idle() }.map_err(lost("vkDeviceWaitIdle", "unknown"))
    }

    /// Takes the warnings and errors that validation has collected, without repeats; always empty without validation.
    pub fn validation_messages(&self) -> Vec<String> {
        self.0.instance.log.drain()
    }

    /// Writes the pipeline cache to its folder, beside first and then renamed. Without a folder it does nothing.
    /// Dropping the device saves too, but cannot report an error.
    ///
    /// # Errors
    /// [`GpuError::CacheFile`] with the path and the reason.
    pub fn save_pipeline_cache(&self) -> Result<(), GpuError> {
        self.0.pipelines.save(&self.0.raw, &self.0.info)
    }

    /// Whether images of `format` with optimal tiling have all of `wanted`.
    pub fn format_supports(&self, format: vk::Format, wanted: vk::FormatFeatureFlags) -> bool {
        // SAFETY: the physical device belongs to the instance, both alive.
        let properties =
            unsafe { self.0.instance.raw.get_physical_device_format_properties(self.0.physical, format) };
        properties.optimal_tiling_features.contains(wanted)
    }

    /// The device's format for depth with stencil: 32-bit float depth where it can be drawn to, else 24-bit, one of which every
    /// device has.
    pub fn depth_stencil_format(&self) -> vk::Format {
        let wanted = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT | vk::FormatFeatureFlags::SAMPLED_IMAGE;
        let has_float = self.format_supports(vk::Format::D32_SFLOAT_S8_UINT, wanted);
        if has_float && !self.0.without_float_stencil {
            vk::Format::D32_SFLOAT_S8_UINT
        } else {
            vk::Format::D24_UNORM_S8_UINT
        }
    }

    /// Begins to record commands.
    ///
    /// # Errors
    /// A driver that cannot give a command pool.
    pub fn encoder(&self) -> Result<Encoder, GpuError> {
        Encoder::new(self.clone(), self.recorder()?, vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT)
    }

    /// Begins to record commands that are submitted many times ([`Encoder::finish`]).
    ///
    /// # Errors
    /// A driver that cannot give a command pool.
    pub fn encoder_for_many(&self) -> Result<Encoder, GpuError> {
        Encoder::new(self.clone(), self.recorder()?, vk::CommandBufferUsageFlags::empty())
    }

    /// Begins to record commands that another program's command buffer executes ([`Device::execute_in`]), any number of times.
    ///
    /// # Errors
    /// A driver that cannot give a command pool.
    pub fn encoder_for_callers(&self) -> Result<Encoder, GpuError> {
        let recorder = self.recorder_of(vk::CommandBufferLevel::SECONDARY)?;
        Encoder::new(self.clone(), recorder, vk::CommandBufferUsageFlags::empty())
    }

    /// Submits what `encoder` recorded, waits for it and returns its timestamps and statistics.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] with the last label whose end was reached; a recording that the driver refuses.
    pub fn submit(&self, encoder: Encoder) -> Result<Completed, GpuError> {
        let mut recording = encoder.finish()?;
        recording.submit()?;
        recording.wait()?;
        let mut completed = Completed::default();
        recording.collect(&mut completed)?;
        Ok(completed)
    }

    /// One that nobody uses at the moment, or a new one.
    pub(crate) fn recorder(&self) -> Result<Recorder, GpuError> {
        self.recorder_of(vk::CommandBufferLevel::PRIMARY)
    }

    fn recorder_of(&self, level: vk::CommandBufferLevel) -> Result<Recorder, GpuError> {
        let idle = {
            let mut idle = lock(&self.0.recorders);
            idle.iter().rposition(|recorder| recorder.level == level).map(|at| idle.swap_remove(at))
        };
        idle.map_or_else(|| Recorder::new(self, level), Ok)
    }

    pub(crate) fn give_back(&self, recorder: Recorder) {
        lock(&self.0.recorders).push(recorder);
    }

    /// Calls `with` with the queue locked.
    pub(crate) fn queue_locked<T>(&self, with: impl FnOnce(vk::Queue) -> T) -> T {
        let queue = lock(&self.0.queue);
        with(queue.raw)
    }

    /// Submits one command buffer, whose resources the caller holds until the submission is done.
    pub(crate) fn submit_raw(&self, commands: vk::CommandBuffer) -> Result<Submission, vk::Result> {
        let mut queue = lock(&self.0.queue);
        let number = queue.submitted + 1;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.0.timeline)
            .value(number)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit =
            [vk::SubmitInfo2::default().command_buffer_infos(&commands).signal_semaphore_infos(&signals)];
        // SAFETY: the queue is locked; the command buffer has ended and its resources are held until it is done.
        unsafe { self.0.raw.queue_submit2(queue.raw, &submit, vk::Fence::null()) }?;
        queue.submitted = number;
        Ok(number)
    }

    /// Waits until a submission is done.
    pub(crate) fn wait_for(&self, submission: Submission) -> Result<(), vk::Result> {
        let (semaphores, values) = ([self.0.timeline], [submission]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore lives as long as the device, and the submission will signal that value.
        unsafe { self.0.raw.wait_semaphores(&info, u64::MAX) }
    }

    /// Whether a submission is done.
    pub(crate) fn has_done(&self, submission: Submission) -> Result<bool, vk::Result> {
        // SAFETY: the semaphore lives as long as the device.
        Ok(unsafe { self.0.raw.get_semaphore_counter_value(self.0.timeline) }? >= submission)
    }

    /// Runs `use_allocator` with the allocator locked.
    pub(crate) fn with_allocator<T>(&self, use_allocator: impl FnOnce(&mut Allocator) -> T) -> T {
        let mut allocator = lock(&self.0.allocator);
        use_allocator(allocator.as_mut().expect("the allocator lives as long as a Device does"))
    }

    /// Gives `handle` its name in captures and messages.
    pub(crate) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(debug) = &self.0.debug else { return };
        let name = c_name(name);
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is one of this device's live objects. A name that cannot be set harms nothing.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    /// The layout of a descriptor set with these slots, made once.
    pub(crate) fn set_layout(
        &self,
        slots: &[SlotLayout],
        push: bool,
    ) -> Result<vk::DescriptorSetLayout, GpuError> {
        self.0.set_layouts.get(&self.0.raw, slots, push)
    }
}

/// Turns the result of `call` into an error; a lost device names `pass`.
pub(crate) fn lost(call: &'static str, pass: &str) -> impl FnOnce(vk::Result) -> GpuError {
    // Owned where there is an error alone: calls of every frame come by here.
    move |result| match result {
        vk::Result::ERROR_DEVICE_LOST => GpuError::DeviceLost { pass: pass.to_owned() },
        result => GpuError::Vulkan { call, result },
    }
}

/// A C string of `name` without inner zeros.
pub(crate) fn c_name(name: &str) -> CString {
    let bytes: Vec<u8> = name.bytes().filter(|&b| b != 0).collect();
    CString::new(bytes).unwrap_or_default()
}

impl Drop for DeviceInner {
    fn drop(&mut self) {
        // SAFETY: every resource holds the device, so none but the device's own objects are left, and no thread can
        // still be using them. Waiting may fail on a lost device; destroying is right all the same.
        unsafe {
            // Of a device that is adopted, recordings and uploads have waited for their own submissions when they were dropped.
            if !self.is_adopted {
                let _ = self.raw.device_wait_idle();
            }
            let mut allocator = lock(&self.allocator).take();
            for recorder in lock(&self.recorders).drain(..) {
                recorder.destroy(&self.raw, allocator.as_mut());
            }
            // A cache that cannot be written only costs time at the next start. Who wants the error calls `save_pipeline_cache`.
            let _ = self.pipelines.save(&self.raw, &self.info);
            self.pipelines.destroy(&self.raw);
            self.set_layouts.destroy(&self.raw);
            self.samplers.destroy(&self.raw);
            self.raw.destroy_semaphore(self.timeline, None);
            drop(allocator);
            if !self.is_adopted {
                self.raw.destroy_device(None);
            }
        }
    }
}

/// A device that is open, with nothing made of it yet.
pub(crate) struct Opened {
    pub instance: Instance,
    pub raw: ash::Device,
    pub physical: vk::PhysicalDevice,
    pub queue: vk::Queue,
    pub is_adopted: bool,
    pub detected: Detected,
}

/// Makes what all resources share. A device of its own is destroyed where that fails.
pub(crate) fn from_opened(opened: Opened, options: &DeviceOptions) -> Result<Device, GpuError> {
    let Opened { instance, raw, physical, queue, is_adopted, detected } = opened;
    let destroy = || {
        if !is_adopted {
            // SAFETY: nothing that was made of the device is left.
            unsafe { raw.destroy_device(None) };
        }
    };
    let allocator = Allocator::new(&AllocatorCreateDesc {
        instance: instance.raw.clone(),
        device: raw.clone(),
        physical_device: physical,
        debug_settings: Default::default(),
        buffer_device_address: detected.features.buffer_device_address,
        allocation_sizes: Default::default(),
    });
    let allocator = match allocator {
        Ok(allocator) => allocator,
        Err(error) => {
            destroy();
            return Err(GpuError::MissingFeature { device: detected.info.name, missing: error.to_string() });
        }
    };
    let timeline = match create_timeline(&raw) {
        Ok(timeline) => timeline,
        Err(error) => {
            drop(allocator);
            destroy();
            return Err(error);
        }
    };
    let Detected { info, features, queue_family, .. } = detected;
    let pipelines = PipelineStore::new(&raw, &info, options.pipeline_cache_dir.as_deref());
    // SAFETY: `physical` belongs to the instance.
    let memory = unsafe { instance.raw.get_physical_device_memory_properties(physical) };
    Ok(Device(Arc::new(DeviceInner {
        push: khr::push_descriptor::Device::new(&instance.raw, &raw),
        debug: instance.has_debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw)),
        info,
        features,
        physical,
        memory,
        queue_family,
        without_float_stencil: options.without_float_stencil,
        is_adopted,
        queue: Mutex::new(Queue { raw: queue, submitted: 0 }),
        timeline,
        held_bytes: AtomicU64::new(0),
        allocator: Mutex::new(Some(allocator)),
        set_layouts: SetLayoutCache::default(),
        pipelines,
        samplers: SamplerStore::default(),
        recorders: Mutex::new(Vec::new()),
        raw,
        instance,
    })))
}

/// Picks by index, by part of the name, or the most able.
fn choose(
    mut devices: Vec<(vk::PhysicalDevice, Detected)>,
    select: Option<&str>,
) -> Result<(vk::PhysicalDevice, Detected), GpuError> {
    let index = match select {
        None => (0..devices.len()).min_by_key(|&i| {
            let detected = &devices[i].1;
            (!detected.missing.is_empty(), kind_rank(detected.info.kind), i)
        }),
        Some(text) => match text.trim().parse::<usize>() {
            Ok(index) => (index < devices.len()).then_some(index),
            Err(_) => {
                let wanted = text.trim().to_lowercase();
                devices.iter().position(|(_, d)| d.info.name.to_lowercase().contains(&wanted))
            }
        },
    };
    match index {
        Some(index) => Ok(devices.swap_remove(index)),
        None => Err(GpuError::NoDevice {
            wanted: select.map_or("any device".to_owned(), |s| format!("`{s}`")),
            found: if devices.is_empty() {
                "none".to_owned()
            } else {
                let names: Vec<String> =
                    devices.iter().map(|(_, d)| format!("{} `{}`", d.info.index, d.info.name)).collect();
                names.join(", ")
            },
        }),
    }
}

fn kind_rank(kind: &str) -> usize {
    ["discrete", "integrated", "virtual", "cpu"].iter().position(|&k| k == kind).unwrap_or(4)
}

fn create_timeline(device: &ash::Device) -> Result<vk::Semaphore, GpuError> {
    let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
    // SAFETY: the device has the feature, as every device of Vulkan 1.3 must.
    unsafe { device.create_semaphore(&info, None) }.map_err(GpuError::call("vkCreateSemaphore"))
}

pub(crate) fn create_device(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    detected: &Detected,
) -> Result<ash::Device, GpuError> {
    let mut enable = detected.enable.clone();
    let extensions: Vec<_> = detected.enable.extensions.iter().map(|e| e.as_ptr()).collect();
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(detected.queue_family)
        .queue_priorities(&priorities)];
    let mut features = enable.chain();
    let create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .push_next(&mut features);
    // SAFETY: all that `create` points to lives until the call returns; only features and extensions that the device
    // listed are enabled.
    unsafe { instance.raw.create_device(physical, &create, None) }.map_err(GpuError::call("vkCreateDevice"))
}

/// The folder's cache file for this device: `pipelines-UUID.bin`.
pub(crate) fn cache_file(info: &DeviceInfo, dir: &std::path::Path) -> PathBuf {
    dir.join(cache::file_name(&info.pipeline_cache_uuid))
}
