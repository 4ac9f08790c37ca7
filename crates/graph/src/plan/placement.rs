//! Places of transient resources in heaps: those that live at different times share memory.

use super::PlannedResource;
use crate::declare::ResourceKind;

/// Where a transient resource lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// Index into [`Plan::heaps`](crate::Plan::heaps).
    pub heap: usize,
    /// Offset in the heap in bytes.
    pub offset: u64,
}

/// Memory that transient resources share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedHeap {
    /// Size in bytes.
    pub bytes: u64,
    /// Alignment of the heap's start in bytes.
    pub alignment: u64,
    /// Memory types it may be of.
    pub type_bits: u32,
}

/// Places resources: large ones first, each at the lowest offset that no resource alive at the same time holds. Images
/// and buffers have heaps of their own, so that no granularity between them matters; so have resources with history, which may outlive the plan. A heap is one allocation: where the next resource
/// would make it larger than `most_bytes`, the resource goes to another one. A resource that is larger by itself has a heap alone,
/// which the device then refuses.
pub(super) fn place(resources: &mut [PlannedResource], most_bytes: u64) -> Vec<PlannedHeap> {
    let mut heaps: Vec<PlannedHeap> = Vec::new();
    let mut keys: Vec<(u32, bool, bool)> = Vec::new();
    let mut order: Vec<usize> = (0..resources.len())
        .filter(|index| resources[*index].lifetime.is_some() && !resources[*index].imported)
        .collect();
    order.sort_by_key(|index| (std::cmp::Reverse(resources[*index].need.bytes), *index));
    for (placed, index) in order.iter().copied().enumerate() {
        let resource = &resources[index];
        let is_image = matches!(resource.kind, ResourceKind::Image(_));
        let key = (resource.need.type_bits, is_image, resource.version.is_some());
        let others = &order[..placed];
        let mut fitting = (0..heaps.len()).filter(|heap| keys[*heap] == key).map(|heap| {
            let offset = lowest_offset(resources, others, heap, resource);
            (heap, offset, offset + resource.need.bytes)
        });
        let (heap, offset, end) = fitting.find(|(.., end)| *end <= most_bytes).unwrap_or_else(|| {
            keys.push(key);
            (heaps.len(), 0, resource.need.bytes)
        });
        if heap == heaps.len() {
            heaps.push(PlannedHeap { bytes: 0, alignment: 1, type_bits: key.0 });
        }
        heaps[heap].bytes = heaps[heap].bytes.max(end);
        heaps[heap].alignment = heaps[heap].alignment.max(resource.need.alignment);
        resources[index].placement = Some(Placement { heap, offset });
    }
    heaps
}

/// Lowest offset in a heap at which a resource meets none of `others` that is alive at the same time.
fn lowest_offset(
    resources: &[PlannedResource],
    others: &[usize],
    heap: usize,
    resource: &PlannedResource,
) -> u64 {
    let mut taken: Vec<(u64, u64)> = others
        .iter()
        .map(|other| &resources[*other])
        .filter(|other| other.placement.is_some_and(|place| place.heap == heap) && overlap(other, resource))
        .filter_map(|other| Some((other.placement?.offset, other.placement?.offset + other.need.bytes)))
        .collect();
    taken.sort_unstable();
    let mut offset = 0u64;
    for (start, end) in taken {
        if start >= offset + resource.need.bytes {
            break;
        }
        offset = offset.max(end).next_multiple_of(resource.need.alignment);
    }
    offset
}

/// Whether two resources are alive at the same time.
pub(super) fn overlap(a: &PlannedResource, b: &PlannedResource) -> bool {
    match (a.lifetime, b.lifetime) {
        (Some(a), Some(b)) => a.0 <= b.1 && b.0 <= a.1,
        _ => false,
    }
}

pub(super) fn shares_memory(a: &PlannedResource, b: &PlannedResource) -> bool {
    match (a.placement, b.placement) {
        (Some(place_a), Some(place_b)) => {
            place_a.heap == place_b.heap
                && place_a.offset < place_b.offset + b.need.bytes
                && place_b.offset < place_a.offset + a.need.bytes
        }
        _ => false,
    }
}
