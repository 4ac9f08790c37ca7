//! Frame graph: declare, plan (pure), execute; barriers, lifetimes, aliasing, timings, every byte.
//!
//! [`Graph`] takes the declaration of a frame: resources, and passes that read and write them by the names that the
//! shaders use. [`Graph::plan`] turns it, without a device, into a [`Plan`]: passes in order, barriers, lifetimes, places
//! in memory. The executor makes what a plan needs once and runs it any number of times, and reports time, statistics
//! and bytes of everything.
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
pub use execute::{Executor, FrameInput, FrameSlot, FrameTimes, ResourceKey, Turn};
pub use plan::{
    Access, Barrier, MemoryNeed, Placement, Plan, PlannedHeap, PlannedPass, PlannedResource, Requirements,
    Traffic,
};
pub use report::{FrameReport, PassReport, ResourceReport, Statistics};
