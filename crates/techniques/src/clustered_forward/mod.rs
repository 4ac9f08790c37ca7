//! `clustered-forward`: depth first, lists of lights of the clusters that hold a surface, then forward shading.

// ORDER: 64

pub mod cost;

use afterlight_frame::{ANY_SAMPLES, Answers, AppendixA, Exactness, Info, Source};
use afterlight_stages::{
    lights::cells::{ClusterParams, Division},
    surfaces::depth_first::ForwardByCells,
};

/// The technique.
pub static TECHNIQUE: ForwardByCells<ClusterParams> = ForwardByCells {
    info: Info {
        id: "clustered-forward",
        title: "Clustered forward shading",
        summary: "A pass for depth alone; each part of the view that holds a surface lists its lights; then forward shading by the lists.",
        sources: &[
            Source { key: "petrescu-2016", section: "4.10" },
            Source { key: "olsson-2012", section: "3" },
        ],
        answers: Answers {
            surface: "nothing (depth)",
            lights: "clusters",
            schedule: "fragment shader",
            resolve: "average of the hardware's samples",
        },
        appendix_a: AppendixA {
            id: "CF",
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
    division: Division::Clusters,
    cost: cost::clustered_forward,
};
