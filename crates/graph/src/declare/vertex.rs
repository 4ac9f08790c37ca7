//! Vertex buffers and attributes.

use afterlight_gpu::vk;

/// One vertex buffer binding of a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VertexStream {
    /// Distance from one element to the next, in bytes.
    pub stride_bytes: u32,
    /// Whether an element belongs to an instance rather than to a vertex.
    pub per_instance: bool,
}

/// One attribute of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VertexAttribute {
    /// Location in the vertex shader.
    pub location: u32,
    /// Index of the stream in [`VertexLayout::streams`].
    pub stream: u32,
    /// Format in memory.
    pub format: vk::Format,
    /// Offset from the element's start, in bytes.
    pub offset_bytes: u32,
}

/// Vertex input of a pipeline; empty where the shader fetches its vertices itself.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct VertexLayout {
    /// Vertex buffer bindings, in the order of [`Draw::vertex_buffers`](crate::Draw::vertex_buffers).
    pub streams: Vec<VertexStream>,
    /// Attributes read from them.
    pub attributes: Vec<VertexAttribute>,
}
