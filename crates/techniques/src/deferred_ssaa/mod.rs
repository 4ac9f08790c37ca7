//! `deferred-ssaa`: the whole G-buffer multisampled, every sample shaded.

// ORDER: 100

use afterlight_graph::{Graph, ImageHandle};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, MULTIPLE_SAMPLES, OpaqueDepth, Params, Source, Technique,
    TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::step::{self, StepParams},
    surfaces::shade,
    surfaces::{
        samples::{self, PositionParams, emission_tag},
        shade::SurfaceSource,
    },
};

/// The technique.
pub static TECHNIQUE: DeferredSsaa = DeferredSsaa;

/// See the module.
pub struct DeferredSsaa;

static INFO: Info = Info {
    id: "deferred-ssaa",
    title: "Deferred shading of every sample",
    summary: "The whole G-buffer is multisampled and every sample is shaded: what deferred shading with MSAA costs without thought.",
    sources: &[
        Source { key: "petrescu-2016", section: "4.4" },
        Source { key: "fridvalszky-2020", section: "1.3" },
    ],
    answers: Answers {
        surface: "G-buffer, multisampled",
        lights: step::ANSWER,
        schedule: "compute, a thread a pixel",
        resolve: "shade all samples",
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
    approximations: &[samples::AT_SAMPLES],
    departures: &[
        "surfaces are lit at the pixel's centre, as forward shading does; the paper's place is position=sample",
        "light is accumulated in registers and averaged at once: the paper has a multisampled accumulation buffer and a composition pass",
    ],
    needs: &[samples::STANDARD_LOCATIONS],
    samples: MULTIPLE_SAMPLES,
    views: shade::VIEWS,
    ..Info::USUAL
};

impl Technique for DeferredSsaa {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(StepParams::default()).and(Params::of(PositionParams::default()))
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        crate::deferred_msaa::cost::deferred_msaa(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = samples::fill_samples(graph, frame, "deferred-ssaa")?;
        let lights = frame.params.typed::<StepParams>().light_step().method(frame);
        let source = SurfaceSource {
            folder: "deferred_ssaa",
            tag: "",
            shading_tag: emission_tag(frame),
            shading_constants: &[],
            samples: frame.samples,
        };
        let at_samples = frame.params.typed::<PositionParams>().at_samples();
        let radiance =
            shade::shade(graph, frame, (INFO.id, lights), source, &filled.surfaces(frame), &|pass| {
                filled.bind(pass);
                pass.constant("AT_SAMPLES", at_samples);
            })?;
        frame.board.put(OpaqueDepth(filled.depth));
        Ok(radiance)
    }
}
