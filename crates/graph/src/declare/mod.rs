//! The declaration of a frame: resources, passes, draws, all plain data.
//!
//! Handles are neither `Copy` nor `Clone`. A pass that writes a resource consumes its handle and hands back the next
//! version; readers borrow. So a version that a later pass has replaced cannot be read by mistake, and the order in
//! which passes are declared is an order in which they may run.
//!
//! Declaring never fails: what is wrong is kept and returned by [`Graph::plan`].

mod compute_pass;
mod constants;
mod draw;
mod fixed_function;
mod graph;
mod handles;
mod image_info;
mod nodes;
mod raster_pass;
mod raster_state;
mod script;
mod slots;
mod transfer;
mod vertex;

pub use compute_pass::ComputePass;
pub use constants::ConstantBits;
pub use draw::{Draw, DrawCall, Rect};
pub use fixed_function::{Blend, BlendEquation, DepthTest, StencilFace, StencilTest};
pub use graph::Graph;
pub use handles::{BufferHandle, Handle, History, ImageHandle, ResourceId};
pub use image_info::{ImageInfo, Subresource};
pub use nodes::Version;
pub(crate) use nodes::{
    CallNode, ColorLoad, ColorNode, DepthNode, DispatchCall, DrawNode, Import, Intent, PassKind, PassNode,
    RasterCommand, RasterNode, ResourceKind, ResourceNode, TransferNode,
};
pub use raster_pass::{Load, RasterPass};
pub use raster_state::RasterState;
pub use script::{Commands, ScriptId, Step};
pub use vertex::{VertexAttribute, VertexLayout, VertexStream};
