//! The declared frame as the planner reads it.

use afterlight_gpu::{self as gpu, vk};
use afterlight_roles::{BufferRole, PassRole, PassWork};
use afterlight_shader::Shader;

use super::draw::Rect;
use super::handles::ResourceId;
use super::image_info::{ImageInfo, Subresource};
use super::raster_pass::Load;
use super::raster_state::RasterState;
use super::script::ScriptId;

#[derive(Clone, PartialEq, Eq)]
pub(crate) enum ResourceKind {
    Image(ImageInfo),
    Buffer { bytes: u64 },
}

#[derive(Clone)]
pub(crate) enum Import {
    Image {
        image: gpu::Image,
        layout: vk::ImageLayout,
    },
    Buffer(gpu::Buffer),
    /// Imported in a plan without a device.
    #[cfg(test)]
    Fake {
        layout: vk::ImageLayout,
    },
}

/// Which of the two versions of a resource with history a resource is; each names the other one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// What this frame writes, and the next frame reads.
    Now {
        /// The version that the frame before wrote.
        before: ResourceId,
    },
    /// What the frame before wrote.
    Before {
        /// The version that this frame writes.
        now: ResourceId,
    },
}

impl Version {
    /// The other version.
    pub fn other(self) -> ResourceId {
        match self {
            Self::Now { before } => before,
            Self::Before { now } => now,
        }
    }
}

#[derive(Clone)]
pub(crate) struct ResourceNode {
    pub name: String,
    pub role: BufferRole,
    pub kind: ResourceKind,
    pub import: Option<Import>,
    /// Of resources with history.
    pub version: Option<Version>,
    pub kept: bool,
    pub output: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Intent {
    Read,
    Write,
}

#[derive(Clone)]
pub(crate) struct SlotNode {
    pub slot: String,
    pub intent: Intent,
    /// `None` is a sampler alone.
    pub resource: Option<ResourceId>,
    pub range: Subresource,
    pub sampler: Option<gpu::SamplerDesc>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ColorLoad {
    Float(Load<[f32; 4]>),
    Uint(Load<[u32; 4]>),
}

impl ColorLoad {
    pub(crate) fn keeps(&self) -> bool {
        matches!(self, Self::Float(Load::Keep) | Self::Uint(Load::Keep))
    }
}

#[derive(Clone)]
pub(crate) struct ColorNode {
    pub resource: ResourceId,
    pub range: Subresource,
    pub load: ColorLoad,
    pub resolve: Option<(ResourceId, Subresource)>,
}

#[derive(Clone)]
pub(crate) struct DepthNode {
    pub resource: ResourceId,
    pub range: Subresource,
    /// `None` where the pass only reads depth.
    pub depth: Option<Load<f32>>,
    /// `None` where the pass does not write the stencil.
    pub stencil: Option<Load<u32>>,
}

#[derive(Clone)]
pub(crate) enum CallNode {
    Direct {
        vertices: u32,
        instances: u32,
        first_vertex: u32,
        first_instance: u32,
    },
    Indexed {
        indices: u32,
        instances: u32,
        first_index: u32,
        vertex_offset: i32,
        first_instance: u32,
    },
    IndexedIndirect {
        buffer: ResourceId,
        offset: u64,
        count: u32,
        stride: u32,
    },
    IndexedIndirectCount {
        buffer: ResourceId,
        offset: u64,
        count_buffer: ResourceId,
        count_offset: u64,
        max: u32,
        stride: u32,
    },
}

#[derive(Clone)]
pub(crate) struct DrawNode {
    pub state: RasterState,
    pub push: Vec<u8>,
    pub vertex_buffers: Vec<ResourceId>,
    pub index_buffer: Option<(ResourceId, vk::IndexType)>,
    pub call: CallNode,
    pub scissor: Option<Rect>,
    pub stencil_reference: u32,
}

#[derive(Clone)]
pub(crate) enum RasterCommand {
    Draw(Box<DrawNode>),
    ClearStencil { value: u32, rect: Option<Rect> },
}

#[derive(Clone, Default)]
pub(crate) struct RasterNode {
    pub colors: Vec<ColorNode>,
    pub depth: Option<DepthNode>,
    pub commands: Vec<RasterCommand>,
    /// Extent of a pass without attachments.
    pub extent: Option<(u32, u32)>,
    /// Viewport in pixels: x, y, width, height; `None` is the attachments' extent.
    pub viewport: Option<[f32; 4]>,
    /// The script that makes the draws; `None` makes each once, in order.
    pub script: Option<ScriptId>,
}

#[derive(Clone, Copy)]
pub(crate) enum DispatchCall {
    Direct([u32; 3]),
    Indirect { buffer: ResourceId, offset: u64 },
}

#[derive(Clone)]
pub(crate) struct DispatchNode {
    pub push: Vec<u8>,
    pub call: DispatchCall,
}

#[derive(Clone)]
pub(crate) struct ComputeNode {
    pub shader: Shader,
    pub constants: Vec<(String, u32)>,
    pub push: Vec<u8>,
    pub dispatches: Vec<DispatchNode>,
    /// Invocations that each subgroup must have.
    pub subgroup_size: Option<u32>,
}

#[derive(Clone, Copy)]
pub(crate) enum TransferNode {
    FillBuffer { buffer: ResourceId, value: u32 },
    ClearImage { image: ResourceId, color: [f32; 4], range: Subresource },
    CopyBuffer { src: ResourceId, dst: ResourceId, bytes: u64 },
    CopyImage { src: ResourceId, dst: ResourceId },
    CopyImageToBuffer { src: ResourceId, range: Subresource, dst: ResourceId },
}

#[derive(Clone)]
pub(crate) enum PassKind {
    Raster(RasterNode),
    Compute(Box<ComputeNode>),
    Transfer(TransferNode),
}

impl PassKind {
    /// By what kind of commands the device does it.
    pub(crate) fn work(&self) -> PassWork {
        match self {
            Self::Raster(_) => PassWork::Raster,
            Self::Compute(_) => PassWork::Compute,
            Self::Transfer(TransferNode::FillBuffer { .. } | TransferNode::ClearImage { .. }) => {
                PassWork::Clear
            }
            Self::Transfer(_) => PassWork::Copy,
        }
    }
}

impl ResourceNode {
    /// Whether the frame before wrote it.
    pub(crate) fn is_before(&self) -> bool {
        matches!(self.version, Some(Version::Before { .. }))
    }
}

#[derive(Clone)]
pub(crate) struct PassNode {
    pub name: String,
    pub role: PassRole,
    pub kind: PassKind,
    pub slots: Vec<SlotNode>,
    pub texture_set: Option<gpu::DescriptorSet>,
    pub has_effect: bool,
}
