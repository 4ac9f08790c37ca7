//! A plan's images and buffers on the device, in heaps that they share.

use afterlight_gpu::{self as gpu, Device, GpuError, vk};

use crate::declare::{ImageInfo, Import, ResourceKind};
use crate::error::GraphError;
use crate::plan::{MemoryNeed, Placement, Plan, Requirements};

impl Requirements for Device {
    fn image(
        &self,
        name: &str,
        info: &ImageInfo,
        usage: vk::ImageUsageFlags,
    ) -> Result<MemoryNeed, GpuError> {
        self.image_requirements(&image_desc(name, info, usage)).map(need)
    }

    fn buffer(&self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> Result<MemoryNeed, GpuError> {
        self.buffer_requirements(&buffer_desc(name, bytes, usage)).map(need)
    }

    fn most_allocation_bytes(&self) -> u64 {
        self.features().max_allocation_bytes
    }

    fn most_groups(&self) -> [u32; 3] {
        self.features().max_workgroup_count
    }
}

pub(super) fn need(from: gpu::MemoryRequirements) -> MemoryNeed {
    MemoryNeed { bytes: from.bytes, alignment: from.alignment, type_bits: from.type_bits }
}

fn image_desc<'a>(name: &'a str, info: &ImageInfo, usage: vk::ImageUsageFlags) -> gpu::ImageDesc<'a> {
    gpu::ImageDesc {
        name,
        format: info.format,
        width: info.width,
        height: info.height,
        layers: info.layers,
        mips: info.mips,
        samples: info.samples,
        usage,
    }
}

fn buffer_desc(name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> gpu::BufferDesc<'_> {
    gpu::BufferDesc { name, bytes, usage, memory: gpu::MemoryKind::DeviceLocal }
}

#[derive(Clone)]
pub(super) enum Physical {
    Image(gpu::Image),
    Buffer(gpu::Buffer),
    Unused,
}

/// Refuses a frame that is larger than the device's memory before a driver is asked: each of its heaps may fit, and some drivers promise
/// more than there is.
fn check_memory(device: &Device, plan: &Plan) -> Result<(), GraphError> {
    let bytes = plan.peak_bytes();
    if bytes > device.allocatable_bytes() {
        let largest = plan.resources.iter().max_by_key(|resource| resource.need.bytes);
        let largest = largest.map_or("", |resource| resource.name.as_str());
        let resource = format!("the frame, {largest} and others");
        return Err(GpuError::OutOfMemory { resource, bytes }.into());
    }
    Ok(())
}

/// Makes the plan's resources; those with history are `taken_over` from an earlier plan, where all of them are there.
pub(super) fn make_resources(
    device: &Device,
    plan: &Plan,
    taken_over: Option<&[Physical]>,
) -> Result<Vec<Physical>, GraphError> {
    check_memory(device, plan)?;
    let is_taken = |index: usize| {
        let mut inside = plan
            .resources
            .iter()
            .filter(|resource| resource.placement.is_some_and(|place| place.heap == index));
        taken_over.is_some() && inside.all(|resource| resource.version.is_some())
    };
    let heaps: Vec<Option<gpu::Heap>> = plan
        .heaps
        .iter()
        .enumerate()
        .map(|(index, heap)| {
            if is_taken(index) {
                return Ok(None);
            }
            let inside = |place: Option<Placement>| place.is_some_and(|place| place.heap == index);
            let residents = plan.resources.iter().filter(|resource| inside(resource.placement));
            let largest =
                residents.max_by_key(|resource| resource.need.bytes).map_or("", |resource| &resource.name);
            let name = format!("frame heap of {largest} and others");
            device.create_heap(&name, heap.bytes, heap.type_bits).map(Some)
        })
        .collect::<Result<_, GpuError>>()?;
    plan.resources
        .iter()
        .enumerate()
        .map(|(index, resource)| {
            if let (Some(taken), Some(_)) = (taken_over, resource.version) {
                return Ok(taken[index].clone());
            }
            let heap = |place: Placement| heaps[place.heap].as_ref().expect("others have heaps of their own");
            let missing = |found: String, expected: String| GraphError::BadResource {
                name: resource.name.clone(),
                what: "usage of the imported resource",
                found,
                expected,
            };
            match (&resource.import, &resource.kind, resource.placement) {
                (Some(Import::Image { image, .. }), ..) => {
                    if !image.usage().contains(resource.image_usage) {
                        return Err(missing(
                            format!("{:?}", image.usage()),
                            format!("{:?}", resource.image_usage),
                        ));
                    }
                    Ok(Physical::Image(image.clone()))
                }
                (Some(Import::Buffer(buffer)), ..) => {
                    if !buffer.usage().contains(resource.buffer_usage) {
                        return Err(missing(
                            format!("{:?}", buffer.usage()),
                            format!("{:?}", resource.buffer_usage),
                        ));
                    }
                    Ok(Physical::Buffer(buffer.clone()))
                }
                (None, ResourceKind::Image(info), Some(place)) => {
                    let desc = image_desc(&resource.name, info, resource.image_usage);
                    Ok(Physical::Image(device.create_image_in(&desc, heap(place), place.offset)?))
                }
                (None, ResourceKind::Buffer { bytes }, Some(place)) => {
                    let desc = buffer_desc(&resource.name, *bytes, resource.buffer_usage);
                    Ok(Physical::Buffer(device.create_buffer_in(&desc, heap(place), place.offset)?))
                }
                _ => Ok(Physical::Unused),
            }
        })
        .collect()
}
