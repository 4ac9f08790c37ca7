//! What encoders and uploaders record with: command buffer, query pools, checkpoint words.

use crate::device::lost;
use crate::memory::MemoryKind;
use crate::{Device, GpuError};
use ash::vk;
use gpu_allocator::vulkan::{Allocation, Allocator};
use std::ptr::NonNull;

/// Queries of a pool; more are had by more pools.
pub(crate) const QUERIES_PER_POOL: u32 = 128;
/// Labels of one submission that a lost device can name; later ones are recorded without a checkpoint.
pub(crate) const CHECKPOINTS_MAX: usize = 1024;

/// A command pool with one command buffer, query pools and checkpoint words: what an encoder records with.
/// It is used again after the submission is done.
pub(crate) struct Recorder {
    pool: vk::CommandPool,
    pub commands: vk::CommandBuffer,
    /// Primary commands are submitted, secondary ones executed by another program's.
    pub level: vk::CommandBufferLevel,
    pub timestamp_pools: Vec<vk::QueryPool>,
    pub statistics_pools: Vec<vk::QueryPool>,
    pub checkpoints: Option<Checkpoints>,
}

/// A word for each label, which the device writes when it reaches the label's end: each its own, so that no two writes
/// need an order.
pub(crate) struct Checkpoints {
    pub buffer: vk::Buffer,
    allocation: Allocation,
    words: NonNull<u32>,
}

// SAFETY: the pointer leads to memory that is mapped as long as the allocation lives, and one thread owns the recorder.
unsafe impl Send for Recorder {}

impl Recorder {
    pub fn new(device: &Device, level: vk::CommandBufferLevel) -> Result<Recorder, GpuError> {
        let raw = &device.0.raw;
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.0.queue_family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the device is alive and has the queue family; so for every call of this function.
        let pool =
            unsafe { raw.create_command_pool(&info, None) }.map_err(GpuError::call("vkCreateCommandPool"))?;
        let mut recorder = Recorder {
            pool,
            commands: vk::CommandBuffer::null(),
            level,
            timestamp_pools: Vec::new(),
            statistics_pools: Vec::new(),
            checkpoints: None,
        };
        let info =
            vk::CommandBufferAllocateInfo::default().command_pool(pool).level(level).command_buffer_count(1);
        // SAFETY: the pool was just made.
        let made = unsafe { raw.allocate_command_buffers(&info) }
            .map_err(GpuError::call("vkAllocateCommandBuffers"))
            .and_then(|commands| {
                recorder.commands = commands[0];
                Checkpoints::new(device)
            });
        match made {
            Ok(checkpoints) => {
                recorder.checkpoints = Some(checkpoints);
                Ok(recorder)
            }
            Err(error) => {
                // SAFETY: nothing has been submitted.
                device.with_allocator(|a| unsafe { recorder.destroy(raw, Some(a)) });
                Err(error)
            }
        }
    }

    /// Resets the pool and begins the command buffer anew; `usage` says how often it will be submitted.
    pub fn begin(
        &mut self,
        device: &ash::Device,
        usage: vk::CommandBufferUsageFlags,
    ) -> Result<(), GpuError> {
        self.reset_queries(device);
        // SAFETY: the last submission of this recorder is done, so its commands are free.
        unsafe {
            device
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .map_err(GpuError::call("vkResetCommandPool"))?;
            // What primary commands ignore; secondary ones inherit nothing.
            let inherits = vk::CommandBufferInheritanceInfo::default();
            let info = vk::CommandBufferBeginInfo::default().flags(usage).inheritance_info(&inherits);
            device.begin_command_buffer(self.commands, &info).map_err(GpuError::call("vkBeginCommandBuffer"))
        }
    }

    /// Makes all queries ready to be used once more. The last submission of this recorder must be done.
    pub fn reset_queries(&mut self, device: &ash::Device) {
        for &pool in self.timestamp_pools.iter().chain(&self.statistics_pools) {
            // SAFETY: the queries are this recorder's, and the device is done with them.
            unsafe { device.reset_query_pool(pool, 0, QUERIES_PER_POOL) };
        }
    }

    /// # Safety
    /// What was submitted must be done.
    pub unsafe fn destroy(self, device: &ash::Device, allocator: Option<&mut Allocator>) {
        // SAFETY: the caller promises that the device is done with all of it.
        unsafe {
            for pool in self.timestamp_pools.into_iter().chain(self.statistics_pools) {
                device.destroy_query_pool(pool, None);
            }
            device.destroy_command_pool(self.pool, None);
            if let Some(checkpoints) = self.checkpoints {
                device.destroy_buffer(checkpoints.buffer, None);
                // It was this allocator's, which therefore takes it.
                let _ = allocator.map(|a| a.free(checkpoints.allocation));
            }
        }
    }
}

impl Checkpoints {
    fn new(device: &Device) -> Result<Checkpoints, GpuError> {
        const NAME: &str = "checkpoints";
        let bytes = 4 * CHECKPOINTS_MAX as u64;
        let info = vk::BufferCreateInfo::default().size(bytes).usage(vk::BufferUsageFlags::TRANSFER_DST);
        let raw = &device.0.raw;
        // SAFETY: the device is alive.
        let buffer = unsafe { raw.create_buffer(&info, None) }.map_err(GpuError::of_resource(
            "vkCreateBuffer",
            NAME,
            bytes,
        ))?;
        // SAFETY: the buffer was just made.
        let needs = unsafe { raw.get_buffer_memory_requirements(buffer) };
        let placed = device.allocate(NAME, needs, MemoryKind::Readback, true).and_then(|allocation| {
            // SAFETY: the allocation was made for these requirements.
            let bound = unsafe { raw.bind_buffer_memory(buffer, allocation.memory(), allocation.offset()) };
            match (bound, allocation.mapped_ptr()) {
                (Ok(()), Some(address)) => Ok(Checkpoints { buffer, allocation, words: address.cast() }),
                (Ok(()), None) => Err(GpuError::NotMapped { resource: NAME.to_owned() }),
                (Err(result), _) => Err(GpuError::Vulkan { call: "vkBindBufferMemory", result }),
            }
        });
        if placed.is_err() {
            // SAFETY: nobody else has the buffer.
            unsafe { raw.destroy_buffer(buffer, None) };
        }
        placed
    }

    pub fn clear(&mut self, count: usize) {
        // SAFETY: the words are mapped, `count` is at most their number, and the device is not using them.
        unsafe { self.words.as_ptr().write_bytes(0, count.min(CHECKPOINTS_MAX)) };
    }

    /// The last of the first `count` labels that was reached.
    pub fn last_reached(&self, count: usize) -> Option<usize> {
        // SAFETY: as above; the device wrote whole words, and writes no more once it is lost.
        (0..count.min(CHECKPOINTS_MAX))
            .rev()
            .find(|&i| unsafe { self.words.as_ptr().add(i).read_volatile() } != 0)
    }
}

/// The pool of query `index`, made and reset where it is the first of its pool.
pub(crate) fn query_pool(
    device: &ash::Device,
    pools: &mut Vec<vk::QueryPool>,
    index: u32,
    info: &vk::QueryPoolCreateInfo<'_>,
) -> Result<vk::QueryPool, GpuError> {
    let place = (index / QUERIES_PER_POOL) as usize;
    if place == pools.len() {
        let info = info.query_count(QUERIES_PER_POOL);
        // SAFETY: the device is alive; it has `hostQueryReset`, as every device of Vulkan 1.3 must.
        unsafe {
            let pool = device.create_query_pool(&info, None).map_err(GpuError::call("vkCreateQueryPool"))?;
            device.reset_query_pool(pool, 0, QUERIES_PER_POOL);
            pools.push(pool);
        }
    }
    Ok(pools[place])
}

/// Puts the results of the first `count` queries into `results`, in order. Returns whether they are there: those of commands that were
/// never submitted are not, and leave no results.
pub(crate) fn query_results<T: bytemuck::Pod>(
    device: &ash::Device,
    pools: &[vk::QueryPool],
    count: u32,
    results: &mut Vec<T>,
) -> Result<bool, GpuError> {
    results.clear();
    results.resize(count as usize, T::zeroed());
    for (part, &pool) in results.chunks_mut(QUERIES_PER_POOL as usize).zip(pools) {
        // SAFETY: all of these queries were used in a submission that is done; `T` is as many u64 as a query gives.
        match unsafe { device.get_query_pool_results(pool, 0, part, vk::QueryResultFlags::TYPE_64) } {
            Err(vk::Result::NOT_READY) => {
                results.clear();
                return Ok(false);
            }
            result => result.map_err(lost("vkGetQueryPoolResults", "all"))?,
        }
    }
    Ok(true)
}
