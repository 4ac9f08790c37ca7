//! What can go wrong between a description and the device.

use ash::vk;
use thiserror::Error;

/// An error of the environment: no device, no memory, a limit, a lost device, a call that the driver refused.
///
/// Every message names the resource or the call, what was found and what was expected.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GpuError {
    /// The Vulkan loader could not be opened.
    #[error("no Vulkan loader: {reason}; install libvulkan1 and, without a GPU driver, mesa-vulkan-drivers")]
    NoLoader {
        /// What the dynamic linker said.
        reason: String,
    },
    /// Validation was asked for and its layer is not installed.
    #[error(
        "validation wants the layer VK_LAYER_KHRONOS_validation, which is not installed: install vulkan-validationlayers"
    )]
    NoValidationLayer,
    /// No device, or none that the selection matches.
    #[error("no Vulkan device for {wanted}; found: {found}")]
    NoDevice {
        /// The selection: an index, a part of a name, or `any device`.
        wanted: String,
        /// The devices that there are, with their indices, or `none`.
        found: String,
    },
    /// The device lacks what every technique needs.
    #[error("device {device} lacks {missing}")]
    MissingFeature {
        /// The device's name.
        device: String,
        /// The features, separated by commas.
        missing: String,
    },
    /// No memory for a resource.
    #[error("out of memory: {resource} needs {bytes} bytes")]
    OutOfMemory {
        /// The resource's name.
        resource: String,
        /// What it needs, in bytes.
        bytes: u64,
    },
    /// The allocator refused for a reason other than lack of memory.
    #[error("no memory for {resource} ({bytes} bytes): {reason}")]
    Allocation {
        /// The resource's name.
        resource: String,
        /// What it needs, in bytes.
        bytes: u64,
        /// Why.
        reason: String,
    },
    /// The device stopped answering.
    #[error("device lost; the last pass that had finished: {pass}")]
    DeviceLost {
        /// The last label whose end the device had reached, or `none`.
        pass: String,
    },
    /// A resource is larger than the device allows.
    #[error("{resource}: {what} is {found}, the device allows {limit}")]
    TooLarge {
        /// The resource's name.
        resource: String,
        /// What is too large, with its unit.
        what: &'static str,
        /// What was asked for.
        found: u64,
        /// The device's limit.
        limit: u64,
    },
    /// The device cannot have this many samples for this format and use.
    #[error("{resource}: {found} samples a pixel, the device allows {supported} for this format and use")]
    UnsupportedSamples {
        /// The resource's name.
        resource: String,
        /// What was asked for.
        found: u32,
        /// The counts that the device has, separated by commas.
        supported: String,
    },
    /// The device cannot use this format so.
    #[error("{resource}: the device has no {format:?} for {usage:?}")]
    UnsupportedFormat {
        /// The resource's name.
        resource: String,
        /// The format asked for.
        format: vk::Format,
        /// The use asked for.
        usage: vk::ImageUsageFlags,
    },
    /// A picture cannot be put into an image of this format.
    #[error("the target of a picture is {found:?}, expected R8G8B8A8_UNORM, R8G8B8A8_SRGB or B8G8R8A8_UNORM")]
    TargetFormat {
        /// The image's format.
        found: vk::Format,
    },
    /// Commands are in another program's command buffer, which has not said that the device is done with it.
    #[error("a frame is still in the caller's command buffer, expected to hear that it is done")]
    WithCaller,
    /// A shader or the pipeline around it was refused.
    #[error("shader {name}: {reason}")]
    Shader {
        /// The shader's name, or the pipeline's.
        name: String,
        /// Why.
        reason: String,
    },
    /// Host access to memory that the host cannot map.
    #[error("{resource} is not in host-visible memory")]
    NotMapped {
        /// The resource's name.
        resource: String,
    },
    /// An access beyond the end of a resource.
    #[error("{resource}: access of {bytes} bytes at {offset} in {size} bytes")]
    OutOfRange {
        /// The resource's name.
        resource: String,
        /// Where the access begins, in bytes.
        offset: u64,
        /// Its length in bytes.
        bytes: u64,
        /// The resource's size in bytes.
        size: u64,
    },
    /// The pipeline cache could not be written.
    #[error("pipeline cache {path}: {reason}")]
    CacheFile {
        /// The file.
        path: String,
        /// What the system said.
        reason: String,
    },
    /// Any other call that the driver refused.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The Vulkan function.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
}

impl GpuError {
    /// Wraps the result of `call`, for use with `map_err`.
    pub(crate) fn call(call: &'static str) -> impl FnOnce(vk::Result) -> GpuError {
        move |result| GpuError::Vulkan { call, result }
    }

    /// Wraps the result of `call` made for `resource` of `bytes`: out-of-memory results name the resource.
    pub(crate) fn of_resource(
        call: &'static str,
        resource: &str,
        bytes: u64,
    ) -> impl FnOnce(vk::Result) -> GpuError {
        let resource = resource.to_owned();
        move |result| match result {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                GpuError::OutOfMemory { resource, bytes }
            }
            _ => GpuError::Vulkan { call, result },
        }
    }
}
