//! `clustered-forward`: depth first, lists of lights of the clusters that hold a surface, then forward shading.

// ORDER: 64

pub mod cost;

use afterlight_graph::{Graph, ImageHandle};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::cells::{self, Division, Grid},
    surfaces::depth_first::record_forward,
};

/// The technique.
pub static TECHNIQUE: ClusteredForward = ClusteredForward;

/// See the module.
pub struct ClusteredForward;

static INFO: Info = Info {
    id: "clustered-forward",
    title: "Clustered forward shading",
    summary: "A pass for depth alone; each part of the view that holds a surface lists its lights; then forward shading by the lists.",
    sources: &[Source { key: "petrescu-2016", section: "4.10" }, Source { key: "olsson-2012", section: "3" }],
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
    params: afterlight_frame::params::CLUSTERS,
    needs: &[],
    samples: ANY_SAMPLES,
    tessellation: true,
    views: &[],
};

fn division(params: &Params) -> Division {
    Division::Clusters(Grid::of_params(params))
}

impl Technique for ClusteredForward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        cost::clustered_forward(workload, division(params).most_pixels())
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        record_forward(graph, frame, &INFO, division(frame.params))
    }
}
