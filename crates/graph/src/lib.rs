//! Frame graph: declare, plan (pure), execute; barriers, lifetimes, aliasing, timings, every byte.
//!
//! [`Graph`] takes the declaration of a frame: resources, and passes that read and write them by the names that the
//! shaders use. [`Graph::plan`] turns it, without a device, into a [`Plan`]: passes in order, barriers, lifetimes, places
//! in memory. The executor makes what a plan needs once and runs it any number of times, and reports time, statistics
//! and bytes of everything.
//!
//! What a frame keeps for the next one has history: two versions that take turns, without a copy. Both live for the whole frame; a plan that
//! takes the place of another one goes on with them ([`Executor::after`]).
//! ```
//! use afterlight_graph::{BufferRole, Graph, PassRole};
//! let mut graph = Graph::new();
//! let counts = graph.history_buffer("counts", BufferRole::Counters, 64);
//! let now = graph.copy_buffer("go on", PassRole::Upkeep, &counts.before, counts.now);
//! let told = graph.buffer("told", BufferRole::Counters, 64);
//! let told = graph.copy_buffer("tell", PassRole::Upkeep, &now, told);
//! graph.keep(&told);
//! ```
//!
//! Every pass, buffer and image says what it is for where it is declared:
//! ```
//! use afterlight_graph::{BufferRole, Graph, PassRole};
//! let mut graph = Graph::new();
//! let lists = graph.buffer("lists", BufferRole::Lights, 64);
//! let _lists = graph.clear_buffer("clear lists", PassRole::LightAssignment, lists, 0);
//! ```
//! One without a role does not compile:
//! ```compile_fail,E0061
//! # use afterlight_graph::{BufferRole, Graph, PassRole};
//! # let mut graph = Graph::new();
//! let lists = graph.buffer("lists", 64);
//! ```
//! ```compile_fail,E0061
//! # use afterlight_graph::{BufferRole, Graph, PassRole};
//! # let mut graph = Graph::new();
//! graph.raster("geometry").finish();
//! ```

mod bind;
mod declare;
mod error;
mod execute;
mod plan;
mod report;
#[cfg(test)]
mod tests;

pub use afterlight_gpu as gpu;
pub use afterlight_roles::{BufferRole, PassRole, PassWork};

pub use declare::{
    Blend, BlendEquation, BufferHandle, Commands, ComputePass, ConstantBits, DepthTest, Draw, DrawCall,
    Graph, Handle, History, ImageHandle, ImageInfo, Load, RasterPass, RasterState, Rect, ResourceId,
    ScriptId, StencilFace, StencilTest, Step, Subresource, Version, VertexAttribute, VertexLayout,
    VertexStream,
};
pub use error::GraphError;
pub use execute::{Executor, FrameInput, FrameSlot, FrameTimes, KeptHistory, ResourceKey, Turn};
pub use plan::{
    Access, Barrier, MemoryNeed, Placement, Plan, PlannedHeap, PlannedPass, PlannedResource, Requirements,
    Traffic,
};
pub use report::{FrameReport, PassReport, ResourceReport, Statistics};
