//! State of a raster pipeline.

use afterlight_gpu::vk;
use afterlight_shader::Shader;

use super::constants::ConstantBits;
use super::fixed_function::{Blend, DepthTest, StencilTest};
use super::vertex::VertexLayout;

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
