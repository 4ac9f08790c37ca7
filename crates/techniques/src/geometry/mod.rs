//! The stage that rasterises the scene's surfaces: one vertex path, two fragment shaders (opaque and alpha-masked).
//!
//! Draws stand in eight buckets by what differs in state: alpha mask, double-sided, mirrored. Each bucket is one indirect
//! call over the draws in view. Masked surfaces have pipelines of their own, since `discard` keeps early depth tests from
//! opaque ones.

use afterlight_graph::{
    Blend, DepthTest, Draw, DrawCall, RasterPass, RasterState, Rect, StencilTest, gpu::vk,
};
use afterlight_graph::{VertexAttribute, VertexLayout, VertexStream};
use afterlight_shader::Shader;

use crate::{
    draw_list::COMMAND_BYTES,
    error::TechniqueError,
    frame::Frame,
    scene_gpu::{BUCKETS, Bucket},
};

/// Shaders of one kind of surface.
pub struct SurfaceShaders {
    /// Vertex shader, a variant of `geometry/surface.vert`.
    pub vertex: Shader,
    /// Fragment shader; `None` writes depth alone.
    pub fragment: Option<Shader>,
}

/// How the scene is drawn in a pass.
pub struct Surfaces {
    /// For opaque surfaces.
    pub opaque: SurfaceShaders,
    /// For alpha-masked surfaces.
    pub masked: SurfaceShaders,
    /// Depth test.
    pub depth: DepthTest,
    /// Stencil test.
    pub stencil: Option<StencilTest>,
    /// Stencil test of masked surfaces where it is another; `None` is the same.
    pub masked_stencil: Option<StencilTest>,
    /// Stencil reference.
    pub stencil_reference: u32,
    /// Blending of each colour attachment; empty replaces.
    pub blend: Vec<Blend>,
    /// Specialization constants besides the scene's, for the fragment shader.
    pub constants: Vec<(String, u32)>,
    /// Push constants of the fragment shader; empty where it has none.
    pub push: Vec<u8>,
    /// Scissor; `None` is the whole image.
    pub scissor: Option<Rect>,
}

impl Surfaces {
    /// The full vertex path with a fragment shader `name` and its `name#mask` variant, nearest surface kept.
    ///
    /// # Errors
    /// A name that is not compiled in.
    pub fn shaded(frame: &Frame<'_>, opaque: &str, masked: &str) -> Result<Self, TechniqueError> {
        Self::new(frame, ("geometry/surface.vert", Some(opaque)), ("geometry/surface.vert", masked))
    }

    /// Depth alone: no fragment shader for opaque surfaces, the alpha test for masked ones.
    ///
    /// # Errors
    /// A name that is not compiled in.
    pub fn depth_only(frame: &Frame<'_>) -> Result<Self, TechniqueError> {
        Self::new(
            frame,
            ("geometry/surface.vert#position", None),
            ("geometry/surface.vert#uv", "geometry/alpha.frag"),
        )
    }

    /// Vertex and fragment shaders by name, for opaque and for masked surfaces.
    ///
    /// # Errors
    /// A name that is not compiled in.
    pub fn new(
        frame: &Frame<'_>,
        opaque: (&str, Option<&str>),
        masked: (&str, &str),
    ) -> Result<Self, TechniqueError> {
        Ok(Self {
            opaque: SurfaceShaders {
                vertex: frame.shader(opaque.0)?,
                fragment: opaque.1.map(|name| frame.shader(name)).transpose()?,
            },
            masked: SurfaceShaders {
                vertex: frame.shader(masked.0)?,
                fragment: Some(frame.shader(masked.1)?),
            },
            depth: DepthTest::NEAREST,
            stencil: None,
            masked_stencil: None,
            stencil_reference: 0,
            blend: Vec::new(),
            constants: Vec::new(),
            push: Vec::new(),
            scissor: None,
        })
    }

    /// With another depth test.
    pub fn depth(mut self, depth: DepthTest) -> Self {
        self.depth = depth;
        self
    }

    /// With a stencil test.
    pub fn stencil(mut self, test: StencilTest, reference: u32) -> Self {
        (self.stencil, self.stencil_reference) = (Some(test), reference);
        self
    }

    /// With blending.
    pub fn blend(mut self, blend: Vec<Blend>) -> Self {
        self.blend = blend;
        self
    }

    /// Adds the draws in view to a pass, opaque surfaces first. Resources are bound by [`Frame::bind_scene`].
    pub fn draw(&self, frame: &Frame<'_>, pass: &mut RasterPass<'_>) {
        for bucket in (0..BUCKETS).map(Bucket) {
            let first = frame.scene.bucket_first[bucket.0];
            let max = frame.scene.bucket_first[bucket.0 + 1] - first;
            if max == 0 {
                continue;
            }
            let call = DrawCall::IndexedIndirectCount {
                buffer: &frame.buffers.commands,
                offset: COMMAND_BYTES * u64::from(first),
                count_buffer: &frame.buffers.command_counts,
                count_offset: 4 * bucket.0 as u64,
                max,
                stride: COMMAND_BYTES as u32,
            };
            pass.draw(self.bucket_draw(frame, bucket, call));
        }
    }

    /// A draw of surfaces of one bucket by any call whose first instances are draw numbers.
    pub(crate) fn bucket_draw<'a>(
        &self,
        frame: &'a Frame<'_>,
        bucket: Bucket,
        call: DrawCall<'a>,
    ) -> Draw<'a> {
        let shaders = if bucket.masked() { &self.masked } else { &self.opaque };
        let mut state = RasterState::new(&shaders.vertex, shaders.fragment.as_ref());
        let all: Vec<&Shader> = std::iter::once(&shaders.vertex).chain(&shaders.fragment).collect();
        state.constants = frame.constants(&all);
        state.constants.extend(self.constants.iter().cloned());
        state.depth = self.depth;
        state.stencil = if bucket.masked() { self.masked_stencil.or(self.stencil) } else { self.stencil };
        state.blend = self.blend.clone();
        state.layout = vertex_layout();
        state.cull = if bucket.double_sided() { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK };
        state.front_face =
            if bucket.mirrored() { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE };
        let mut draw = Draw::new(state, call)
            .stencil_reference(self.stencil_reference)
            .vertex_buffer(&frame.buffers.positions)
            .vertex_buffer(&frame.buffers.attributes)
            .vertex_buffer(&frame.buffers.draws)
            .index_buffer(&frame.buffers.indices, vk::IndexType::UINT32);
        draw.push = self.push.clone();
        draw.scissor = self.scissor;
        draw
    }
}

/// Positions, attributes, and one `DrawData` an instance.
fn vertex_layout() -> VertexLayout {
    let stream = |stride_bytes, per_instance| VertexStream { stride_bytes, per_instance };
    let attribute =
        |location, stream, format, offset_bytes| VertexAttribute { location, stream, format, offset_bytes };
    VertexLayout {
        streams: vec![stream(12, false), stream(28, false), stream(64, true)],
        attributes: vec![
            attribute(0, 0, vk::Format::R32G32B32_SFLOAT, 0),
            attribute(1, 1, vk::Format::R32G32B32A32_UINT, 0),
            attribute(2, 1, vk::Format::R32G32B32_UINT, 16),
            attribute(4, 2, vk::Format::R32G32B32A32_SFLOAT, 0),
            attribute(5, 2, vk::Format::R32G32B32A32_SFLOAT, 16),
            attribute(6, 2, vk::Format::R32G32B32A32_SFLOAT, 32),
            attribute(7, 2, vk::Format::R32G32B32A32_UINT, 48),
        ],
    }
}
