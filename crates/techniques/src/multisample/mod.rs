//! Stages of techniques that shade several samples a pixel after rasterisation: two multisampled G-buffers, and the
//! compute pass that shades what any source of surfaces holds of a pixel and averages it.
//!
//! | G-buffer | bytes a sample with depth | content |
//! | --- | --- | --- |
//! | [`fill_samples`] | 16 | base colour and metalness, normal, roughness, occlusion, an edge mark (Fridvalszky and Tóth 2020, section 3) |
//! | [`fill_dedup`] | 20 | base colour and metalness, normal and roughness, triangle ID, view distance and occlusion (Schied and Dachsbacher 2015, section 5) |
//!
//! Scenes with emissive surfaces take four bytes more.

mod visible;

pub use visible::Visible;

use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, Load, PassRole, RasterPass, gpu::vk};

use crate::{
    Info, clusters,
    error::TechniqueError,
    frame::{Frame, Slots, SourceSlots},
    geometry::Surfaces,
    light_step::LightStep,
    technique::Need,
    view, volumes,
};

/// Positions are reconstructed where the samples stand.
pub const STANDARD_LOCATIONS: Need =
    Need { name: "standard sample locations", test: |features| features.standard_sample_locations };

/// Views of techniques that end in [`shade`].
pub const VIEWS: &[&str] = &[view::SAMPLE_USAGE, view::INVOCATIONS, view::EDGES, view::WEIGHTS];

/// What a pixel without a surface holds in an image of triangle IDs: `NO_TRIANGLE`, all ones.
pub(crate) const NO_TRIANGLE_RGBA8: [f32; 4] = [1.0; 4];

/// A multisampled G-buffer: the depth, and other images with the names of their slots.
pub struct SampleBuffer {
    /// Depth, reversed.
    pub depth: ImageHandle,
    /// Other images by slot.
    pub images: Vec<(&'static str, ImageHandle)>,
}

impl SampleBuffer {
    /// Where its surfaces stand.
    pub fn surfaces(&self, frame: &Frame<'_>) -> clusters::Surfaces<'_> {
        clusters::Surfaces::of_depth(&self.depth, frame.samples)
    }

    /// Binds what a source of surfaces reads.
    pub fn bind(&self, pass: &mut (impl Slots + ?Sized)) {
        pass.read_image("gbuffer_depth", &self.depth);
        for (slot, image) in &self.images {
            pass.read_image(slot, image);
        }
    }
}

/// Name of a shader's variant for the scene: with emission where a surface emits.
pub(crate) fn emission_variant(frame: &Frame<'_>, name: &str) -> String {
    let tag = if name.contains('#') { "-emission" } else { "#emission" };
    if frame.scene.has_emission { format!("{name}{tag}") } else { name.to_owned() }
}

/// Declares the pass `technique/gbuffer` that fills 16 bytes a sample, depth included.
///
/// # Errors
/// A shader that is not compiled in.
pub fn fill_samples(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
) -> Result<SampleBuffer, TechniqueError> {
    let surfaces = Surfaces::new(
        frame,
        ("geometry/surface.vert#centroid", Some(&emission_variant(frame, "multisample/samples.frag"))),
        ("geometry/surface.vert#centroid", &emission_variant(frame, "multisample/samples.frag#mask")),
    )?;
    let images = [
        ("gbuffer_base_color", vk::Format::R8G8B8A8_SRGB, Load::DontCare),
        ("gbuffer_normal", vk::Format::R16G16_UNORM, Load::DontCare),
        // Samples without a surface are no edge.
        ("gbuffer_roughness", vk::Format::R8G8B8A8_UNORM, Load::Clear([0.0; 4])),
    ];
    fill(graph, frame, technique, &surfaces, &images, None)
}

/// Declares the pass `technique/gbuffer` that fills 20 bytes a sample, depth included.
///
/// # Errors
/// A shader that is not compiled in.
pub fn fill_dedup(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &'static str,
) -> Result<SampleBuffer, TechniqueError> {
    let numbered = frame.tessellate_px.is_some();
    let [opaque, masked] = match numbered {
        false => ["multisample/dedup.frag", "multisample/dedup.frag#mask"],
        true => ["multisample/dedup.frag#numbered", "multisample/dedup.frag#mask-numbered"],
    };
    let mut surfaces =
        Surfaces::shaded(frame, &emission_variant(frame, opaque), &emission_variant(frame, masked))?;
    let mut count = None;
    if numbered {
        surfaces = surfaces.numbered(frame, technique)?;
        let buffer = graph.buffer(&format!("{technique}/triangle numbers"), BufferRole::Counters, 4);
        count = Some(graph.clear_buffer(
            &format!("{technique}/clear triangle numbers"),
            PassRole::Geometry,
            buffer,
            0,
        ));
    }
    let images = [
        ("gbuffer_base_color", vk::Format::R8G8B8A8_SRGB, Load::DontCare),
        ("gbuffer_normal", vk::Format::R8G8B8A8_UNORM, Load::DontCare),
        ("ids", vk::Format::R8G8B8A8_UNORM, Load::Clear(NO_TRIANGLE_RGBA8)),
        ("gbuffer_distance", vk::Format::R8G8B8A8_UNORM, Load::DontCare),
    ];
    fill(graph, frame, technique, &surfaces, &images, count)
}

fn fill(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    surfaces: &Surfaces,
    images: &[(&'static str, vk::Format, Load<[f32; 4]>)],
    triangle_count: Option<BufferHandle>,
) -> Result<SampleBuffer, TechniqueError> {
    let mut images = images.to_vec();
    if frame.scene.has_emission {
        images.push(("gbuffer_emission", vk::Format::B10G11R11_UFLOAT_PACK32, Load::DontCare));
    }
    let mut declared = Vec::new();
    for (slot, format, load) in &images {
        let name = format!("{technique}/{}", slot.trim_start_matches("gbuffer_").replace('_', " "));
        let role = if *slot == "ids" { BufferRole::Visibility } else { BufferRole::Surfaces };
        declared.push((*slot, graph.image(&name, role, frame.multisampled_info(*format)), *load));
    }
    let depth = graph.image(
        &format!("{technique}/depth"),
        BufferRole::Depth,
        frame.multisampled_info(vk::Format::D32_SFLOAT),
    );

    let mut pass = graph.raster(&format!("{technique}/gbuffer"), PassRole::Geometry);
    frame.bind_scene(&mut pass);
    if let Some(count) = triangle_count {
        let _count = pass.write("TriangleNumbers", count);
    }
    let images = declared.into_iter().map(|(slot, image, load)| (slot, pass.color(image, load))).collect();
    let depth = pass.depth(depth, Load::Clear(0.0));
    surfaces.draw(frame, &mut pass);
    pass.finish();
    Ok(SampleBuffer { depth, images })
}

/// Specialization constants of shaders that include `multisample/shade.glsl`.
pub(crate) fn shade_constants(frame: &Frame<'_>, samples: u32) -> [(&'static str, u32); 2] {
    [("SAMPLES", samples), ("VIEW", view::number(frame.view))]
}

/// Declares the pass `technique/shade`: shades every surface that `source` (a tag of `multisample/shade.comp`) holds of a
/// pixel of `samples` samples by the lights that its parameter `lights` lets them visit and averages them; `surfaces` are where they stand, `bind` binds what the
/// source reads. Returns radiance, RGBA16F.
///
/// # Errors
/// As [`LightStep::build`].
pub fn shade(
    graph: &mut Graph,
    frame: &Frame<'_>,
    info: &Info,
    (source, samples): (&str, u32),
    surfaces: &clusters::Surfaces<'_>,
    bind: &dyn Fn(&mut dyn SourceSlots),
) -> Result<ImageHandle, TechniqueError> {
    let technique = info.id;
    let step = LightStep::build(graph, frame, info, surfaces)?;
    let name = format!("multisample/shade.comp#{source}");
    // Lists hold emission in their blocks, a triangle buffer has no need to.
    let shader = frame.shader(&if source.starts_with("list") || source.starts_with("dais") {
        name
    } else {
        emission_variant(frame, &name)
    })?;
    let radiance = graph.image(
        &format!("{technique}/radiance"),
        BufferRole::Targets,
        frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
    );
    let mut pass = frame.compute(graph, &format!("{technique}/shade"), PassRole::Shading, &shader);
    for (name, value) in shade_constants(frame, samples) {
        pass.constant(name, value);
    }
    for (name, value) in step.constants() {
        pass.constant(&name, value);
    }
    bind(&mut pass);
    step.bind(frame, &mut pass);
    let radiance = pass.write("hdr", radiance);
    pass.dispatch(frame.groups(shader.reflection.local_size[0]));
    pass.finish();
    match step {
        LightStep::None => {
            // Lights know nothing of what indirect light shares.
            let source = source.trim_end_matches("-grid").trim_end_matches("-quads");
            let fragment = format!("multisample/volume.frag#{source}");
            add_volumes(graph, frame, (technique, &fragment), radiance, &|pass| {
                pass.constant("SAMPLES", samples);
                bind(pass);
            })
        }
        _ => Ok(radiance),
    }
}

/// A raster pass as a source of surfaces is bound to it: constants are those of its draws.
struct VolumePass<'p, 'g> {
    pass: &'p mut RasterPass<'g>,
    constants: Vec<(String, u32)>,
}

impl Slots for VolumePass<'_, '_> {
    fn read_buffer(&mut self, slot: &str, buffer: &BufferHandle) {
        self.pass.read_buffer(slot, buffer);
    }
    fn read_image(&mut self, slot: &str, image: &ImageHandle) {
        self.pass.read_image(slot, image);
    }
    fn textures(&mut self, set: &afterlight_graph::gpu::DescriptorSet) {
        self.pass.textures(set);
    }
}

impl SourceSlots for VolumePass<'_, '_> {
    fn constant(&mut self, name: &str, value: u32) {
        self.constants.push((name.to_owned(), value));
    }
}

/// Declares the pass `technique/lights`: each light's volume adds by `fragment` what it gives the surfaces of a pixel.
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn add_volumes(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (technique, fragment): (&str, &str),
    radiance: ImageHandle,
    bind: &dyn Fn(&mut dyn SourceSlots),
) -> Result<ImageHandle, TechniqueError> {
    if view::number(frame.view) > 0 {
        return Ok(radiance);
    }
    let mut pass = graph.raster(&format!("{technique}/lights"), PassRole::Shading);
    frame.bind_scene(&mut pass);
    let radiance = pass.color(radiance, Load::Keep);
    let mut bound = VolumePass { pass: &mut pass, constants: Vec::new() };
    bind(&mut bound);
    let constants = bound.constants;
    volumes::draw_all_by(frame, &mut pass, fragment, (afterlight_graph::DepthTest::OFF, &constants))?;
    pass.finish();
    Ok(radiance)
}

/// State of a triangle over the whole image with a fragment shader that knows the samples.
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn full_screen(
    frame: &Frame<'_>,
    fragment: &str,
    constants: &[(&str, u32)],
) -> Result<afterlight_graph::RasterState, TechniqueError> {
    let vertex = frame.shader("multisample/full_screen.vert")?;
    let fragment = frame.shader(fragment)?;
    let mut state = afterlight_graph::RasterState::new(&vertex, Some(&fragment));
    state.constants = frame.constants(&[&vertex, &fragment]);
    state.constants.extend(constants.iter().map(|(name, value)| ((*name).to_owned(), *value)));
    Ok(state)
}

/// Draws a triangle over the whole image.
pub(crate) fn draw_full_screen(
    pass: &mut RasterPass<'_>,
    state: afterlight_graph::RasterState,
    stencil_reference: u32,
) {
    let call = afterlight_graph::DrawCall::vertices(3);
    pass.draw(afterlight_graph::Draw::new(state, call).stencil_reference(stencil_reference));
}
