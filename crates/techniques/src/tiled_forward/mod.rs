//! `tiled-forward`: depth first, lists of lights of tiles, then forward shading.

// ORDER: 66

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
pub static TECHNIQUE: TiledForward = TiledForward;

/// See the module.
pub struct TiledForward;

static INFO: Info = Info {
    id: "tiled-forward",
    title: "Tiled forward shading",
    summary: "A pass for depth alone; each tile that holds a surface lists its lights; then forward shading by the lists.",
    sources: &[Source { key: "petrescu-2016", section: "4.8" }, Source { key: "olsson-2011", section: "5" }],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "tiles",
        schedule: "fragment shader",
        resolve: "average of the hardware's samples",
    },
    appendix_a: AppendixA {
        id: "TF",
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
    Division::Tiles { tile_px: params.count(&TILE_PX) }
}

impl Technique for TiledForward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        cost::tiled_forward(&Workload { pixels_a_tile: division(params).most_pixels(), ..*workload })
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        record_forward(graph, frame, &INFO, division(frame.params))
    }
}
