//! `tiled-forward`: depth first, lists of lights of tiles, then forward shading.

// ORDER: 66

use afterlight_graph::{Graph, ImageHandle};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, ParamInfo, ParamKind, Params, Source, Technique,
    TechniqueError, clustered_forward,
    clusters::Grid,
    cost::{Cost, Workload, tiled_forward},
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
        resolve: "one sample",
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
    params: &[ParamInfo {
        key: "tile-px",
        summary: "width and height of a tile, pixels",
        kind: ParamKind::Integer { min: 8, max: 256 },
        default: "16",
    }],
    needs: &[],
    samples: &[1],
    tessellation: true,
    views: &[],
};

/// Clusters as wide as tiles and as deep as what the image shows.
fn grid(params: &Params) -> Grid {
    Grid { cluster_px: params.number(&INFO, "tile-px") as u32, slices: 1, logarithmic: false }
}

impl Technique for TiledForward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        tiled_forward(&Workload { pixels_a_tile: grid(params).most_pixels(), ..*workload })
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        clustered_forward::record(graph, frame, INFO.id, grid(frame.params))
    }
}
