//! Vulkan 1.3 on ash and gpu-allocator: device, memory, pipelines, queries; the only unsafe code.
//!
//! Everything above this crate describes what it wants in plain data and never sees a raw handle. The enums and flags of
//! Vulkan are used as they are ([`vk`]), so that a reader of the specification recognises every name.
//!
//! What the crate guarantees, whatever the caller does:
//! - memory that the host maps is reached only within its bounds and by one thread at a time;
//! - a resource lives until the last command that uses it has completed: an [`Encoder`] holds what it records;
//! - what the device cannot do is an error that names the resource, what was asked and what there is.
//!
//! What it leaves to the caller (the frame graph derives it, validation with synchronization checks proves it): barriers,
//! image layouts, and that what a pipeline reads is bound.
//!
//! Requirements of a device: Vulkan 1.3, a queue with graphics and compute, `VK_KHR_push_descriptor`. All else is
//! detected into [`Features`] and enabled where present.
#![allow(unsafe_code)]

mod adopt;
mod cache;
mod callers;
mod descriptor;
mod device;
mod encoder;
mod error;
mod features;
mod format;
mod image;
mod instance;
mod memory;
mod pipeline;
mod recorder;
mod recording;
mod sampler;
mod upload;

pub use ash::vk;

pub use adopt::{Adopted, Needs};
pub use callers::{CallersCommands, Target};
pub use descriptor::{DescriptorSet, PushSet, SetLayoutDesc, SlotLayout, SlotResource, SlotWrite};
pub use device::{Device, DeviceOptions, Listed};
pub use encoder::{
    Access, BufferBarrier, ClearColor, ColorAttachment, Completed, DepthAttachment, Encoder, ImageBarrier,
    Load, MemoryBarrier, Rendering, Resolve, Statistics, StatisticsId, StencilAttachment, TimestampId,
};
pub use error::GpuError;
pub use features::{DeviceInfo, Features};
pub use format::{FormatInfo, format_info};
pub use image::{Image, ImageDesc, ImageView, ViewDesc, ViewKind};
pub use memory::{Buffer, BufferDesc, Heap, MemoryKind, MemoryRequirements};
pub use pipeline::{
    BlendEquation, BlendState, ComputePipelineDesc, DepthState, Pipeline, RasterPipelineDesc,
    RequiredSubgroup, ShaderCode, StencilFace, StencilState, VertexAttribute, VertexBinding,
};
pub use recording::Recording;
pub use sampler::{Sampler, SamplerDesc};
pub use upload::{UPLOAD_RING_BYTES, Uploader};
