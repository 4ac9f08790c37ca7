//! Buffers, heaps and where they lie.

use crate::device::lock;
use crate::{Device, GpuError, ImageDesc};
use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

/// Where a buffer lies and who reaches it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MemoryKind {
    /// The device's own memory. Where the device shares the host's memory the host can map it all the same.
    DeviceLocal,
    /// Written by the host, read by the device.
    Upload,
    /// Written by the device, read by the host.
    Readback,
}

/// What a buffer is to be.
#[derive(Clone, Copy, Debug)]
pub struct BufferDesc<'a> {
    /// Name in errors, captures and reports.
    pub name: &'a str,
    /// Size in bytes. 0 is allowed: such a buffer can be bound and is never read.
    pub bytes: u64,
    /// Uses; copies to and from the buffer are always added.
    pub usage: vk::BufferUsageFlags,
    /// Where it lies.
    pub memory: MemoryKind,
}

/// What a resource needs of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryRequirements {
    /// Bytes that it occupies.
    pub bytes: u64,
    /// Alignment of its offset, in bytes; a power of two.
    pub alignment: u64,
    /// Memory types that it may lie in: bit i for type i.
    pub type_bits: u32,
}

impl From<vk::MemoryRequirements> for MemoryRequirements {
    fn from(r: vk::MemoryRequirements) -> Self {
        MemoryRequirements { bytes: r.size, alignment: r.alignment, type_bits: r.memory_type_bits }
    }
}

/// The memory behind a buffer or an image.
pub(crate) enum Memory {
    /// Its own piece of an allocator's block; `None` once freed.
    Own(Option<Allocation>),
    /// A place in a heap, which lives at least as long.
    In { _heap: Heap },
}

impl Memory {
    pub fn free(&mut self, device: &Device) {
        if let Memory::Own(allocation) = self
            && let Some(allocation) = allocation.take()
        {
            device.0.held_bytes.fetch_sub(allocation.size(), Ordering::Relaxed);
            // The allocator refuses only what it did not give; there is nobody to tell in a drop.
            let _ = device.with_allocator(|a| a.free(allocation));
        }
    }
}

/// Memory that buffers and images are placed in by offset, so that some can share bytes at different times.
/// Cloning shares it; it is freed after the last clone and the last resource in it.
#[derive(Clone)]
pub struct Heap(Arc<HeapInner>);

struct HeapInner {
    device: Device,
    raw: vk::DeviceMemory,
    name: String,
    bytes: u64,
    type_index: u32,
}

impl Heap {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Its size in bytes, all of it allocated.
    pub fn bytes(&self) -> u64 {
        self.0.bytes
    }

    pub(crate) fn raw(&self) -> vk::DeviceMemory {
        self.0.raw
    }

    /// Checks that something with `needs` fits at `offset`.
    pub(crate) fn check_fit(
        &self,
        resource: &str,
        needs: MemoryRequirements,
        offset: u64,
    ) -> Result<(), GpuError> {
        assert!(
            offset.is_multiple_of(needs.alignment),
            "{resource}: offset {offset} in heap {} is no multiple of {}",
            self.0.name,
            needs.alignment
        );
        assert!(
            needs.type_bits & (1 << self.0.type_index) != 0,
            "{resource}: wants memory types {:#b}, heap {} is of type {}",
            needs.type_bits,
            self.0.name,
            self.0.type_index
        );
        if offset.checked_add(needs.bytes).is_some_and(|end| end <= self.0.bytes) {
            Ok(())
        } else {
            Err(GpuError::OutOfRange {
                resource: format!("{resource} in heap {}", self.0.name),
                offset,
                bytes: needs.bytes,
                size: self.0.bytes,
            })
        }
    }
}

impl Drop for HeapInner {
    fn drop(&mut self) {
        self.device.0.held_bytes.fetch_sub(self.bytes, Ordering::Relaxed);
        // SAFETY: every resource in the heap holds it, so none is left.
        unsafe { self.device.0.raw.free_memory(self.raw, None) };
    }
}

/// A buffer. Cloning shares it; it is freed after the last clone and the last command that uses it.
#[derive(Clone)]
pub struct Buffer(pub(crate) Arc<BufferInner>);

pub(crate) struct BufferInner {
    device: Device,
    pub raw: vk::Buffer,
    pub name: String,
    pub bytes: u64,
    allocated_bytes: u64,
    usage: vk::BufferUsageFlags,
    memory: Memory,
    mapped: Option<Mapped>,
}

/// Host address of mapped memory; the lock makes host access exclusive.
struct Mapped(Mutex<*mut u8>);

// SAFETY: the memory is mapped for the life of the buffer, not bound to a thread, and reached only under the lock.
unsafe impl Send for Mapped {}
// SAFETY: as above.
unsafe impl Sync for Mapped {}

impl std::fmt::Debug for Buffer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Buffer").field("name", &self.0.name).field("bytes", &self.0.bytes).finish()
    }
}

impl Buffer {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Its size in bytes, as asked for.
    pub fn bytes(&self) -> u64 {
        self.0.bytes
    }

    /// The bytes that it occupies, by the device's memory requirements.
    pub fn allocated_bytes(&self) -> u64 {
        self.0.allocated_bytes
    }

    /// Its uses.
    pub fn usage(&self) -> vk::BufferUsageFlags {
        self.0.usage
    }

    /// Whether the host can read and write it directly.
    pub fn is_mapped(&self) -> bool {
        self.0.mapped.is_some()
    }

    /// Whether both are the same buffer.
    pub fn same(&self, other: &Buffer) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Copies `data` to `offset_bytes`. The device must not be using the range.
    ///
    /// # Errors
    /// [`GpuError::NotMapped`], [`GpuError::OutOfRange`].
    pub fn write(&self, offset_bytes: u64, data: &[u8]) -> Result<(), GpuError> {
        self.check_range(offset_bytes, data.len() as u64)?;
        self.with_mapped_mut(|mapped| {
            let at = offset_bytes as usize;
            mapped[at..at + data.len()].copy_from_slice(data);
        })
    }

    /// Copies the bytes at `offset_bytes` into `out`. The device must not be writing the range.
    ///
    /// # Errors
    /// [`GpuError::NotMapped`], [`GpuError::OutOfRange`].
    pub fn read(&self, offset_bytes: u64, out: &mut [u8]) -> Result<(), GpuError> {
        self.check_range(offset_bytes, out.len() as u64)?;
        self.with_mapped_mut(|mapped| {
            let at = offset_bytes as usize;
            out.copy_from_slice(&mapped[at..at + out.len()]);
        })
    }

    /// Runs `access` on the whole of the buffer's memory. The device must not be using it.
    /// `access` must not reach the same buffer again: its memory is locked meanwhile.
    ///
    /// # Errors
    /// [`GpuError::NotMapped`].
    pub fn with_mapped_mut<T>(&self, access: impl FnOnce(&mut [u8]) -> T) -> Result<T, GpuError> {
        let Some(mapped) = &self.0.mapped else {
            return Err(GpuError::NotMapped { resource: self.0.name.clone() });
        };
        let address = lock(&mapped.0);
        // SAFETY: `bytes` bytes are mapped at the address while the buffer lives, and the lock excludes other threads.
        // The memory is coherent; any bit pattern is a valid u8.
        let memory = unsafe { std::slice::from_raw_parts_mut(*address, self.0.bytes as usize) };
        Ok(access(memory))
    }

    /// Its address in shaders. The buffer needs the usage `SHADER_DEVICE_ADDRESS`; `None` without it.
    pub fn device_address(&self) -> Option<u64> {
        if !self.0.usage.contains(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS) {
            return None;
        }
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.0.raw);
        // SAFETY: the buffer is alive and has the usage; creating it so checked the feature.
        Some(unsafe { self.0.device.0.raw.get_buffer_device_address(&info) })
    }

    /// Checks that a range lies within the buffer.
    pub(crate) fn check_range(&self, offset: u64, bytes: u64) -> Result<(), GpuError> {
        if offset.checked_add(bytes).is_some_and(|end| end <= self.0.bytes) {
            Ok(())
        } else {
            Err(GpuError::OutOfRange { resource: self.0.name.clone(), offset, bytes, size: self.0.bytes })
        }
    }
}

impl Drop for BufferInner {
    fn drop(&mut self) {
        // SAFETY: encoders and descriptor sets hold the buffers they use, so the device is done with it.
        unsafe { self.device.0.raw.destroy_buffer(self.raw, None) };
        self.memory.free(&self.device);
    }
}

impl Device {
    /// Makes a buffer in memory of its own.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`] and [`GpuError::TooLarge`], both with the buffer's name.
    pub fn create_buffer(&self, desc: &BufferDesc<'_>) -> Result<Buffer, GpuError> {
        let raw = self.raw_buffer(desc)?;
        // SAFETY: the buffer was just made by this device.
        let needs = unsafe { self.0.raw.get_buffer_memory_requirements(raw) };
        let placed = self.allocate(desc.name, needs, desc.memory, true).and_then(|allocation| {
            // SAFETY: the allocation was made for these requirements, and belongs to this buffer alone.
            unsafe { self.0.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) }
                .map(|()| allocation)
                .map_err(GpuError::of_resource("vkBindBufferMemory", desc.name, needs.size))
        });
        let allocation = match placed {
            Ok(allocation) => allocation,
            Err(error) => {
                // SAFETY: nobody else has the buffer.
                unsafe { self.0.raw.destroy_buffer(raw, None) };
                return Err(error);
            }
        };
        let mapped = allocation.mapped_ptr().map(|p| Mapped(Mutex::new(p.as_ptr().cast())));
        Ok(self.buffer(desc, raw, needs.size, Memory::Own(Some(allocation)), mapped))
    }

    /// Makes a buffer at `offset_bytes` of `heap`. The host cannot map it. What else lies there at the same time
    /// is for the caller to know.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`] where it does not fit.
    ///
    /// # Panics
    /// If the offset is not aligned or the heap's memory type does not suit (see [`Device::buffer_requirements`]).
    pub fn create_buffer_in(
        &self,
        desc: &BufferDesc<'_>,
        heap: &Heap,
        offset_bytes: u64,
    ) -> Result<Buffer, GpuError> {
        let raw = self.raw_buffer(desc)?;
        // SAFETY: the buffer was just made by this device.
        let needs = unsafe { self.0.raw.get_buffer_memory_requirements(raw) };
        let bound = heap.check_fit(desc.name, needs.into(), offset_bytes).and_then(|()| {
            // SAFETY: offset, alignment and memory type have been checked.
            unsafe { self.0.raw.bind_buffer_memory(raw, heap.raw(), offset_bytes) }
                .map_err(GpuError::of_resource("vkBindBufferMemory", desc.name, needs.size))
        });
        if let Err(error) = bound {
            // SAFETY: nobody else has the buffer.
            unsafe { self.0.raw.destroy_buffer(raw, None) };
            return Err(error);
        }
        Ok(self.buffer(desc, raw, needs.size, Memory::In { _heap: heap.clone() }, None))
    }

    /// What a buffer of this description would need of memory; nothing is allocated.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn buffer_requirements(&self, desc: &BufferDesc<'_>) -> Result<MemoryRequirements, GpuError> {
        self.check_buffer(desc)?;
        let info = buffer_info(desc);
        let query = vk::DeviceBufferMemoryRequirements::default().create_info(&info);
        let mut needs = vk::MemoryRequirements2::default();
        // SAFETY: Vulkan 1.3 has maintenance4; the pointers live until the call returns.
        unsafe { self.0.raw.get_device_buffer_memory_requirements(&query, &mut needs) };
        Ok(needs.memory_requirements.into())
    }

    /// What an image of this description would need of memory; nothing is allocated.
    ///
    /// # Errors
    /// As [`Device::create_image`], but for memory.
    pub fn image_requirements(&self, desc: &ImageDesc<'_>) -> Result<MemoryRequirements, GpuError> {
        self.check_image(desc)?;
        let info = crate::image::image_info(desc);
        let query = vk::DeviceImageMemoryRequirements::default().create_info(&info);
        let mut needs = vk::MemoryRequirements2::default();
        // SAFETY: Vulkan 1.3 has maintenance4; the pointers live until the call returns.
        unsafe { self.0.raw.get_device_image_memory_requirements(&query, &mut needs) };
        Ok(needs.memory_requirements.into())
    }

    /// Allocates `bytes` of device-local memory of one of the types in `type_bits`.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::TooLarge`] with the heap's name.
    pub fn create_heap(&self, name: &str, bytes: u64, type_bits: u32) -> Result<Heap, GpuError> {
        let bytes = bytes.max(1);
        self.check_allocation(name, bytes, MemoryKind::DeviceLocal)?;
        let Some(type_index) = self.device_local_type(type_bits) else {
            return Err(GpuError::Allocation {
                resource: name.to_owned(),
                bytes,
                reason: format!("the device has no memory type among {type_bits:#b}"),
            });
        };
        let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        let mut info = vk::MemoryAllocateInfo::default().allocation_size(bytes).memory_type_index(type_index);
        if self.features().buffer_device_address {
            info = info.push_next(&mut flags);
        }
        // SAFETY: the type exists; the size is within the device's limit.
        let raw = unsafe { self.0.raw.allocate_memory(&info, None) }.map_err(GpuError::of_resource(
            "vkAllocateMemory",
            name,
            bytes,
        ))?;
        self.set_name(raw, name);
        self.0.held_bytes.fetch_add(bytes, Ordering::Relaxed);
        Ok(Heap(Arc::new(HeapInner { device: self.clone(), raw, name: name.to_owned(), bytes, type_index })))
    }

    /// A device-local memory type among `type_bits`; one that the host cannot map first, since mappable
    /// device memory can be scarce; any type where none is device-local.
    fn device_local_type(&self, type_bits: u32) -> Option<u32> {
        let types = self.0.memory.memory_types_as_slice();
        let among = |i: &usize| type_bits & (1 << *i) != 0;
        let local = |i: &usize| types[*i].property_flags.contains(vk::MemoryPropertyFlags::DEVICE_LOCAL);
        let hidden = |i: &usize| !types[*i].property_flags.contains(vk::MemoryPropertyFlags::HOST_VISIBLE);
        let mut candidates = (0..types.len()).filter(among);
        let found = candidates.clone().find(|i| local(i) && hidden(i));
        found.or_else(|| candidates.clone().find(local)).or_else(|| candidates.next()).map(|i| i as u32)
    }

    /// Things that hold the device open: clones of it, its resources, recordings and all else that was made of it and is not dropped yet.
    pub fn held_objects(&self) -> usize {
        Arc::strong_count(&self.0)
    }

    /// Bytes that buffers, images and heaps of this device hold at the moment, as they asked for them; an allocator's unused room is left out.
    pub fn held_bytes(&self) -> u64 {
        self.0.held_bytes.load(Ordering::Relaxed)
    }

    /// Takes memory for a resource from the allocator.
    pub(crate) fn allocate(
        &self,
        name: &str,
        needs: vk::MemoryRequirements,
        kind: MemoryKind,
        is_linear: bool,
    ) -> Result<Allocation, GpuError> {
        self.check_allocation(name, needs.size, kind)?;
        let desc = AllocationCreateDesc {
            name,
            requirements: needs,
            location: match kind {
                MemoryKind::DeviceLocal => MemoryLocation::GpuOnly,
                MemoryKind::Upload => MemoryLocation::CpuToGpu,
                MemoryKind::Readback => MemoryLocation::GpuToCpu,
            },
            linear: is_linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocated = self.with_allocator(|a| a.allocate(&desc));
        if let Ok(allocation) = &allocated {
            self.0.held_bytes.fetch_add(allocation.size(), Ordering::Relaxed);
        }
        allocated.map_err(|error| match error {
            AllocationError::OutOfMemory => {
                GpuError::OutOfMemory { resource: name.to_owned(), bytes: needs.size }
            }
            // The allocator reports a host that is out of memory as an internal error with the result's name.
            AllocationError::Internal(reason) if reason.contains("OUT_OF_HOST_MEMORY") => {
                GpuError::OutOfMemory { resource: name.to_owned(), bytes: needs.size }
            }
            other => GpuError::Allocation {
                resource: name.to_owned(),
                bytes: needs.size,
                reason: other.to_string(),
            },
        })
    }

    /// Most bytes of device-local memory that all allocations together may take: the largest heap. The memory of a CPU device is the
    /// host's, of which its heap may say nothing (2 GiB always, lavapipe of Mesa 22.3): there it is what the host has left, where that is more.
    pub fn allocatable_bytes(&self) -> u64 {
        let heap = self.features().device_local_heap_bytes;
        match self.info().kind {
            "cpu" => heap.max(host_memory_left_bytes().unwrap_or(0)),
            _ => heap,
        }
    }

    /// Refuses what cannot fit before a driver is asked: some overcommit and fail at the first touch.
    fn check_allocation(&self, name: &str, bytes: u64, kind: MemoryKind) -> Result<(), GpuError> {
        let features = self.features();
        let room = match kind {
            // The host is asked only about what its heap does not hold.
            MemoryKind::DeviceLocal if bytes <= features.device_local_heap_bytes => bytes,
            MemoryKind::DeviceLocal => self.allocatable_bytes(),
            MemoryKind::Upload | MemoryKind::Readback => {
                self.0.memory.memory_heaps_as_slice().iter().map(|h| h.size).max().unwrap_or(0)
            }
        };
        if bytes > room {
            return Err(GpuError::OutOfMemory { resource: name.to_owned(), bytes });
        }
        check_limit(name, "bytes of one allocation", bytes, features.max_allocation_bytes)
    }

    fn check_buffer(&self, desc: &BufferDesc<'_>) -> Result<(), GpuError> {
        if desc.usage.contains(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS)
            && !self.features().buffer_device_address
        {
            return Err(GpuError::MissingFeature {
                device: self.info().name.clone(),
                missing: format!("bufferDeviceAddress, which {} uses", desc.name),
            });
        }
        check_limit(
            desc.name,
            "bytes of a buffer",
            desc.bytes,
            self.features().max_buffer_bytes.saturating_sub(15),
        )
    }

    fn raw_buffer(&self, desc: &BufferDesc<'_>) -> Result<vk::Buffer, GpuError> {
        self.check_buffer(desc)?;
        // SAFETY: size and usage have been checked.
        let raw = unsafe { self.0.raw.create_buffer(&buffer_info(desc), None) }
            .map_err(GpuError::of_resource("vkCreateBuffer", desc.name, desc.bytes))?;
        self.set_name(raw, desc.name);
        Ok(raw)
    }

    fn buffer(
        &self,
        desc: &BufferDesc<'_>,
        raw: vk::Buffer,
        allocated_bytes: u64,
        memory: Memory,
        mapped: Option<Mapped>,
    ) -> Buffer {
        Buffer(Arc::new(BufferInner {
            device: self.clone(),
            raw,
            name: desc.name.to_owned(),
            bytes: desc.bytes,
            allocated_bytes,
            usage: usage(desc),
            memory,
            mapped,
        }))
    }
}

pub(crate) fn check_limit(
    resource: &str,
    what: &'static str,
    found: u64,
    limit: u64,
) -> Result<(), GpuError> {
    if found <= limit {
        Ok(())
    } else {
        Err(GpuError::TooLarge { resource: resource.to_owned(), what, found, limit })
    }
}

/// Memory that the host has left for programs; `None` where the system does not tell.
fn host_memory_left_bytes() -> Option<u64> {
    memory_left_bytes(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

/// The line `MemAvailable:   5242880 kB` of Linux's `/proc/meminfo`, in bytes.
fn memory_left_bytes(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

fn usage(desc: &BufferDesc<'_>) -> vk::BufferUsageFlags {
    desc.usage | vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST
}

fn buffer_info(desc: &BufferDesc<'_>) -> vk::BufferCreateInfo<'static> {
    // Rounded up so that an empty list can be bound as a vec4 array and whole words can be filled.
    vk::BufferCreateInfo::default().size(desc.bytes.max(1).next_multiple_of(16)).usage(usage(desc))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_left_is_read_from_linux() {
        let text = "MemTotal:       24000000 kB\nMemAvailable:    5242880 kB\n";
        assert_eq!(memory_left_bytes(text), Some(5 << 30));
        assert_eq!(memory_left_bytes("MemTotal: 1 kB"), None);
        assert_eq!(memory_left_bytes("MemAvailable: many kB"), None);
    }
}
