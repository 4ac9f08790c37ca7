//! `light-list`: a G-buffer, a list of lights a pixel, then a compute pass that walks it.

// ORDER: 52

pub mod cost;

use afterlight_graph::{Graph, ImageHandle, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{
        pixel_lists::{self, LightListParams},
        step::LightStep,
    },
    surfaces::gbuffer,
};

/// The technique.
pub static TECHNIQUE: LightList = LightList;

/// See the module.
pub struct LightList;

static INFO: Info = Info {
    id: "light-list",
    title: "Deferred shading by per-pixel light lists",
    summary: "Surfaces fill a G-buffer; light volumes leave in every pixel a linked list of the lights that reach it, which is then walked.",
    sources: &[
        Source { key: "petrescu-2016", section: "2.2" },
        Source { key: "petrescu-2016", section: "4.7" },
    ],
    answers: Answers {
        surface: "G-buffer, 1 sample",
        lights: "per-pixel lists, by light volumes",
        schedule: "compute, a thread a pixel",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "LLiD",
        intersect: "exp",
        transparency: "n",
        hardware_msaa: "n",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    ..Info::USUAL
};

impl Technique for LightList {
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
        cost::light_list(&pixel_lists::with_lists(workload))
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let nodes = frame.params.typed::<LightListParams>().nodes;
        let filled = gbuffer::fill(graph, frame, INFO.id, vk::Format::D32_SFLOAT)?;
        let lists = LightStep::lists(graph, frame, INFO.id, nodes, &filled.depth)?;
        gbuffer::shade(graph, frame, INFO.id, filled, &lists)
    }
}
