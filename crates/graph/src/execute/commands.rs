//! Passes ready to be recorded: flat lists of what the encoder is given.

use afterlight_gpu::{self as gpu, vk};
use afterlight_roles::{PassRole, PassWork};

use crate::declare::ScriptId;

/// Barriers ready to be recorded: one for all memory, one for each part of an image that changes its layout.
#[derive(Default)]
pub(super) struct BarrierList {
    pub(super) memory: Option<gpu::MemoryBarrier>,
    pub(super) images: Vec<ImageTransition>,
}

pub(super) struct ImageTransition {
    pub(super) image: gpu::Image,
    pub(super) range: vk::ImageSubresourceRange,
    pub(super) before: gpu::Access,
    pub(super) after: gpu::Access,
    pub(super) old_layout: vk::ImageLayout,
    pub(super) new_layout: vk::ImageLayout,
}

pub(super) struct ColorTarget {
    pub(super) view: gpu::ImageView,
    pub(super) load: gpu::Load<gpu::ClearColor>,
    pub(super) resolve: Option<gpu::ImageView>,
}

pub(super) struct DepthTarget {
    pub(super) view: gpu::ImageView,
    pub(super) layout: vk::ImageLayout,
    pub(super) depth: Option<(gpu::Load<f32>, bool)>,
    pub(super) stencil: Option<(gpu::Load<u32>, bool)>,
}

/// A pipeline with the descriptors that are bound with it.
pub(super) struct Bindings {
    pub(super) pipeline: gpu::Pipeline,
    pub(super) push_set: gpu::PushSet,
    pub(super) texture_set: Option<gpu::DescriptorSet>,
}

pub(super) struct DrawCommand {
    /// Index into the pass's pipelines.
    pub(super) pipeline: usize,
    pub(super) push: Vec<u8>,
    pub(super) cull: vk::CullModeFlags,
    pub(super) front_face: vk::FrontFace,
    pub(super) depth_bias_slope: f32,
    pub(super) stencil_reference: u32,
    pub(super) scissor: vk::Rect2D,
    pub(super) vertex_buffers: Vec<gpu::Buffer>,
    pub(super) index_buffer: Option<(gpu::Buffer, vk::IndexType)>,
    pub(super) call: BoundCall,
}

pub(super) enum BoundCall {
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
        buffer: gpu::Buffer,
        offset: u64,
        count: u32,
        stride: u32,
    },
    IndexedIndirectCount {
        buffer: gpu::Buffer,
        offset: u64,
        count_buffer: gpu::Buffer,
        count_offset: u64,
        max: u32,
        stride: u32,
    },
}

pub(super) enum BoundCommand {
    Draw(Box<DrawCommand>),
    ClearStencil { value: u32, rect: vk::Rect2D },
}

pub(super) enum BoundDispatch {
    Direct([u32; 3]),
    Indirect(gpu::Buffer, u64),
}

pub(super) enum Body {
    Raster {
        extent: [u32; 2],
        viewport: Option<[f32; 4]>,
        layers: u32,
        colors: Vec<ColorTarget>,
        depth: Option<DepthTarget>,
        pipelines: Vec<Bindings>,
        commands: Vec<BoundCommand>,
        script: Option<ScriptId>,
    },
    Compute {
        bindings: Bindings,
        dispatches: Vec<(Vec<u8>, BoundDispatch)>,
    },
    Fill {
        buffer: gpu::Buffer,
        value: u32,
    },
    ClearImage {
        image: gpu::Image,
        value: gpu::ClearColor,
        range: vk::ImageSubresourceRange,
    },
    CopyBuffer {
        src: gpu::Buffer,
        dst: gpu::Buffer,
        bytes: u64,
    },
    CopyImage {
        src: gpu::Image,
        dst: gpu::Image,
        regions: Vec<vk::ImageCopy>,
    },
    CopyImageToBuffer {
        src: gpu::Image,
        dst: gpu::Buffer,
        regions: Vec<vk::BufferImageCopy>,
    },
}

pub(super) struct BoundPass {
    pub(super) name: String,
    pub(super) role: PassRole,
    pub(super) work: PassWork,
    pub(super) barriers: BarrierList,
    pub(super) body: Body,
}
