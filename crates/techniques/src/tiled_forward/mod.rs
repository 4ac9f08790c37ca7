//! `tiled-forward`: depth first, lists of lights of tiles, then forward shading.

// ORDER: 66

pub mod cost;

use afterlight_cost::Workload;
use afterlight_frame::{ANY_SAMPLES, Answers, AppendixA, Exactness, Info, Source};
use afterlight_stages::{
    lights::cells::{Division, TileParams},
    surfaces::depth_first::ForwardByCells,
};

/// The technique.
pub static TECHNIQUE: ForwardByCells<TileParams> = ForwardByCells {
    info: Info {
        id: "tiled-forward",
        title: "Tiled forward shading",
        summary: "A pass for depth alone; each tile that holds a surface lists its lights; then forward shading by the lists.",
        sources: &[
            Source { key: "petrescu-2016", section: "4.8" },
            Source { key: "olsson-2011", section: "5" },
        ],
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
        samples: ANY_SAMPLES,
        ..Info::USUAL
    },
    division: Division::Tiles,
    cost: |workload, pixels| cost::tiled_forward(&Workload { pixels_a_tile: pixels, ..*workload }),
};
