//! `deferred-msaa`: the whole G-buffer multisampled; pixels that a triangle's edge crosses are shaded at sample rate, the
//! others once.

// ORDER: 110

use afterlight_graph::{
    BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, StencilFace, StencilTest, gpu::vk,
};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, MULTIPLE_SAMPLES, Params, Source, Technique, TechniqueError,
    cost::{Cost, Workload, deferred_msaa},
    light_step,
    multisample::{self, SampleBuffer, emission_variant},
};

/// The technique.
pub static TECHNIQUE: DeferredMsaa = DeferredMsaa;

/// See the module.
pub struct DeferredMsaa;

static INFO: Info = Info {
    id: "deferred-msaa",
    title: "Deferred shading with edges at sample rate",
    summary: "Centroid interpolation finds pixels on edges, the stencil buffer marks them: sample rate there, pixel rate inside.",
    sources: &[
        Source { key: "petrescu-2016", section: "4.4" },
        Source { key: "fridvalszky-2020", section: "1.3" },
    ],
    answers: Answers {
        surface: "G-buffer, multisampled",
        lights: "loop over all, tiles, clusters, or a tree",
        schedule: "fragment shader; compute with lists of lights",
        resolve: "edges only",
    },
    appendix_a: AppendixA {
        id: "DAA",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "y",
        light_access: "seq",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    params: &[light_step::LIGHTS],
    needs: &[multisample::STANDARD_LOCATIONS],
    samples: MULTIPLE_SAMPLES,
    tessellation: true,
    views: multisample::VIEWS,
};

/// Writes the reference wherever a fragment is.
const MARK: StencilTest = test(vk::CompareOp::ALWAYS, vk::StencilOp::REPLACE);
/// Passes where the reference stands.
const MARKED: StencilTest = test(vk::CompareOp::EQUAL, vk::StencilOp::KEEP);

const fn test(compare: vk::CompareOp, pass: vk::StencilOp) -> StencilTest {
    let face = StencilFace { compare, pass, ..StencilFace::KEEP };
    StencilTest { front: face, back: face, compare_mask: 0xff, write_mask: 0xff }
}

impl Technique for DeferredMsaa {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        deferred_msaa(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = multisample::fill_samples(graph, frame, "deferred-msaa")?;
        let radiance = match light_step::chosen(frame, &INFO) {
            "all" => shade_by_stencil(graph, frame, &filled)?,
            _ => {
                let surfaces = filled.surfaces(frame);
                let source = ("msaa", frame.samples);
                multisample::shade(graph, frame, &INFO, source, &surfaces, &|pass| filled.bind(pass))?
            }
        };
        frame.hand_over_depth(filled.depth);
        Ok(radiance)
    }
}

/// Marks edges in a stencil buffer of one sample, then shades the marked pixels and the others in turn.
fn shade_by_stencil(
    graph: &mut Graph,
    frame: &Frame<'_>,
    filled: &SampleBuffer,
) -> Result<ImageHandle, TechniqueError> {
    let stencil = graph.image(
        "deferred-msaa/stencil",
        BufferRole::Depth,
        frame.image_info(frame.depth_stencil_format()),
    );
    let radiance = graph.image(
        "deferred-msaa/radiance",
        BufferRole::Targets,
        frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
    );
    let samples = [("SAMPLES", frame.samples)];
    let mark = multisample::full_screen(frame, "multisample/mark.frag", &samples)?.stencil(MARK);
    let shaded = |rate: &str| {
        let fragment = emission_variant(frame, &format!("multisample/shade.frag#{rate}"));
        let state =
            multisample::full_screen(frame, &fragment, &multisample::shade_constants(frame, frame.samples))?;
        Ok::<_, TechniqueError>(state.stencil(MARKED).depth(DepthTest::OFF))
    };
    let (at_pixels, at_samples) = (shaded("pixel")?, shaded("sample")?);

    let mut pass = graph.raster("deferred-msaa/edges", PassRole::Resolve);
    frame.bind_scene(&mut pass);
    filled.bind(&mut pass);
    // Its depth is not used, but attached.
    let stencil = pass.depth(stencil, Load::Clear(0.0));
    pass.stencil_clear(0);
    multisample::draw_full_screen(&mut pass, mark, 1);
    pass.finish();

    let mut pass = graph.raster("deferred-msaa/shade", PassRole::Shading);
    frame.bind_scene(&mut pass);
    filled.bind(&mut pass);
    // The two draws cover every pixel.
    let radiance = pass.color(radiance, Load::DontCare);
    let _stencil = pass.stencil(stencil, Load::Keep);
    multisample::draw_full_screen(&mut pass, at_pixels, 0);
    multisample::draw_full_screen(&mut pass, at_samples, 1);
    pass.finish();
    Ok(radiance)
}
