//! `forward-plus`: depth first, lists of lights of tiles with 32 bits of depth each, then forward shading.

// ORDER: 68

pub mod cost;

use afterlight_graph::{Graph, ImageHandle};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    params::TILE_PX,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::cells::{self, Division},
    surfaces::depth_first::record_forward,
};

/// The technique.
pub static TECHNIQUE: ForwardPlus = ForwardPlus;

/// See the module.
pub struct ForwardPlus;

static INFO: Info = Info {
    id: "forward-plus",
    title: "Forward+ with 2.5D culling",
    summary: "A pass for depth alone; each tile lists the lights that touch one of its 32 steps of depth that hold a surface; then forward shading by the lists.",
    sources: &[
        Source { key: "petrescu-2016", section: "4.9" },
        Source { key: "harada-2012", section: "all" },
    ],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "tiles with a mask of depth",
        schedule: "fragment shader",
        resolve: "average of the hardware's samples",
    },
    appendix_a: AppendixA {
        id: "F+",
        intersect: "exp",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    params: &[TILE_PX],
    needs: &[],
    samples: ANY_SAMPLES,
    tessellation: true,
    views: &[],
};

fn division(params: &Params) -> Division {
    Division::Tiles25d { tile_px: params.count(&TILE_PX) }
}

impl Technique for ForwardPlus {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        cost::forward_plus(&Workload { pixels_a_tile: division(params).most_pixels(), ..*workload })
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        record_forward(graph, frame, &INFO, division(frame.params))
    }
}
