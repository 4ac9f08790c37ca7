//! `light-list-forward`: depth first, a list of lights a pixel, then forward shading that walks it.

// ORDER: 54

pub mod cost;

use afterlight_graph::{Graph, ImageHandle};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{
        pixel_lists::{self, LightListParams},
        step::LightStep,
    },
    surfaces::depth_first::{draw_depth, shade_forward},
};

/// The technique.
pub static TECHNIQUE: LightListForward = LightListForward;

/// See the module.
pub struct LightListForward;

static INFO: Info = Info {
    id: "light-list-forward",
    title: "Forward shading by per-pixel light lists",
    summary: "A depth pre-pass; light volumes leave in every pixel a linked list of the lights that reach it; then each surface walks its pixel's.",
    sources: &[
        Source { key: "petrescu-2016", section: "2.2" },
        Source { key: "petrescu-2016", section: "4.7" },
    ],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "per-pixel lists, by light volumes",
        schedule: "fragment shader",
        resolve: "average of the hardware's samples",
    },
    appendix_a: AppendixA {
        id: "LLiF",
        intersect: "exp",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    samples: ANY_SAMPLES,
    ..Info::USUAL
};

impl Technique for LightListForward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(LightListParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::light_list_forward(&pixel_lists::with_lists(workload))
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let nodes = frame.params.typed::<LightListParams>().nodes;
        let depth = draw_depth(graph, frame, INFO.id)?;
        let lists = LightStep::lists(graph, frame, INFO.id, nodes, &depth)?;
        shade_forward(graph, frame, INFO.id, depth, &lists)
    }
}
