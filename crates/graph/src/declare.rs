//! The declaration of a frame: resources, passes, draws, all plain data.
//!
//! Handles are neither `Copy` nor `Clone`. A pass that writes a resource consumes its handle and hands back the next
//! version; readers borrow. So a version that a later pass has replaced cannot be read by mistake, and the order in
//! which passes are declared is an order in which they may run.
//!
//! Declaring never fails: what is wrong is kept and returned by [`Graph::plan`].

use std::sync::atomic::{AtomicU64, Ordering};

use afterlight_gpu::{self as gpu, vk};
use afterlight_roles::{BufferRole, PassRole, PassWork};
use afterlight_shader::Shader;

use crate::error::GraphError;

static NEXT_GRAPH: AtomicU64 = AtomicU64::new(1);

/// Identifies a resource of a graph across its versions; outlives the handles, so that a result can be read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ResourceId(pub(crate) u32);

/// One version of an image.
#[derive(Debug)]
#[must_use = "a write returns the next version of the image; dropping it loses the result"]
pub struct ImageHandle {
    pub(crate) graph: u64,
    pub(crate) resource: ResourceId,
    info: ImageInfo,
}

impl ImageHandle {
    /// Returns the resource that this is a version of.
    pub fn id(&self) -> ResourceId {
        self.resource
    }

    /// Returns format and extents of the image.
    pub fn info(&self) -> ImageInfo {
        self.info
    }
}

/// One version of a buffer.
#[derive(Debug)]
#[must_use = "a write returns the next version of the buffer; dropping it loses the result"]
pub struct BufferHandle {
    pub(crate) graph: u64,
    pub(crate) resource: ResourceId,
    bytes: u64,
}

impl BufferHandle {
    /// Returns the resource that this is a version of.
    pub fn id(&self) -> ResourceId {
        self.resource
    }

    /// Returns the buffer's size in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::ImageHandle {}
    impl Sealed for super::BufferHandle {}
}

/// A handle of either kind.
pub trait Handle: sealed::Sealed {
    /// Returns the graph that the handle belongs to and its resource.
    #[doc(hidden)]
    fn parts(&self) -> (u64, ResourceId);
}

impl Handle for ImageHandle {
    fn parts(&self) -> (u64, ResourceId) {
        (self.graph, self.resource)
    }
}

impl Handle for BufferHandle {
    fn parts(&self) -> (u64, ResourceId) {
        (self.graph, self.resource)
    }
}

/// Format and extents of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageInfo {
    /// Texel format.
    pub format: vk::Format,
    /// Width of level 0 in pixels, at least 1.
    pub width: u32,
    /// Height of level 0 in pixels, at least 1.
    pub height: u32,
    /// Array layers, at least 1.
    pub layers: u32,
    /// Mip levels, at least 1.
    pub mips: u32,
    /// Samples a pixel: a power of two.
    pub samples: u32,
}

impl ImageInfo {
    /// Describes an image of one layer, one level and one sample.
    pub fn new(format: vk::Format, width: u32, height: u32) -> Self {
        Self { format, width, height, layers: 1, mips: 1, samples: 1 }
    }

    /// Returns the same with `samples` samples a pixel.
    pub fn samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// Returns the same with `mips` mip levels.
    pub fn mips(self, mips: u32) -> Self {
        Self { mips, ..self }
    }

    /// Returns the same with `layers` array layers.
    pub fn layers(self, layers: u32) -> Self {
        Self { layers, ..self }
    }
}

/// A range of mip levels and array layers of an image; `u32::MAX` counts mean "the rest".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Subresource {
    /// First mip level.
    pub mip: u32,
    /// Number of mip levels.
    pub mip_count: u32,
    /// First array layer.
    pub layer: u32,
    /// Number of array layers.
    pub layer_count: u32,
}

impl Subresource {
    /// Every level and layer.
    pub const ALL: Self = Self { mip: 0, mip_count: u32::MAX, layer: 0, layer_count: u32::MAX };

    /// One mip level, every layer.
    pub const fn mip(mip: u32) -> Self {
        Self { mip, mip_count: 1, ..Self::ALL }
    }

    /// One array layer, every level.
    pub const fn layer(layer: u32) -> Self {
        Self { layer, layer_count: 1, ..Self::ALL }
    }

    /// One mip level of one layer.
    pub const fn mip_layer(mip: u32, layer: u32) -> Self {
        Self { mip, mip_count: 1, layer, layer_count: 1 }
    }

    /// Replaces open counts by what the image has; `None` where the range leaves the image.
    pub(crate) fn resolve(self, mips: u32, layers: u32) -> Option<Self> {
        let close = |first: u32, count: u32, all: u32| match count {
            u32::MAX if first < all => Some(all - first),
            0 => None,
            _ if first.checked_add(count).is_some_and(|end| end <= all) => Some(count),
            _ => None,
        };
        Some(Self {
            mip: self.mip,
            mip_count: close(self.mip, self.mip_count, mips)?,
            layer: self.layer,
            layer_count: close(self.layer, self.layer_count, layers)?,
        })
    }
}

/// What an attachment holds when a raster pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load<T> {
    /// The given value everywhere.
    Clear(T),
    /// What earlier passes wrote.
    Keep,
    /// Anything: the pass covers every pixel that it or others read.
    DontCare,
}

/// Depth comparison and writing of a draw. Depth is reversed: near is 1, infinitely far 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// Comparison of the fragment's depth (left) to the stored one (right).
    pub compare: vk::CompareOp,
    /// Whether a passing fragment stores its depth.
    pub write: bool,
}

impl DepthTest {
    /// Neither tests nor writes.
    pub const OFF: Self = Self { compare: vk::CompareOp::ALWAYS, write: false };
    /// Keeps the nearest surface (reversed depth).
    pub const NEAREST: Self = Self { compare: vk::CompareOp::GREATER, write: true };
    /// Passes where the depth equals that of a pre-pass.
    pub const EQUAL: Self = Self { compare: vk::CompareOp::EQUAL, write: false };
}

/// What one face does to the stencil buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilFace {
    /// Comparison of the reference (left) to the stored value (right), both masked.
    pub compare: vk::CompareOp,
    /// Operation where the stencil test fails.
    pub fail: vk::StencilOp,
    /// Operation where the stencil test passes and the depth test fails.
    pub depth_fail: vk::StencilOp,
    /// Operation where both pass.
    pub pass: vk::StencilOp,
}

impl StencilFace {
    /// Passes always and keeps the stored value.
    pub const KEEP: Self = Self {
        compare: vk::CompareOp::ALWAYS,
        fail: vk::StencilOp::KEEP,
        depth_fail: vk::StencilOp::KEEP,
        pass: vk::StencilOp::KEEP,
    };

    fn writes(&self) -> bool {
        [self.fail, self.depth_fail, self.pass].iter().any(|op| *op != vk::StencilOp::KEEP)
    }
}

/// Stencil test of a draw; the reference value is part of the [`Draw`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilTest {
    /// For front faces.
    pub front: StencilFace,
    /// For back faces.
    pub back: StencilFace,
    /// Bits that take part in the comparison.
    pub compare_mask: u32,
    /// Bits that operations may change.
    pub write_mask: u32,
}

impl StencilTest {
    /// Returns whether a draw with this test can change the stencil buffer.
    pub fn writes(&self) -> bool {
        self.write_mask != 0 && (self.front.writes() || self.back.writes())
    }
}

/// Blending of one colour attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Blend {
    /// The blend equation; `None` replaces.
    pub equation: Option<BlendEquation>,
    /// Channels that are written.
    pub write_mask: vk::ColorComponentFlags,
}

/// Factors and operations of a blend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendEquation {
    /// Factor of the fragment's colour.
    pub src_color: vk::BlendFactor,
    /// Factor of the stored colour.
    pub dst_color: vk::BlendFactor,
    /// How the two colours combine.
    pub color_op: vk::BlendOp,
    /// Factor of the fragment's alpha.
    pub src_alpha: vk::BlendFactor,
    /// Factor of the stored alpha.
    pub dst_alpha: vk::BlendFactor,
    /// How the two alphas combine.
    pub alpha_op: vk::BlendOp,
}

impl Blend {
    /// Replaces what is stored.
    pub const REPLACE: Self = Self { equation: None, write_mask: vk::ColorComponentFlags::RGBA };
    /// Writes nothing.
    pub const NONE: Self = Self { equation: None, write_mask: vk::ColorComponentFlags::empty() };
    /// Adds colour and alpha to what is stored.
    pub const ADD: Self = Self {
        equation: Some(BlendEquation {
            src_color: vk::BlendFactor::ONE,
            dst_color: vk::BlendFactor::ONE,
            color_op: vk::BlendOp::ADD,
            src_alpha: vk::BlendFactor::ONE,
            dst_alpha: vk::BlendFactor::ONE,
            alpha_op: vk::BlendOp::ADD,
        }),
        write_mask: vk::ColorComponentFlags::RGBA,
    };
}

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
    /// Vertex buffer bindings, in the order of [`Draw::vertex_buffers`].
    pub streams: Vec<VertexStream>,
    /// Attributes read from them.
    pub attributes: Vec<VertexAttribute>,
}

/// State of a raster pipeline: with the pass's attachment formats it is the pipeline's key.
#[derive(Clone, Debug)]
pub struct RasterState {
    /// Vertex shader.
    pub vertex: Shader,
    /// Tessellation control and evaluation shaders: three vertices of the triangle list are a patch.
    pub tessellation: Option<(Shader, Shader)>,
    /// Geometry shader.
    pub geometry: Option<Shader>,
    /// Fragment shader; `None` for depth or stencil alone.
    pub fragment: Option<Shader>,
    /// Specialization constants by name, as bits; each goes to every stage that has it.
    pub constants: Vec<(String, u32)>,
    /// How vertices form primitives.
    pub topology: vk::PrimitiveTopology,
    /// Depth test.
    pub depth: DepthTest,
    /// Clamps depth to the viewport's range instead of clipping at the near and far planes.
    pub depth_clamp: bool,
    /// Is added to depth for every unit of depth that the triangle falls or rises from one pixel to the next, along the axis
    /// of the image where that is more; 0 adds nothing.
    pub depth_bias_slope: f32,
    /// Stencil test; `None` is off.
    pub stencil: Option<StencilTest>,
    /// One entry a colour attachment, or empty: all replace.
    pub blend: Vec<Blend>,
    /// What the blend factors `CONSTANT_…` are: RGBA.
    pub blend_constants: [f32; 4],
    /// Faces that are dropped.
    pub cull: vk::CullModeFlags,
    /// Winding of front faces, as seen in the framebuffer.
    pub front_face: vk::FrontFace,
    /// Vertex buffers and attributes.
    pub layout: VertexLayout,
}

impl RasterState {
    /// State of a triangle list without culling, depth test, stencil test, blending and vertex buffers.
    pub fn new(vertex: &Shader, fragment: Option<&Shader>) -> Self {
        Self {
            vertex: vertex.clone(),
            tessellation: None,
            geometry: None,
            fragment: fragment.cloned(),
            constants: Vec::new(),
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            depth: DepthTest::OFF,
            depth_clamp: false,
            depth_bias_slope: 0.0,
            stencil: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
            cull: vk::CullModeFlags::NONE,
            front_face: vk::FrontFace::COUNTER_CLOCKWISE,
            layout: VertexLayout::default(),
        }
    }

    /// Sets tessellation control and evaluation shaders.
    pub fn tessellation(mut self, control: &Shader, evaluation: &Shader) -> Self {
        self.tessellation = Some((control.clone(), evaluation.clone()));
        self
    }

    /// Sets the geometry shader.
    pub fn geometry(mut self, geometry: &Shader) -> Self {
        self.geometry = Some(geometry.clone());
        self
    }

    /// The shaders, in the order of their stages.
    pub(crate) fn shaders(&self) -> Vec<&Shader> {
        let (control, evaluation) = self.tessellation.as_ref().map(|(c, e)| (c, e)).unzip();
        [Some(&self.vertex), control, evaluation, self.geometry.as_ref(), self.fragment.as_ref()]
            .into_iter()
            .flatten()
            .collect()
    }

    /// Sets a specialization constant by name: a `u32`, `i32`, `f32` or `bool`.
    pub fn constant(mut self, name: &str, value: impl ConstantBits) -> Self {
        self.constants.push((name.to_owned(), value.bits()));
        self
    }

    /// Sets the depth test.
    pub fn depth(mut self, depth: DepthTest) -> Self {
        self.depth = depth;
        self
    }

    /// Sets the stencil test.
    pub fn stencil(mut self, stencil: StencilTest) -> Self {
        self.stencil = Some(stencil);
        self
    }

    /// Sets the blending of every colour attachment, in order.
    pub fn blend(mut self, blend: impl Into<Vec<Blend>>) -> Self {
        self.blend = blend.into();
        self
    }

    /// Sets what the blend factors `CONSTANT_…` are.
    pub fn blend_constants(mut self, rgba: [f32; 4]) -> Self {
        self.blend_constants = rgba;
        self
    }

    /// Sets which faces are dropped.
    pub fn cull(mut self, cull: vk::CullModeFlags) -> Self {
        self.cull = cull;
        self
    }

    /// Sets the winding of front faces.
    pub fn front_face(mut self, front_face: vk::FrontFace) -> Self {
        self.front_face = front_face;
        self
    }

    /// Sets vertex buffers and attributes.
    pub fn layout(mut self, layout: VertexLayout) -> Self {
        self.layout = layout;
        self
    }

    /// Sets the topology.
    pub fn topology(mut self, topology: vk::PrimitiveTopology) -> Self {
        self.topology = topology;
        self
    }
}

/// A value that a specialization constant can take.
pub trait ConstantBits {
    /// Returns the 32 bits that the constant is set to.
    fn bits(self) -> u32;
}

impl ConstantBits for u32 {
    fn bits(self) -> u32 {
        self
    }
}

impl ConstantBits for i32 {
    fn bits(self) -> u32 {
        self.cast_unsigned()
    }
}

impl ConstantBits for f32 {
    fn bits(self) -> u32 {
        self.to_bits()
    }
}

impl ConstantBits for bool {
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

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
    /// `count` indirect calls (`VkDrawIndirectCommand`).
    Indirect {
        /// Buffer of the commands.
        buffer: &'a BufferHandle,
        /// Offset of the first command in bytes.
        offset: u64,
        /// Number of commands.
        count: u32,
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

// ---------------------------------------------------------------------------------------------------------------
// The declared frame, as the planner reads it.

#[derive(Clone)]
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

#[derive(Clone)]
pub(crate) struct ResourceNode {
    pub name: String,
    pub role: BufferRole,
    pub kind: ResourceKind,
    pub import: Option<Import>,
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
    Indirect {
        buffer: ResourceId,
        offset: u64,
        count: u32,
        stride: u32,
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

#[derive(Clone)]
pub(crate) struct PassNode {
    pub name: String,
    pub role: PassRole,
    pub kind: PassKind,
    pub slots: Vec<SlotNode>,
    pub texture_set: Option<gpu::DescriptorSet>,
    pub has_effect: bool,
}

/// A frame under declaration.
pub struct Graph {
    id: u64,
    pub(crate) resources: Vec<ResourceNode>,
    pub(crate) passes: Vec<PassNode>,
    pub(crate) errors: Vec<GraphError>,
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// Begins an empty frame.
    pub fn new() -> Self {
        Self {
            id: NEXT_GRAPH.fetch_add(1, Ordering::Relaxed),
            resources: Vec::new(),
            passes: Vec::new(),
            errors: Vec::new(),
        }
    }

    fn add(
        &mut self,
        name: &str,
        role: BufferRole,
        kind: ResourceKind,
        import: Option<Import>,
    ) -> ResourceId {
        let bad = match &kind {
            ResourceKind::Image(info) if info.width == 0 || info.height == 0 => {
                Some(("extent", format!("{}x{}", info.width, info.height), "at least 1x1"))
            }
            ResourceKind::Image(info) if info.layers == 0 || info.mips == 0 => {
                Some(("layers and mips", format!("{} and {}", info.layers, info.mips), "at least 1 of each"))
            }
            ResourceKind::Image(info) if !info.samples.is_power_of_two() || info.samples > 64 => {
                Some(("samples", info.samples.to_string(), "a power of two from 1 to 64"))
            }
            ResourceKind::Image(info) if info.format == vk::Format::UNDEFINED => {
                Some(("format", "UNDEFINED".to_owned(), "a format"))
            }
            _ => None,
        };
        if let Some((what, found, expected)) = bad {
            let expected = expected.to_owned();
            self.errors.push(GraphError::BadResource { name: name.to_owned(), what, found, expected });
        }
        if self.resources.iter().any(|other| other.name == name) {
            self.errors.push(GraphError::DuplicateName { name: name.to_owned() });
        }
        let id = ResourceId(u32::try_from(self.resources.len()).unwrap_or(u32::MAX));
        self.resources.push(ResourceNode {
            name: name.to_owned(),
            role,
            kind,
            import,
            kept: false,
            output: false,
        });
        id
    }

    /// Declares a transient image; its memory may be shared with resources that live at other times.
    pub fn image(&mut self, name: &str, role: BufferRole, info: ImageInfo) -> ImageHandle {
        let resource = self.add(name, role, ResourceKind::Image(info), None);
        ImageHandle { graph: self.id, resource, info }
    }

    /// Declares a transient buffer of `bytes` bytes; its memory may be shared with resources that live at other times.
    pub fn buffer(&mut self, name: &str, role: BufferRole, bytes: u64) -> BufferHandle {
        let resource = self.add(name, role, ResourceKind::Buffer { bytes }, None);
        BufferHandle { graph: self.id, resource, bytes }
    }

    /// Brings in a buffer that lives outside the graph; passes that write it always run.
    pub fn import_buffer(&mut self, name: &str, role: BufferRole, buffer: &gpu::Buffer) -> BufferHandle {
        let bytes = buffer.bytes();
        let resource =
            self.add(name, role, ResourceKind::Buffer { bytes }, Some(Import::Buffer(buffer.clone())));
        BufferHandle { graph: self.id, resource, bytes }
    }

    /// Brings in an image that lives outside the graph and is in `layout` before each frame; the frame leaves it in that
    /// layout again (with `UNDEFINED` its contents are dropped before, and its layout after is that of its last use).
    pub fn import_image(
        &mut self,
        name: &str,
        role: BufferRole,
        image: &gpu::Image,
        layout: vk::ImageLayout,
    ) -> ImageHandle {
        let [width, height] = image.extent();
        let info = ImageInfo {
            format: image.format(),
            width,
            height,
            layers: image.layers(),
            mips: image.mips(),
            samples: image.samples(),
        };
        let import = Import::Image { image: image.clone(), layout };
        let resource = self.add(name, role, ResourceKind::Image(info), Some(import));
        ImageHandle { graph: self.id, resource, info }
    }

    /// Imports an image that no device backs, for plans in tests.
    #[cfg(test)]
    pub(crate) fn import_fake(
        &mut self,
        name: &str,
        role: BufferRole,
        info: ImageInfo,
        layout: vk::ImageLayout,
    ) -> ImageHandle {
        let resource = self.add(name, role, ResourceKind::Image(info), Some(Import::Fake { layout }));
        ImageHandle { graph: self.id, resource, info }
    }

    fn own(&mut self, place: &str, handle: &impl Handle) -> Option<ResourceId> {
        let (graph, resource) = handle.parts();
        if graph == self.id {
            return Some(resource);
        }
        let found = format!("#{}", resource.0);
        self.errors.push(GraphError::ForeignHandle { pass: place.to_owned(), found });
        None
    }

    /// Keeps a resource's contents to the end of the frame: it can be read back, and the passes that make it run.
    pub fn keep(&mut self, handle: &impl Handle) -> ResourceId {
        if let Some(id) = self.own("keep", handle) {
            self.resources[id.0 as usize].kept = true;
        }
        handle.parts().1
    }

    /// Marks a resource as the final colour target: the technique's bytes leave it out.
    pub fn mark_output(&mut self, handle: &impl Handle) {
        if let Some(id) = self.own("mark_output", handle) {
            self.resources[id.0 as usize].output = true;
        }
    }

    fn pass(&mut self, name: &str, role: PassRole, kind: PassKind) -> usize {
        self.passes.push(PassNode {
            name: name.to_owned(),
            role,
            kind,
            slots: Vec::new(),
            texture_set: None,
            has_effect: false,
        });
        self.passes.len() - 1
    }

    /// Begins a raster pass.
    pub fn raster(&mut self, name: &str, role: PassRole) -> RasterPass<'_> {
        let pass = self.pass(name, role, PassKind::Raster(RasterNode::default()));
        RasterPass { graph: self, pass }
    }

    /// Begins a compute pass with one shader.
    pub fn compute(&mut self, name: &str, role: PassRole, shader: &Shader) -> ComputePass<'_> {
        let node = ComputeNode {
            shader: shader.clone(),
            constants: Vec::new(),
            push: Vec::new(),
            dispatches: Vec::new(),
        };
        let pass = self.pass(name, role, PassKind::Compute(Box::new(node)));
        ComputePass { graph: self, pass }
    }

    fn transfer(&mut self, name: &str, role: PassRole, handles: &[&dyn HandleDyn], node: TransferNode) {
        for handle in handles {
            let (graph, resource) = handle.parts_dyn();
            if graph != self.id {
                let found = format!("#{}", resource.0);
                self.errors.push(GraphError::ForeignHandle { pass: name.to_owned(), found });
                return;
            }
        }
        self.pass(name, role, PassKind::Transfer(node));
    }

    /// Fills a buffer with a 32-bit word; its size is rounded down to whole words.
    pub fn clear_buffer(
        &mut self,
        name: &str,
        role: PassRole,
        buffer: BufferHandle,
        value: u32,
    ) -> BufferHandle {
        self.transfer(name, role, &[&buffer], TransferNode::FillBuffer { buffer: buffer.resource, value });
        buffer
    }

    /// Clears a colour image, every level and layer.
    pub fn clear_image(
        &mut self,
        name: &str,
        role: PassRole,
        image: ImageHandle,
        color: [f32; 4],
    ) -> ImageHandle {
        self.clear_image_range(name, role, image, Subresource::ALL, color)
    }

    /// Clears levels and layers of a colour image.
    pub fn clear_image_range(
        &mut self,
        name: &str,
        role: PassRole,
        image: ImageHandle,
        range: Subresource,
        color: [f32; 4],
    ) -> ImageHandle {
        let node = TransferNode::ClearImage { image: image.resource, color, range };
        self.transfer(name, role, &[&image], node);
        image
    }

    /// Copies the start of one buffer to the start of another: as many bytes as both have.
    pub fn copy_buffer(
        &mut self,
        name: &str,
        role: PassRole,
        src: &BufferHandle,
        dst: BufferHandle,
    ) -> BufferHandle {
        let bytes = src.bytes.min(dst.bytes);
        let node = TransferNode::CopyBuffer { src: src.resource, dst: dst.resource, bytes };
        self.transfer(name, role, &[src, &dst], node);
        dst
    }

    /// Copies an image to one of the same extents and a compatible format.
    pub fn copy_image(
        &mut self,
        name: &str,
        role: PassRole,
        src: &ImageHandle,
        dst: ImageHandle,
    ) -> ImageHandle {
        let same = |a: ImageInfo, b: ImageInfo| {
            (a.width, a.height, a.layers, a.mips, a.samples)
                == (b.width, b.height, b.layers, b.mips, b.samples)
        };
        if !same(src.info, dst.info) {
            self.errors.push(GraphError::Attachment {
                pass: name.to_owned(),
                what: "extents of the copy's destination",
                found: format!("{:?}", dst.info),
                expected: format!("{:?}", src.info),
            });
        }
        let node = TransferNode::CopyImage { src: src.resource, dst: dst.resource };
        self.transfer(name, role, &[src, &dst], node);
        dst
    }

    /// Copies one mip level (of all layers in the range) of an image, tightly packed, to the start of a buffer.
    pub fn copy_image_to_buffer(
        &mut self,
        name: &str,
        role: PassRole,
        src: &ImageHandle,
        range: Subresource,
        dst: BufferHandle,
    ) -> BufferHandle {
        let node = TransferNode::CopyImageToBuffer { src: src.resource, range, dst: dst.resource };
        self.transfer(name, role, &[src, &dst], node);
        dst
    }
}

/// [`Handle`] behind a reference of unknown kind.
trait HandleDyn {
    fn parts_dyn(&self) -> (u64, ResourceId);
}

impl<T: Handle> HandleDyn for T {
    fn parts_dyn(&self) -> (u64, ResourceId) {
        self.parts()
    }
}

/// The slots of a pass: what draws and dispatches of it see in set 0, by the shader's names.
macro_rules! slots {
    () => {
        fn bind(
            &mut self,
            slot: &str,
            intent: Intent,
            handle: &impl Handle,
            range: Subresource,
            sampler: Option<gpu::SamplerDesc>,
        ) {
            let name = self.graph.passes[self.pass].name.clone();
            if let Some(resource) = self.graph.own(&name, handle) {
                self.graph.bind_slot(
                    self.pass,
                    SlotNode { slot: slot.to_owned(), intent, resource: Some(resource), range, sampler },
                );
            }
        }

        /// Binds a resource that the shaders read: uniform or storage buffer, sampled or storage image, as the shader
        /// declares the slot. A combined image sampler gets a nearest, clamping sampler; it suits `texelFetch`.
        pub fn read(&mut self, slot: &str, handle: &impl Handle) -> &mut Self {
            self.bind(slot, Intent::Read, handle, Subresource::ALL, None);
            self
        }

        /// Binds levels and layers of an image that the shaders read.
        pub fn read_range(&mut self, slot: &str, image: &ImageHandle, range: Subresource) -> &mut Self {
            self.bind(slot, Intent::Read, image, range, None);
            self
        }

        /// Binds an image with its sampler.
        pub fn read_sampled(
            &mut self,
            slot: &str,
            image: &ImageHandle,
            sampler: gpu::SamplerDesc,
        ) -> &mut Self {
            self.bind(slot, Intent::Read, image, Subresource::ALL, Some(sampler));
            self
        }

        /// Binds levels and layers of an image with a sampler.
        pub fn read_sampled_range(
            &mut self,
            slot: &str,
            image: &ImageHandle,
            range: Subresource,
            sampler: gpu::SamplerDesc,
        ) -> &mut Self {
            self.bind(slot, Intent::Read, image, range, Some(sampler));
            self
        }

        /// Binds a sampler alone.
        pub fn sampler(&mut self, slot: &str, sampler: gpu::SamplerDesc) -> &mut Self {
            let node = SlotNode {
                slot: slot.to_owned(),
                intent: Intent::Read,
                resource: None,
                range: Subresource::ALL,
                sampler: Some(sampler),
            };
            self.graph.bind_slot(self.pass, node);
            self
        }

        /// Binds a storage buffer or image that the shaders write (and may read), and returns its next version.
        pub fn write<H: Handle>(&mut self, slot: &str, handle: H) -> H {
            self.bind(slot, Intent::Write, &handle, Subresource::ALL, None);
            handle
        }

        /// Binds levels and layers of a storage image that the shaders write, and returns the image's next version.
        pub fn write_range(&mut self, slot: &str, image: ImageHandle, range: Subresource) -> ImageHandle {
            self.bind(slot, Intent::Write, &image, range, None);
            image
        }

        /// Binds a long-lived descriptor set (the scene's textures) as set 1.
        pub fn texture_set(&mut self, set: &gpu::DescriptorSet) -> &mut Self {
            self.graph.passes[self.pass].texture_set = Some(set.clone());
            self
        }

        /// Lets the pass run even if nothing uses what it writes.
        pub fn has_effect(&mut self) -> &mut Self {
            self.graph.passes[self.pass].has_effect = true;
            self
        }

        /// Ends the declaration of the pass; dropping it does the same.
        pub fn finish(self) {}
    };
}

impl Graph {
    fn bind_slot(&mut self, pass: usize, node: SlotNode) {
        let pass = &mut self.passes[pass];
        if let Some(first) = pass.slots.iter().find(|other| other.slot == node.slot) {
            let name_of = |id: Option<ResourceId>| match id {
                Some(id) => self.resources[id.0 as usize].name.clone(),
                None => "a sampler".to_owned(),
            };
            self.errors.push(GraphError::DoublyBound {
                pass: pass.name.clone(),
                slot: node.slot,
                first: name_of(first.resource),
                second: name_of(node.resource),
            });
            return;
        }
        pass.slots.push(node);
    }
}

/// A raster pass under declaration. Viewport and default scissor are the attachments' extent, unless
/// [`RasterPass::viewport`] sets another viewport.
pub struct RasterPass<'g> {
    graph: &'g mut Graph,
    pass: usize,
}

impl RasterPass<'_> {
    slots!();

    fn node(&mut self) -> &mut RasterNode {
        match &mut self.graph.passes[self.pass].kind {
            PassKind::Raster(node) => node,
            _ => unreachable!("a raster builder holds a raster pass"),
        }
    }

    fn name(&self) -> String {
        self.graph.passes[self.pass].name.clone()
    }

    fn add_color(&mut self, image: ImageHandle, range: Subresource, load: ColorLoad) -> ImageHandle {
        let name = self.name();
        if let Some(resource) = self.graph.own(&name, &image) {
            self.node().colors.push(ColorNode { resource, range, load, resolve: None });
        }
        image
    }

    /// Adds a colour attachment; the order of the calls gives the locations. Returns its next version.
    pub fn color(&mut self, image: ImageHandle, load: Load<[f32; 4]>) -> ImageHandle {
        self.add_color(image, Subresource::mip(0), ColorLoad::Float(load))
    }

    /// Adds an unsigned integer colour attachment.
    pub fn color_uint(&mut self, image: ImageHandle, load: Load<[u32; 4]>) -> ImageHandle {
        self.add_color(image, Subresource::mip(0), ColorLoad::Uint(load))
    }

    /// Adds one level and layer of an image as a colour attachment.
    pub fn color_range(
        &mut self,
        image: ImageHandle,
        range: Subresource,
        load: Load<[f32; 4]>,
    ) -> ImageHandle {
        self.add_color(image, range, ColorLoad::Float(load))
    }

    /// Averages the samples of the colour attachment added last into `target` when the pass ends.
    pub fn resolve(&mut self, target: ImageHandle) -> ImageHandle {
        let name = self.name();
        if let Some(resource) = self.graph.own(&name, &target) {
            match self.node().colors.last_mut() {
                Some(color) => color.resolve = Some((resource, Subresource::mip(0))),
                None => self.graph.errors.push(GraphError::Attachment {
                    pass: name,
                    what: "resolve target",
                    found: "no colour attachment before it".to_owned(),
                    expected: "a colour attachment to resolve".to_owned(),
                }),
            }
        }
        target
    }

    fn set_depth(&mut self, image: &ImageHandle, depth: Option<Load<f32>>, stencil: Option<Load<u32>>) {
        let name = self.name();
        let Some(resource) = self.graph.own(&name, image) else { return };
        if self.node().depth.is_some() {
            self.graph.errors.push(GraphError::Attachment {
                pass: name,
                what: "depth attachments",
                found: "2".to_owned(),
                expected: "at most 1".to_owned(),
            });
            return;
        }
        self.node().depth = Some(DepthNode { resource, range: Subresource::mip(0), depth, stencil });
    }

    /// Adds the depth attachment, tested and written. The stencil of a depth-stencil image is kept where depth is kept,
    /// undefined otherwise; see [`RasterPass::stencil_clear`]. Returns its next version.
    pub fn depth(&mut self, image: ImageHandle, load: Load<f32>) -> ImageHandle {
        let stencil = match load {
            Load::Keep => Load::Keep,
            _ => Load::DontCare,
        };
        self.set_depth(&image, Some(load), Some(stencil));
        image
    }

    /// Adds one level and layer of a depth image as the depth attachment, tested and written.
    pub fn depth_range(&mut self, image: ImageHandle, range: Subresource, load: Load<f32>) -> ImageHandle {
        let image = self.depth(image, load);
        if let Some(depth) = &mut self.node().depth {
            depth.range = range;
        }
        image
    }

    /// Adds the depth attachment, tested and not written; shaders of the pass may sample it as well.
    pub fn depth_read_only(&mut self, image: &ImageHandle) -> &mut Self {
        self.set_depth(image, None, None);
        self
    }

    /// Adds a depth-stencil attachment whose depth is tested and whose stencil is tested and written; shaders of the pass
    /// may sample its depth (bind it before this call). Returns its next version.
    pub fn stencil(&mut self, image: ImageHandle, load: Load<u32>) -> ImageHandle {
        self.set_depth(&image, None, Some(load));
        image
    }

    /// Clears the stencil of the depth-stencil attachment when the pass begins.
    pub fn stencil_clear(&mut self, value: u32) -> &mut Self {
        let name = self.name();
        match &mut self.node().depth {
            Some(depth) if depth.stencil.is_some() => depth.stencil = Some(Load::Clear(value)),
            _ => self.graph.errors.push(GraphError::Attachment {
                pass: name,
                what: "stencil clear",
                found: "no stencil that the pass writes".to_owned(),
                expected: "a call of depth or stencil before".to_owned(),
            }),
        }
        self
    }

    /// Sets the extent in pixels of a pass without attachments.
    pub fn extent(&mut self, width_px: u32, height_px: u32) -> &mut Self {
        self.node().extent = Some((width_px, height_px));
        self
    }

    /// Sets the viewport, pixels: x, y, width, height. It may reach beyond the attachments, which then hold a part of the view.
    pub fn viewport(&mut self, rect_px: [f32; 4]) -> &mut Self {
        self.node().viewport = Some(rect_px);
        self
    }

    /// Clears the stencil between draws, everywhere or in a rectangle.
    pub fn clear_stencil(&mut self, value: u32, rect: Option<Rect>) -> &mut Self {
        self.node().commands.push(RasterCommand::ClearStencil { value, rect });
        self
    }

    /// Adds a draw.
    pub fn draw(&mut self, draw: Draw<'_>) -> &mut Self {
        let name = self.name();
        let mut foreign = false;
        let mut own = |graph: &mut Graph, handle: &BufferHandle| {
            graph.own(&name, handle).unwrap_or_else(|| {
                foreign = true;
                handle.resource
            })
        };
        let graph = &mut *self.graph;
        let vertex_buffers = draw.vertex_buffers.iter().map(|buffer| own(graph, buffer)).collect();
        let index_buffer = draw.index_buffer.map(|(buffer, index_type)| (own(graph, buffer), index_type));
        let call = match draw.call {
            DrawCall::Direct { vertices, instances, first_vertex, first_instance } => {
                CallNode::Direct { vertices, instances, first_vertex, first_instance }
            }
            DrawCall::Indexed { indices, instances, first_index, vertex_offset, first_instance } => {
                CallNode::Indexed { indices, instances, first_index, vertex_offset, first_instance }
            }
            DrawCall::Indirect { buffer, offset, count, stride } => {
                CallNode::Indirect { buffer: own(graph, buffer), offset, count, stride }
            }
            DrawCall::IndexedIndirect { buffer, offset, count, stride } => {
                CallNode::IndexedIndirect { buffer: own(graph, buffer), offset, count, stride }
            }
            DrawCall::IndexedIndirectCount { buffer, offset, count_buffer, count_offset, max, stride } => {
                CallNode::IndexedIndirectCount {
                    buffer: own(graph, buffer),
                    offset,
                    count_buffer: own(graph, count_buffer),
                    count_offset,
                    max,
                    stride,
                }
            }
        };
        if foreign {
            return self;
        }
        let node = DrawNode {
            state: draw.pipeline,
            push: draw.push,
            vertex_buffers,
            index_buffer,
            call,
            scissor: draw.scissor,
            stencil_reference: draw.stencil_reference,
        };
        self.node().commands.push(RasterCommand::Draw(Box::new(node)));
        self
    }
}

/// A compute pass under declaration.
pub struct ComputePass<'g> {
    graph: &'g mut Graph,
    pass: usize,
}

impl ComputePass<'_> {
    slots!();

    fn node(&mut self) -> &mut ComputeNode {
        match &mut self.graph.passes[self.pass].kind {
            PassKind::Compute(node) => node,
            _ => unreachable!("a compute builder holds a compute pass"),
        }
    }

    /// Sets a specialization constant by name: a `u32`, `i32`, `f32` or `bool`.
    pub fn constant(&mut self, name: &str, value: impl ConstantBits) -> &mut Self {
        self.node().constants.push((name.to_owned(), value.bits()));
        self
    }

    /// Sets the push constants of the dispatches that follow.
    pub fn push<T: bytemuck::NoUninit>(&mut self, value: &T) -> &mut Self {
        self.node().push = bytemuck::bytes_of(value).to_vec();
        self
    }

    /// Runs `groups` workgroups. Dispatches of one pass are not ordered among each other.
    pub fn dispatch(&mut self, groups: [u32; 3]) -> &mut Self {
        let node = self.node();
        node.dispatches.push(DispatchNode { push: node.push.clone(), call: DispatchCall::Direct(groups) });
        self
    }

    /// Runs as many workgroups as three `u32` at `offset` bytes in `buffer` say.
    pub fn dispatch_indirect(&mut self, buffer: &BufferHandle, offset: u64) -> &mut Self {
        let name = self.graph.passes[self.pass].name.clone();
        if let Some(buffer) = self.graph.own(&name, buffer) {
            let node = self.node();
            let call = DispatchCall::Indirect { buffer, offset };
            node.dispatches.push(DispatchNode { push: node.push.clone(), call });
        }
        self
    }
}
