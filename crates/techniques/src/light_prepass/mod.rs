//! `light-prepass`: lights gather over depth, normals and roughness; a second pass over the surfaces applies their colours.

// ORDER: 55

pub mod cost;
mod params;

pub use params::{EdgeLight, LightPrepassParams};

use afterlight_graph::{BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Approximation, Condition, Exactness, Frame, Info, OpaqueDepth, Params,
    Source, Technique, TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::volumes,
    surfaces::{RadianceTarget, depth_first::FIRST_FRAGMENT, geometry::SceneDraws},
};

/// The technique.
pub static TECHNIQUE: LightPrepass = LightPrepass;

/// See the module.
pub struct LightPrepass;

static INFO: Info = Info {
    id: "light-prepass",
    title: "Light pre-pass",
    summary: "Lights are gathered over depth, normals and roughness; surfaces are drawn again and apply their colours.",
    sources: &[Source { key: "petrescu-2016", section: "4.5" }, Source { key: "engel-2009", section: "all" }],
    answers: Answers {
        surface: "depth, normal, roughness",
        lights: "light volumes",
        schedule: "fragment shader",
        resolve: "average of the hardware's samples; light is gathered once a pixel",
    },
    appendix_a: AppendixA {
        id: "LPP",
        intersect: "imp",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "seq",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    approximations: &[
        Approximation {
            when: &[Condition::SeveralSamples, Condition::Param("edge-light", "pixel")],
            bound: "surfaces at an edge are lit by the light of the surface at the pixel's centre",
            min_psnr_db: 18.0,
        },
        Approximation {
            when: &[Condition::SeveralSamples],
            bound: "surfaces at an edge are lit by the light of the most similar surface at the centre of a pixel around",
            min_psnr_db: 20.0,
        },
    ],
    departures: &[
        "three sums of light in colour in the place of one, and roughness beside the normal: exact for every material",
        "at several samples surfaces at an edge take the light of the most similar pixel around; the paper's pixel is edge-light=pixel",
        "at several samples the last pass has a depth buffer of its own: the first pass keeps one sample a pixel",
    ],
    samples: ANY_SAMPLES,
    ..Info::USUAL
};

/// What the first pass keeps.
struct LobeBuffer {
    /// World space, octahedral, RG16.
    normal: ImageHandle,
    /// R8, 0 where no light is taken.
    roughness: ImageHandle,
    /// Reversed; at one sample with stencil for [`apply_materials`].
    depth: ImageHandle,
}

/// The parts of light that `lobes()` of `shading.glsl` tells apart, RGBA16F, by the slots of `material.frag`.
pub(crate) const SUMS: [&str; 3] = ["diffuse_light", "specular_light", "grazing_light"];

impl Technique for LightPrepass {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(LightPrepassParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::light_prepass(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = fill(graph, frame)?;
        let surfaces = [&filled.depth, &filled.normal, &filled.roughness];
        let sums = gather_lights(graph, frame, INFO.id, surfaces)?;
        match frame.samples {
            1 => apply_materials(graph, frame, filled.depth, &sums),
            _ => apply_materials_to_samples(graph, frame, &filled, &sums),
        }
    }
}

/// First pass: depth, and what of a surface the lobes of its BRDF need.
fn fill(graph: &mut Graph, frame: &Frame<'_>) -> Result<LobeBuffer, TechniqueError> {
    let normal =
        graph.image("light-prepass/normal", BufferRole::Surfaces, frame.image_info(vk::Format::R16G16_UNORM));
    let roughness =
        graph.image("light-prepass/roughness", BufferRole::Surfaces, frame.image_info(vk::Format::R8_UNORM));
    let has_stencil = frame.samples == 1;
    let format = if has_stencil { frame.depth_stencil_format() } else { vk::Format::D32_SFLOAT };
    let depth = graph.image("light-prepass/depth", BufferRole::Depth, frame.image_info(format));
    let surfaces = SceneDraws::shaded(frame, "light_prepass/lobe.frag", "light_prepass/lobe.frag#mask")?;
    let mut pass = graph.raster("light-prepass/gbuffer", PassRole::Geometry);
    frame.bind_scene(&mut pass);
    let filled = LobeBuffer {
        // Depth 0 tells what holds nothing: the others need no clear.
        normal: pass.color(normal, Load::DontCare),
        roughness: pass.color(roughness, Load::DontCare),
        depth: pass.depth(depth, Load::Clear(0.0)),
    };
    if has_stencil {
        pass.stencil_clear(0);
    }
    surfaces.draw(frame, &mut pass);
    pass.finish();
    Ok(filled)
}

/// Second pass, `technique/lights`: the sums over all lights of what needs no colour of the surface.
pub(crate) fn gather_lights(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    [depth, normal, roughness]: [&ImageHandle; 3],
) -> Result<[ImageHandle; 3], TechniqueError> {
    let sums = SUMS.map(|slot| {
        let name = format!("{technique}/{}", slot.replace('_', " "));
        graph.image(&name, BufferRole::Targets, frame.image_info(vk::Format::R16G16B16A16_SFLOAT))
    });
    let mut pass = graph.raster(&format!("{technique}/lights"), PassRole::Shading);
    frame.bind_scene(&mut pass);
    pass.read("gbuffer_depth", depth);
    pass.read("gbuffer_normal", normal);
    pass.read("gbuffer_roughness", roughness);
    let sums = sums.map(|sum| pass.color(sum, Load::Clear([0.0; 4])));
    pass.depth_read_only(depth);
    volumes::draw_all(frame, &mut pass, "light_prepass/light.frag", SUMS.len())?;
    pass.finish();
    Ok(sums)
}

/// Third pass: all surfaces again where their depth is equal. Where two have one depth, the stencil lets the first pass, whose
/// normal the first pass has kept.
fn apply_materials(
    graph: &mut Graph,
    frame: &Frame<'_>,
    depth: ImageHandle,
    sums: &[ImageHandle; 3],
) -> Result<ImageHandle, TechniqueError> {
    let radiance = graph.image(
        "light-prepass/radiance",
        BufferRole::Targets,
        frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
    );
    let surfaces =
        SceneDraws::shaded(frame, "light_prepass/material.frag", "light_prepass/material.frag#mask")?
            .depth(DepthTest::EQUAL)
            .stencil(FIRST_FRAGMENT, 1);
    let mut pass = graph.raster("light-prepass/materials", PassRole::Shading);
    frame.bind_scene(&mut pass);
    for (slot, sum) in SUMS.iter().zip(sums) {
        pass.read(slot, sum);
    }
    let radiance = pass.color(radiance, Load::Clear(frame.background()));
    let depth = pass.stencil(depth, Load::Keep);
    surfaces.draw(frame, &mut pass);
    pass.finish();
    frame.board.put(OpaqueDepth(depth));
    Ok(radiance)
}

/// Third pass at several samples a pixel: all surfaces again into buffers of their own, whose samples the hardware averages. A
/// fragment takes the sums of a pixel by [`EdgeLight`].
fn apply_materials_to_samples(
    graph: &mut Graph,
    frame: &Frame<'_>,
    filled: &LobeBuffer,
    sums: &[ImageHandle; 3],
) -> Result<ImageHandle, TechniqueError> {
    let target = RadianceTarget::new(graph, frame, INFO.id);
    let depth = graph.image(
        "light-prepass/sample depth",
        BufferRole::Depth,
        frame.multisampled_info(vk::Format::D32_SFLOAT),
    );
    let alike = frame.params.typed::<LightPrepassParams>().edge_light == EdgeLight::Alike;
    let surfaces = match alike {
        true => SceneDraws::shaded(
            frame,
            "light_prepass/material.frag#alike",
            "light_prepass/material.frag#alike-mask",
        )?,
        false => {
            SceneDraws::shaded(frame, "light_prepass/material.frag", "light_prepass/material.frag#mask")?
        }
    };
    let mut pass = graph.raster("light-prepass/materials", PassRole::Shading);
    frame.bind_scene(&mut pass);
    for (slot, sum) in SUMS.iter().zip(sums) {
        pass.read(slot, sum);
    }
    if alike {
        pass.read("surface_depth", &filled.depth);
        pass.read("surface_normal", &filled.normal);
    }
    let radiance = target.attach(frame, &mut pass);
    let depth = pass.depth(depth, Load::Clear(0.0));
    surfaces.draw(frame, &mut pass);
    pass.finish();
    frame.board.put(OpaqueDepth(depth));
    Ok(radiance)
}
