//! A device that another program opened: what it must be opened with, and taking it over for the time being.

use crate::device::{Opened, from_opened};
use crate::features::{Detected, detect, detect_opened};
use crate::{Device, DeviceInfo, DeviceOptions, GpuError};
use ash::vk;
use std::ffi::CStr;

/// What Afterlight uses of a physical device: what a program enables when it opens the device that is adopted later.
///
/// [`Device::open`] enables exactly this. Extensions and features of the program's own come beside it.
pub struct Needs(pub(crate) Detected);

impl Needs {
    /// Examines a physical device.
    ///
    /// # Safety
    /// `physical` was enumerated from `instance`, which is alive and was made for Vulkan 1.3 or later.
    pub unsafe fn of(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Needs {
        Needs(detect(instance, physical, 0))
    }

    /// What the device lacks that every technique needs; nothing where it can be used.
    pub fn missing(&self) -> &[&'static str] {
        &self.0.missing
    }

    /// Which device it is.
    pub fn info(&self) -> &DeviceInfo {
        &self.0.info
    }

    /// The first queue family with graphics and compute.
    pub fn queue_family(&self) -> u32 {
        self.0.queue_family
    }

    /// Device extensions to enable.
    pub fn extensions(&self) -> &[&'static CStr] {
        &self.0.enable.extensions
    }

    /// Features to enable, as a chain for `VkDeviceCreateInfo::pNext`: of the core, of Vulkan 1.1 to 1.3, and of those of
    /// [`Needs::extensions`] that have any. A program that wants more sets it in the chain.
    pub fn features(&mut self) -> vk::PhysicalDeviceFeatures2<'_> {
        self.0.enable.chain()
    }
}

/// What another program opened. Handles of `ash` are tables of functions: cloning them is cheap.
pub struct Adopted<'a> {
    /// The instance.
    pub instance: ash::Instance,
    /// Whether `VK_EXT_debug_utils` is enabled there: resources and passes then have their names in captures and messages.
    pub has_debug_utils: bool,
    /// The physical device.
    pub physical: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// Family of the queue; it has graphics and compute.
    pub queue_family: u32,
    /// The queue that Afterlight submits to.
    pub queue: vk::Queue,
    /// Extensions that the device was opened with.
    pub extensions: &'a [&'a CStr],
    /// The chain of features that the device was opened with. Those of Vulkan 1.1 to 1.3 are looked for in the structures of these versions,
    /// `VkPhysicalDeviceVulkan11Features` and so on; what stands in a structure of a single feature counts as not enabled.
    pub features: &'a vk::PhysicalDeviceFeatures2<'a>,
}

impl Device {
    /// Takes over a device that another program opened, without owning it: neither the device nor the instance is destroyed when the last
    /// clone is dropped. What was not enabled is a feature that the device lacks ([`Device::features`]), though the hardware may have it.
    /// Of `options` the folder of the pipeline cache counts, and what tests do without; the program validates for itself.
    ///
    /// Afterlight submits to the queue from inside its own calls: when a scene is uploaded, a technique is prepared, a frame is planned anew.
    /// A thread of its own submits only where the program asks for plans on another thread (`Renderer::fly_ahead`, `Embedded::plan_ahead`,
    /// `Flight::plan_ahead`). A queue may be used by one thread at a time. So either all calls come from the thread that submits the program's
    /// own work and none asks for such plans, or the program submits and presents within [`Device::with_queue`].
    ///
    /// # Safety
    /// - All handles belong together, `queue` is one of `queue_family`, `extensions` and `features` are what `device` was opened with.
    /// - Device and instance live until the last clone of the device and the last resource of it are dropped.
    /// - No other thread uses the queue while one is in a call of Afterlight that submits, or while a thread of Afterlight's plans, see above.
    ///
    /// # Errors
    /// [`GpuError::MissingFeature`] names each thing that every technique needs and that the device lacks or was opened without.
    pub unsafe fn adopt(adopted: &Adopted<'_>, options: &DeviceOptions) -> Result<Device, GpuError> {
        // SAFETY: the caller promises that the handles are alive and belong together, and what the device was opened with.
        let detected = unsafe { detect_opened(adopted) };
        if !detected.missing.is_empty() {
            return Err(GpuError::MissingFeature {
                device: detected.info.name,
                missing: detected.missing.join(", "),
            });
        }
        from_opened(
            Opened {
                instance: crate::instance::Instance::adopted(
                    adopted.instance.clone(),
                    adopted.has_debug_utils,
                ),
                raw: adopted.device.clone(),
                physical: adopted.physical,
                queue: adopted.queue,
                is_adopted: true,
                detected,
            },
            options,
        )
    }

    /// Whether another program opened the device.
    pub fn is_adopted(&self) -> bool {
        self.0.is_adopted
    }

    /// Calls `with` with the queue while nobody else of this process submits to it by way of this device: a program that has adopted a
    /// device submits and presents so where several threads use the queue. `with` must not call Afterlight.
    pub fn with_queue<T>(&self, with: impl FnOnce(vk::Queue) -> T) -> T {
        self.queue_locked(with)
    }
}

/// What every technique needs of a device of Vulkan 1.3 and that was not enabled.
pub(crate) fn missing_of_opened(
    v12: &vk::PhysicalDeviceVulkan12Features<'_>,
    v13: &vk::PhysicalDeviceVulkan13Features<'_>,
) -> Vec<&'static str> {
    // Every device of Vulkan 1.3 has these features, so that nobody asks for them again.
    let needed = [
        (v12.host_query_reset, "hostQueryReset"),
        (v12.timeline_semaphore, "timelineSemaphore"),
        (v12.uniform_buffer_standard_layout, "uniformBufferStandardLayout"),
        (v12.shader_subgroup_extended_types, "shaderSubgroupExtendedTypes"),
        (v12.separate_depth_stencil_layouts, "separateDepthStencilLayouts"),
        (v13.dynamic_rendering, "dynamicRendering"),
        (v13.synchronization2, "synchronization2"),
        (v13.maintenance4, "maintenance4"),
        (v13.shader_demote_to_helper_invocation, "shaderDemoteToHelperInvocation"),
        (v13.shader_terminate_invocation, "shaderTerminateInvocation"),
    ];
    needed.iter().filter(|(on, _)| *on != vk::TRUE).map(|(_, name)| *name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::create_device;
    use crate::instance::Instance;

    /// Opens a device as a program of its own does, hands it to `with`, and destroys it.
    fn with_opened(with: impl FnOnce(&mut Needs, Adopted<'_>)) {
        let instance = Instance::new(false).expect("an instance");
        let (physical, detected) = instance.devices().expect("devices").swap_remove(0);
        let device = create_device(&instance, physical, &detected).expect("a device");
        // SAFETY: the device was created with one queue of this family.
        let queue = unsafe { device.get_device_queue(detected.queue_family, 0) };
        // SAFETY: the physical device is the instance's.
        let mut needs = unsafe { Needs::of(&instance.raw, physical) };
        let adopted = Adopted {
            instance: instance.raw.clone(),
            has_debug_utils: instance.has_debug_utils,
            physical,
            device: device.clone(),
            queue_family: detected.queue_family,
            queue,
            extensions: &detected.enable.extensions,
            features: &vk::PhysicalDeviceFeatures2::default(),
        };
        with(&mut needs, adopted);
        // SAFETY: what was made of the device is dropped; that it can be destroyed shows that nobody else has.
        unsafe { device.destroy_device(None) };
    }

    #[test]
    fn an_adopted_device_can_do_what_it_was_opened_with_and_is_left_open() {
        with_opened(|needs, adopted| {
            let features = needs.features();
            let adopted = Adopted { features: &features, ..adopted };
            // SAFETY: the handles are those of one device, opened with these features, used by this thread alone.
            let device = unsafe { Device::adopt(&adopted, &DeviceOptions::default()) }.expect("adopted");
            let own = Device::open(&DeviceOptions::default()).expect("a device");
            assert_eq!(device.features(), own.features());
            assert_eq!(device.info(), own.info());
            let encoder = device.encoder().expect("an encoder");
            device.submit(encoder).expect("submitted");
            device.wait_idle().expect("idle");
            assert_eq!(device.with_queue(|queue| queue), adopted.queue);
        });
    }

    #[test]
    fn what_is_missing_is_named() {
        with_opened(|needs, adopted| {
            let features = needs.features();
            let without_extensions = Adopted { features: &features, extensions: &[], ..adopted };
            // SAFETY: as above, with less than it was opened with; so for the calls below.
            let refused = unsafe { Device::adopt(&without_extensions, &DeviceOptions::default()) };
            let message = refused.expect_err("no push descriptors").to_string();
            assert!(message.ends_with("lacks VK_KHR_push_descriptor"), "{message}");
        });
        with_opened(|_, adopted| {
            // SAFETY: see above.
            let refused = unsafe { Device::adopt(&adopted, &DeviceOptions::default()) };
            let message = refused.expect_err("no features").to_string();
            for name in ["dynamicRendering", "synchronization2", "timelineSemaphore", "hostQueryReset"] {
                assert!(message.contains(name), "{message}");
            }
        });
        with_opened(|needs, adopted| {
            needs.0.enable.core.geometry_shader = vk::FALSE;
            let features = needs.features();
            let adopted = Adopted { features: &features, ..adopted };
            // SAFETY: see above.
            let device = unsafe { Device::adopt(&adopted, &DeviceOptions::default()) }.expect("adopted");
            assert!(!device.features().geometry_shader, "what was not enabled is not there");
        });
    }
}
