//! `forward-plus`: depth first, lists of lights of tiles with 32 bits of depth each, then forward shading.

// ORDER: 68

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
        samples: ANY_SAMPLES,
        ..Info::USUAL
    },
    division: Division::Tiles25d,
    cost: |workload, pixels| cost::forward_plus(&Workload { pixels_a_tile: pixels, ..*workload }),
};
