//! Shades whatever a technique's source of surfaces holds of a pixel, by any light step, and averages it.
//!
//! A source is a GLSL header of the technique with the functions that `shade.glsl` names; the technique's `variants.txt` lists which variants
//! of the templates `shade.comp`, `shade.frag` and `volume.frag` there are of it.

use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, Load, PassRole, RasterPass, gpu::vk};

use crate::lights::{
    cells,
    step::{LightMethod, LightStep},
    volumes,
};
use afterlight_frame::{Frame, Slots, SourceSlots, TechniqueError, set_constants, views};

/// Views of techniques that end in [`shade`].
pub const VIEWS: &[&str] = &[views::SAMPLE_USAGE, views::INVOCATIONS, views::EDGES, views::WEIGHTS];

/// Specialization constants of shaders that include `surfaces/shade/shade.glsl`.
pub fn shade_constants(frame: &Frame<'_>, samples: u32) -> [(&'static str, u32); 2] {
    [("SAMPLES", samples), ("VIEW", views::number(frame.view))]
}

/// A technique's own source of surfaces: the variants of templates that its `variants.txt` lists.
#[derive(Clone, Copy)]
pub struct SurfaceSource<'a> {
    /// Folder of the technique that lists them.
    pub folder: &'a str,
    /// Tag of the variants; empty for the plain ones.
    pub tag: &'a str,
    /// What the variant of `shade.comp` has besides: emission, or how it shares indirect light.
    pub shading_tag: Option<&'a str>,
    /// Specialization constants that this variant has besides.
    pub shading_constants: &'a [(&'a str, u32)],
    /// Samples a pixel.
    pub samples: u32,
}

impl SurfaceSource<'_> {
    /// Name of its variant of a template: `dais/volume.frag#refs-one`.
    pub fn shader(&self, template: &str) -> String {
        named(self.folder, template, &[self.tag])
    }

    /// Name of its variant of `shade.comp`.
    fn shading_shader(&self) -> String {
        named(self.folder, "shade.comp", &[self.tag, self.shading_tag.unwrap_or("")])
    }
}

/// Name of a variant; empty tags are none.
fn named(folder: &str, template: &str, tags: &[&str]) -> String {
    let tags: Vec<&str> = tags.iter().copied().filter(|tag| !tag.is_empty()).collect();
    let separator = if tags.is_empty() { "" } else { "#" };
    format!("{folder}/{template}{separator}{}", tags.join("-"))
}

/// Declares the pass `technique/shade`: shades every surface that `source` holds of a pixel by the lights that it finds by `lights`
/// and averages them; `surfaces` are where they stand, `bind` binds what the source reads. Returns radiance,
/// RGBA16F.
///
/// # Errors
/// As [`LightStep::build`].
pub fn shade(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (technique, lights): (&str, LightMethod),
    source: SurfaceSource<'_>,
    surfaces: &cells::VisibleDepths<'_>,
    bind: &dyn Fn(&mut dyn SourceSlots),
) -> Result<ImageHandle, TechniqueError> {
    let samples = source.samples;
    let step = LightStep::build(graph, frame, technique, lights, surfaces)?;
    let shader = frame.shader(&source.shading_shader())?;
    let radiance = graph.image(
        &format!("{technique}/radiance"),
        BufferRole::Targets,
        frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
    );
    let mut pass = frame.compute(graph, &format!("{technique}/shade"), PassRole::Shading, &shader);
    set_constants(&mut pass, shade_constants(frame, samples));
    set_constants(&mut pass, step.constants());
    set_constants(&mut pass, source.shading_constants.iter().copied());
    bind(&mut pass);
    step.bind(frame, &mut pass);
    let radiance = pass.write("hdr", radiance);
    pass.dispatch(frame.groups(shader.reflection.local_size[0]));
    pass.finish();
    match step {
        LightStep::None => {
            let fragment = source.shader("volume.frag");
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
pub fn add_volumes(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (technique, fragment): (&str, &str),
    radiance: ImageHandle,
    bind: &dyn Fn(&mut dyn SourceSlots),
) -> Result<ImageHandle, TechniqueError> {
    if views::number(frame.view) > 0 {
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
pub fn full_screen(
    frame: &Frame<'_>,
    fragment: &str,
    constants: &[(&str, u32)],
) -> Result<afterlight_graph::RasterState, TechniqueError> {
    let vertex = frame.shader("surfaces/shade/full_screen.vert")?;
    let fragment = frame.shader(fragment)?;
    let mut state = afterlight_graph::RasterState::new(&vertex, Some(&fragment));
    state.constants = frame.constants(&[&vertex, &fragment]);
    state.constants.extend(constants.iter().map(|(name, value)| ((*name).to_owned(), *value)));
    Ok(state)
}

/// Draws a triangle over the whole image.
pub fn draw_full_screen(
    pass: &mut RasterPass<'_>,
    state: afterlight_graph::RasterState,
    stencil_reference: u32,
) {
    let call = afterlight_graph::DrawCall::vertices(3);
    pass.draw(afterlight_graph::Draw::new(state, call).stencil_reference(stencil_reference));
}
