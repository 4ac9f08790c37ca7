//! What resources need of memory and what limits there are, as a device or a stand-in for it answers.

use afterlight_gpu::{GpuError, vk};

use crate::declare::ImageInfo;

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

/// Answers what images and buffers need of memory, and what a device takes at most: a device, or a stand-in for tests.
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

    /// Returns the largest allocation in bytes: no heap of a plan is larger, unless one resource is.
    fn most_allocation_bytes(&self) -> u64;

    /// Returns the most workgroups of a dispatch along each axis.
    fn most_groups(&self) -> [u32; 3];
}
