//! The stage that rasterises the scene's surfaces: one vertex path, two fragment shaders (opaque and alpha-masked).
//!
//! Draws stand in eight buckets by what differs in state: alpha mask, double-sided, mirrored. Each bucket is one indirect
//! call over the draws in view. Masked surfaces have pipelines of their own, since `discard` keeps early depth tests from
//! opaque ones.

use std::ops::Range;

use afterlight_graph::{
    Blend, BufferHandle, DepthTest, Draw, DrawCall, Graph, ImageHandle, Load, PassRole, RasterPass,
    RasterState, Rect, StencilTest, gpu::vk,
};
use afterlight_graph::{VertexAttribute, VertexLayout, VertexStream};
use afterlight_shader::Shader;

use afterlight_frame::{
    DrawCommands, Frame, MIN_TESSELLATE_PX, TechniqueError,
    scene::{BUCKETS, Bucket, draw_list::COMMAND_BYTES},
};

/// Shaders of one kind of surface.
pub struct SurfaceShaders {
    /// Vertex shader, a variant of `surfaces/geometry/surface.vert`.
    pub vertex: Shader,
    /// Tessellation control and evaluation shaders, where the frame is tessellated.
    pub tessellation: Option<(Shader, Shader)>,
    /// Geometry shader.
    pub geometry: Option<Shader>,
    /// Fragment shader; `None` writes depth alone.
    pub fragment: Option<Shader>,
}

impl SurfaceShaders {
    /// Shaders by name; where the frame is tessellated, the vertex shader's part is done by the stages of tessellation.
    ///
    /// # Errors
    /// A name that is not compiled in: of a vertex shader that tessellation has no twin of, the twin's.
    pub fn new(frame: &Frame<'_>, vertex: &str, fragment: Option<&str>) -> Result<Self, TechniqueError> {
        let fragment = fragment.map(|name| frame.shader(name)).transpose()?;
        if frame.tessellate_px.is_none() {
            return Ok(Self { vertex: frame.shader(vertex)?, tessellation: None, geometry: None, fragment });
        }
        let evaluation = frame.shader(&vertex.replacen(".vert", ".tese", 1))?;
        let (vertex, control) = match vertex.contains("#velocity") {
            true => ("surface.vert#tessellation-velocity", "surface.tesc#velocity"),
            false => ("surface.vert#tessellation", "surface.tesc"),
        };
        let of_stage = |name: &str| frame.shader(&format!("surfaces/geometry/{name}"));
        Ok(Self {
            vertex: of_stage(vertex)?,
            tessellation: Some((of_stage(control)?, evaluation)),
            geometry: None,
            fragment,
        })
    }
}

/// How the scene is drawn in a pass.
pub struct SceneDraws {
    /// For opaque surfaces.
    pub opaque: SurfaceShaders,
    /// For alpha-masked surfaces.
    pub masked: SurfaceShaders,
    /// Depth test.
    pub depth: DepthTest,
    /// Bias of depth by slope, see [`RasterState::depth_bias_slope`].
    pub depth_bias_slope: f32,
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

impl SceneDraws {
    /// The full vertex path with a fragment shader `name` and its `name#mask` variant, nearest surface kept.
    ///
    /// # Errors
    /// A name that is not compiled in.
    pub fn shaded(frame: &Frame<'_>, opaque: &str, masked: &str) -> Result<Self, TechniqueError> {
        Self::new(
            frame,
            ("surfaces/geometry/surface.vert", Some(opaque)),
            ("surfaces/geometry/surface.vert", masked),
        )
    }

    /// Depth alone: no fragment shader for opaque surfaces, the alpha test for masked ones.
    ///
    /// # Errors
    /// A name that is not compiled in.
    pub fn depth_only(frame: &Frame<'_>) -> Result<Self, TechniqueError> {
        Self::new(
            frame,
            ("surfaces/geometry/surface.vert#position", None),
            ("surfaces/geometry/surface.vert#uv", "surfaces/geometry/alpha.frag"),
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
            opaque: SurfaceShaders::new(frame, opaque.0, opaque.1)?,
            masked: SurfaceShaders::new(frame, masked.0, Some(masked.1))?,
            depth: DepthTest::NEAREST,
            depth_bias_slope: 0.0,
            stencil: None,
            masked_stencil: None,
            stencil_reference: 0,
            blend: Vec::new(),
            constants: Vec::new(),
            push: Vec::new(),
            scissor: None,
        })
    }

    /// Numbers the triangles that tessellation makes in `gl_PrimitiveID`, the full vertex path alone; the counter, zero before
    /// the pass, is to be bound as `TriangleNumbers`.
    ///
    /// # Errors
    /// A device that counts in no geometry shader.
    pub fn numbered(mut self, frame: &Frame<'_>, technique: &'static str) -> Result<Self, TechniqueError> {
        check_numbering(frame, technique)?;
        let shader = frame.shader("surfaces/geometry/number.geom")?;
        (self.opaque.geometry, self.masked.geometry) = (Some(shader.clone()), Some(shader));
        Ok(self)
    }

    /// As [`Self::numbered`], and hands every fragment its whole triangle (`surfaces/geometry/whole_triangle.glsl`).
    ///
    /// # Errors
    /// A device that counts in no geometry shader.
    pub fn whole_triangles(
        mut self,
        frame: &Frame<'_>,
        technique: &'static str,
    ) -> Result<Self, TechniqueError> {
        check_numbering(frame, technique)?;
        let shader = frame.shader("surfaces/geometry/number.geom#whole")?;
        (self.opaque.geometry, self.masked.geometry) = (Some(shader.clone()), Some(shader));
        Ok(self)
    }

    /// Puts a geometry shader into what [`Self::depth_only`] draws that changes nothing, so that a pass with another one and an
    /// equal depth test meets its depths.
    ///
    /// # Errors
    /// A shader that is not compiled in.
    pub fn through_geometry(mut self, frame: &Frame<'_>) -> Result<Self, TechniqueError> {
        self.opaque.geometry = Some(frame.shader("surfaces/geometry/pass.geom#position")?);
        self.masked.geometry = Some(frame.shader("surfaces/geometry/pass.geom#uv")?);
        Ok(self)
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
        let b = &frame.buffers;
        self.draw_buckets(frame, pass, (&b.commands, &b.command_counts), &frame.scene.bucket_first);
    }

    /// Adds the draws that commands of the frame's own list to a pass, as [`Self::draw`].
    pub fn draw_listed(&self, frame: &Frame<'_>, pass: &mut RasterPass<'_>, draws: &DrawCommands) {
        self.draw_buckets(frame, pass, (&draws.commands, &draws.counts), &draws.first);
    }

    fn draw_buckets(
        &self,
        frame: &Frame<'_>,
        pass: &mut RasterPass<'_>,
        (commands, counts): (&BufferHandle, &BufferHandle),
        firsts: &[u32; BUCKETS + 1],
    ) {
        for bucket in (0..BUCKETS).map(Bucket) {
            let first = firsts[bucket.0];
            let max = firsts[bucket.0 + 1] - first;
            if max == 0 {
                continue;
            }
            let call = DrawCall::IndexedIndirectCount {
                buffer: commands,
                offset: COMMAND_BYTES * u64::from(first),
                count_buffer: counts,
                count_offset: 4 * bucket.0 as u64,
                max,
                stride: COMMAND_BYTES as u32,
            };
            pass.draw(self.bucket_draw(frame, bucket, call));
        }
    }

    /// Number of draws that [`Self::draw`] declares: one for each bucket that the scene has.
    pub fn draw_count(&self, frame: &Frame<'_>) -> u32 {
        frame.scene.bucket_first.windows(2).filter(|ends| ends[0] < ends[1]).count() as u32
    }

    /// Adds some of the draws that `commands` has to a pass: a bucket's, by their places in its order. Word `word` of `counts` is their number:
    /// lavapipe (Mesa 22.3) gives an indirect call without a count the count of the call before.
    pub fn draw_some(
        &self,
        frame: &Frame<'_>,
        pass: &mut RasterPass<'_>,
        (bucket, places): (Bucket, &Range<u32>),
        (commands, (counts, word)): (&BufferHandle, (&BufferHandle, usize)),
    ) {
        let first = frame.scene.bucket_first[bucket.0] + places.start;
        let call = DrawCall::IndexedIndirectCount {
            buffer: commands,
            offset: COMMAND_BYTES * u64::from(first),
            count_buffer: counts,
            count_offset: 4 * word as u64,
            max: places.end - places.start,
            stride: COMMAND_BYTES as u32,
        };
        pass.draw(self.bucket_draw(frame, bucket, call));
    }

    /// Declares the pass `name` that clears a depth image, and its stencil where it has one, and draws the surfaces into it: for a
    /// depth pre-pass, or for what its role says.
    pub fn fill_depth(
        &self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        (name, role): (&str, PassRole),
        depth: ImageHandle,
    ) -> ImageHandle {
        let mut pass = graph.raster(name, role);
        frame.bind_scene(&mut pass);
        let depth = pass.depth(depth, Load::Clear(0.0));
        if has_stencil(depth.info().format) {
            pass.stencil_clear(0);
        }
        self.draw(frame, &mut pass);
        pass.finish();
        depth
    }

    /// A draw of surfaces of one bucket by any call whose first instances are draw numbers.
    pub fn bucket_draw<'a>(&self, frame: &'a Frame<'_>, bucket: Bucket, call: DrawCall<'a>) -> Draw<'a> {
        let shaders = if bucket.masked() { &self.masked } else { &self.opaque };
        let mut state = RasterState::new(&shaders.vertex, shaders.fragment.as_ref());
        let all: Vec<&Shader> = std::iter::once(&shaders.vertex).chain(&shaders.fragment).collect();
        state.geometry = shaders.geometry.clone();
        state.constants = frame.constants(&all);
        if let Some((control, evaluation)) = &shaders.tessellation {
            state = state.tessellation(control, evaluation);
            state.constants.extend(tessellation_constants(frame, bucket));
        }
        state.constants.extend(self.constants.iter().cloned());
        state.depth = self.depth;
        state.depth_bias_slope = self.depth_bias_slope;
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

/// Whether a format holds a stencil beside depth.
fn has_stencil(format: vk::Format) -> bool {
    use vk::Format as F;
    matches!(format, F::D16_UNORM_S8_UINT | F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT)
}

/// Checks that the device can number triangles.
fn check_numbering(frame: &Frame<'_>, technique: &'static str) -> Result<(), TechniqueError> {
    let features = frame.features();
    let missing = [
        (features.geometry_shader, "geometry shaders"),
        (features.vertex_stores_and_atomics, "atomics in geometry shaders"),
    ];
    match missing.iter().find(|(there, _)| !there) {
        Some((_, missing)) => Err(TechniqueError::Unavailable { technique, missing: (*missing).to_owned() }),
        None => Ok(()),
    }
}

/// Specialization constants of `surface.tesc` and `surface.tese` for a bucket.
fn tessellation_constants(frame: &Frame<'_>, bucket: Bucket) -> [(String, u32); 3] {
    let facing = match (bucket.double_sided(), bucket.mirrored()) {
        (true, _) => 0,
        (false, false) => 1,
        (false, true) => 2,
    };
    [
        ("TESSELLATE_PX".to_owned(), frame.tessellate_px.unwrap_or(MIN_TESSELLATE_PX).to_bits()),
        ("DISPLACEMENT_M".to_owned(), frame.displacement_m.to_bits()),
        ("FACING".to_owned(), facing),
    ]
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
