//! `deferred-msaa`: the whole G-buffer multisampled; pixels that a triangle's edge crosses are shaded at sample rate, the
//! others once.

// ORDER: 110

pub mod cost;

use afterlight_graph::{
    BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, StencilFace, StencilTest, gpu::vk,
};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Approximation, Condition, Exactness, Frame, Info, MULTIPLE_SAMPLES, OpaqueDepth,
    Params, Source, Technique, TechniqueError, set_constants,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::step::{self, LightMethod, StepParams},
    surfaces::samples::{EdgeParams, PositionParams, SampleBuffer, emission_variant},
    surfaces::shade,
    surfaces::{
        samples::{self, emission_tag},
        shade::SurfaceSource,
    },
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
        lights: step::ANSWER,
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
    approximations: &[samples::AT_SAMPLES, BY_CENTROIDS],
    departures: &[
        "surfaces are lit at the pixel's centre, as forward shading does; the paper's place is position=sample",
        "pixels that hold several fragments are edges whatever centroids tell; the paper's are edges=centroid",
        "light is accumulated in registers and averaged at once: the paper has a multisampled accumulation buffer and a composition pass",
        "a loop over all lights where the stencil buffer tells edges, with at most 16 lights by default; the paper's light volumes are lights=volumes",
    ],
    needs: &[samples::STANDARD_LOCATIONS],
    samples: MULTIPLE_SAMPLES,
    views: shade::VIEWS,
    ..Info::USUAL
};

/// What marks by centroids alone come to.
const BY_CENTROIDS: Approximation = Approximation {
    when: &[Condition::Param("edges", "centroid")],
    bound: "triangles that intersect in a pixel are shaded as one; so are silhouettes where the device's centroids tell no edge",
    min_psnr_db: 25.0,
};

/// Specialization constant of the source that reads positions.
fn position_constant(frame: &Frame<'_>) -> (&'static str, u32) {
    ("AT_SAMPLES", frame.params.typed::<PositionParams>().at_samples())
}

/// Specialization constant of what reads marks of edges.
fn edge_constant(frame: &Frame<'_>) -> (&'static str, u32) {
    ("COMPARES_FRAGMENTS", frame.params.typed::<EdgeParams>().compares_fragments())
}

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

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(StepParams::default())
            .and(Params::of(PositionParams::default()))
            .and(Params::of(EdgeParams::default()))
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::deferred_msaa(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = samples::fill_samples(graph, frame, "deferred-msaa")?;
        let radiance = match frame.params.typed::<StepParams>().light_step().method(frame) {
            LightMethod::All => shade_by_stencil(graph, frame, &filled)?,
            lights @ (LightMethod::Volumes
            | LightMethod::Lists
            | LightMethod::Cells(_)
            | LightMethod::Tree) => {
                let surfaces = filled.surfaces(frame);
                let source = SurfaceSource {
                    folder: "deferred_msaa",
                    tag: "",
                    shading_tag: emission_tag(frame),
                    shading_constants: &[],
                    samples: frame.samples,
                };
                shade::shade(graph, frame, (INFO.id, lights), source, &surfaces, &|pass| {
                    filled.bind(pass);
                    set_constants(pass, [position_constant(frame), edge_constant(frame)]);
                })?
            }
        };
        frame.board.put(OpaqueDepth(filled.depth));
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
    let samples = [("SAMPLES", frame.samples), edge_constant(frame)];
    let mark = shade::full_screen(frame, "surfaces/samples/mark.frag", &samples)?.stencil(MARK);
    let shaded = |rate: &str| {
        let fragment = emission_variant(frame, &format!("deferred_msaa/shade.frag#{rate}"));
        let [samples, view] = shade::shade_constants(frame, frame.samples);
        let state = shade::full_screen(frame, &fragment, &[samples, view, position_constant(frame)])?;
        Ok::<_, TechniqueError>(state.stencil(MARKED).depth(DepthTest::OFF))
    };
    let (at_pixels, at_samples) = (shaded("pixel")?, shaded("sample")?);

    let mut pass = graph.raster("deferred-msaa/edges", PassRole::Resolve);
    frame.bind_scene(&mut pass);
    filled.bind(&mut pass);
    // Its depth is not used, but attached.
    let stencil = pass.depth(stencil, Load::Clear(0.0));
    pass.stencil_clear(0);
    shade::draw_full_screen(&mut pass, mark, 1);
    pass.finish();

    let mut pass = graph.raster("deferred-msaa/shade", PassRole::Shading);
    frame.bind_scene(&mut pass);
    filled.bind(&mut pass);
    // The two draws cover every pixel.
    let radiance = pass.color(radiance, Load::DontCare);
    let _stencil = pass.stencil(stencil, Load::Keep);
    shade::draw_full_screen(&mut pass, at_pixels, 0);
    shade::draw_full_screen(&mut pass, at_samples, 1);
    pass.finish();
    Ok(radiance)
}
