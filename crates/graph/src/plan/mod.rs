//! The pure planner: from a declared frame to passes in order, barriers, lifetimes, places in memory and bytes.
//!
//! Passes keep the order in which they were declared; those whose results nobody uses are dropped. For each part of a
//! resource (a mip level of a layer; a buffer whole) the planner follows the last write, the stages that have read since
//! and to whom the write is visible, and puts before a pass the least barrier that its accesses need. The first read
//! after a write makes it visible to all reads up to the next write, so that they need no barrier of their own.

mod access;
mod barriers;
mod hazards;
mod liveness;
mod placement;
mod planner;
mod requirements;
mod resolve;
mod resolve_raster;
mod resolve_transfer;
mod traffic;

use afterlight_gpu::vk;
use afterlight_roles::{BufferRole, PassRole, PassWork};

use crate::bind::BoundSlot;
use crate::declare::{Import, PassNode, ResourceId, ResourceKind, Version};

pub use access::Access;
pub(crate) use access::{aspects, mip_extent};
pub use barriers::Barrier;
pub use placement::{Placement, PlannedHeap};
pub use requirements::{MemoryNeed, Requirements};
pub use traffic::Traffic;

/// A pass of a plan.
#[derive(Clone)]
pub struct PlannedPass {
    /// The pass's name.
    pub name: String,
    /// What it is for.
    pub role: PassRole,
    /// By what kind of commands the device does it.
    pub work: PassWork,
    /// Barriers before the pass.
    pub barriers: Vec<Barrier>,
    /// What the pass uses.
    pub accesses: Vec<Access>,
    pub(crate) node: PassNode,
    /// Descriptors of each draw (raster) or of the one shader (compute).
    pub(crate) bindings: Vec<Vec<BoundSlot>>,
}

/// A resource of a plan.
#[derive(Clone)]
pub struct PlannedResource {
    /// The resource's name.
    pub name: String,
    /// What it holds.
    pub role: BufferRole,
    /// What it needs of memory; zero bytes for imported and unused resources.
    pub need: MemoryNeed,
    /// First and last pass (indices into [`Plan::passes`]) that use it; kept resources last to the end. `None` is unused.
    pub lifetime: Option<(usize, usize)>,
    /// Its place; `None` for imported and unused resources.
    pub placement: Option<Placement>,
    /// Whether it was kept to be read back.
    pub kept: bool,
    /// Whether it is the final colour target.
    pub output: bool,
    /// Whether it lives outside the graph.
    pub imported: bool,
    /// Usage that the passes need, for images.
    pub image_usage: vk::ImageUsageFlags,
    /// Usage that the passes need, for buffers.
    pub buffer_usage: vk::BufferUsageFlags,
    pub(crate) kind: ResourceKind,
    pub(crate) import: Option<Import>,
    /// Which version it is of a resource with history.
    pub version: Option<Version>,
    /// Layout of each part after the frame (`layer * mips + mip`); of imports and of resources with history before it too.
    pub(crate) final_layouts: Vec<vk::ImageLayout>,
}

impl PlannedResource {
    /// Returns whether it belongs to work that techniques share.
    pub fn shared(&self) -> bool {
        self.role.is_shared()
    }
}

/// A frame ready to be executed.
#[derive(Clone)]
pub struct Plan {
    /// Passes in the order in which they run.
    pub passes: Vec<PlannedPass>,
    /// Every declared resource.
    pub resources: Vec<PlannedResource>,
    /// Memory that transient resources share.
    pub heaps: Vec<PlannedHeap>,
    /// Barriers after the last pass: imported images return to their layout.
    pub final_barriers: Vec<Barrier>,
    /// Names of passes that were dropped since nobody uses their results.
    pub dropped: Vec<String>,
    /// Number of scripts, see [`Step`](crate::Step).
    pub scripts: u32,
    /// Slots that a pass binds for reading and none of its shaders has, as `pass: slot`.
    pub unused_slots: Vec<String>,
}

impl Plan {
    /// Returns the resource of that name.
    pub fn resource(&self, name: &str) -> Option<ResourceId> {
        let index = self.resources.iter().position(|resource| resource.name == name)?;
        u32::try_from(index).ok().map(ResourceId)
    }

    /// Bytes of all heaps: the most that the frame's transient resources hold at once, as allocated.
    pub fn peak_bytes(&self) -> u64 {
        self.heaps.iter().map(|heap| heap.bytes).sum()
    }

    /// Whether some resource has history: frames then take turns ([`Turn`](crate::Turn)).
    pub fn has_history(&self) -> bool {
        self.resources.iter().any(|resource| resource.version.is_some() && resource.placement.is_some())
    }

    /// Bytes of resources with history, both versions of each. They are part of [`Plan::peak_bytes`], and of [`Plan::technique_bytes`] unless
    /// their role is shared work.
    pub fn history_bytes(&self) -> u64 {
        let with_history = self.resources.iter().filter(|resource| resource.version.is_some());
        with_history.map(|resource| resource.need.bytes).sum()
    }

    /// Bytes of everything that the technique allocates: without imported resources, the final colour target, and
    /// resources whose role is shared work. Aliased resources count in full.
    pub fn technique_bytes(&self) -> u64 {
        self.resources
            .iter()
            .filter(|resource| !resource.imported && !resource.output && !resource.shared())
            .map(|resource| resource.need.bytes)
            .sum()
    }
}
