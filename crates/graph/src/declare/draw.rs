//! Draws: a pipeline state with its buffers and its call.

use afterlight_gpu::vk;

use super::handles::BufferHandle;
use super::raster_state::RasterState;

/// A rectangle in pixels, from the upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rect {
    /// Left edge.
    pub x_px: u32,
    /// Upper edge.
    pub y_px: u32,
    /// Width.
    pub width_px: u32,
    /// Height.
    pub height_px: u32,
}

/// The call that a draw makes.
#[derive(Clone, Copy, Debug)]
pub enum DrawCall<'a> {
    /// Vertices in order.
    Direct {
        /// Vertices an instance.
        vertices: u32,
        /// Instances.
        instances: u32,
        /// First vertex.
        first_vertex: u32,
        /// First instance.
        first_instance: u32,
    },
    /// Vertices by the index buffer.
    Indexed {
        /// Indices an instance.
        indices: u32,
        /// Instances.
        instances: u32,
        /// First index.
        first_index: u32,
        /// Added to each index.
        vertex_offset: i32,
        /// First instance.
        first_instance: u32,
    },
    /// `count` indirect calls (`VkDrawIndexedIndirectCommand`).
    IndexedIndirect {
        /// Buffer of the commands.
        buffer: &'a BufferHandle,
        /// Offset of the first command in bytes.
        offset: u64,
        /// Number of commands.
        count: u32,
        /// Distance between commands in bytes.
        stride: u32,
    },
    /// As many indirect indexed calls as a buffer says.
    IndexedIndirectCount {
        /// Buffer of the commands.
        buffer: &'a BufferHandle,
        /// Offset of the first command in bytes.
        offset: u64,
        /// Buffer of the `u32` count.
        count_buffer: &'a BufferHandle,
        /// Offset of the count in bytes.
        count_offset: u64,
        /// Upper bound of the count.
        max: u32,
        /// Distance between commands in bytes.
        stride: u32,
    },
}

impl DrawCall<'_> {
    /// Draws `vertices` vertices, once.
    pub fn vertices(vertices: u32) -> Self {
        DrawCall::Direct { vertices, instances: 1, first_vertex: 0, first_instance: 0 }
    }
}

/// One draw of a raster pass.
#[derive(Clone, Debug)]
pub struct Draw<'a> {
    /// Shaders and fixed-function state.
    pub pipeline: RasterState,
    /// Push constants, of the size that the shaders declare.
    pub push: Vec<u8>,
    /// Vertex buffers, in the order of the layout's streams.
    pub vertex_buffers: Vec<&'a BufferHandle>,
    /// Index buffer and its index type.
    pub index_buffer: Option<(&'a BufferHandle, vk::IndexType)>,
    /// The call.
    pub call: DrawCall<'a>,
    /// Scissor; `None` is the whole attachment.
    pub scissor: Option<Rect>,
    /// Stencil reference of both faces.
    pub stencil_reference: u32,
}

impl<'a> Draw<'a> {
    /// A draw without buffers, push constants and scissor.
    pub fn new(pipeline: RasterState, call: DrawCall<'a>) -> Self {
        Self {
            pipeline,
            push: Vec::new(),
            vertex_buffers: Vec::new(),
            index_buffer: None,
            call,
            scissor: None,
            stencil_reference: 0,
        }
    }

    /// Sets the push constants.
    pub fn push<T: bytemuck::NoUninit>(mut self, value: &T) -> Self {
        self.push = bytemuck::bytes_of(value).to_vec();
        self
    }

    /// Sets the index buffer.
    pub fn index_buffer(mut self, buffer: &'a BufferHandle, index_type: vk::IndexType) -> Self {
        self.index_buffer = Some((buffer, index_type));
        self
    }

    /// Adds a vertex buffer.
    pub fn vertex_buffer(mut self, buffer: &'a BufferHandle) -> Self {
        self.vertex_buffers.push(buffer);
        self
    }

    /// Sets the stencil reference.
    pub fn stencil_reference(mut self, reference: u32) -> Self {
        self.stencil_reference = reference;
        self
    }

    /// Sets the scissor.
    pub fn scissor(mut self, scissor: Rect) -> Self {
        self.scissor = Some(scissor);
        self
    }
}
