//! `clustered`: a G-buffer, lists of lights of the clusters that hold a surface, then compute shading.

// ORDER: 62

pub mod cost;

use afterlight_graph::{Graph, ImageHandle, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{
        cells::{self, ClusterParams, Division, VisibleDepths},
        step::LightStep,
    },
    surfaces::gbuffer,
};

/// The technique.
pub static TECHNIQUE: Clustered = Clustered;

/// See the module.
pub struct Clustered;

static INFO: Info = Info {
    id: "clustered",
    title: "Clustered deferred shading",
    summary: "Surfaces fill a G-buffer; each part of the view that holds one, a tile cut into slices of depth, lists its lights.",
    sources: &[Source { key: "petrescu-2016", section: "4.10" }, Source { key: "olsson-2012", section: "3" }],
    answers: Answers {
        surface: "G-buffer, 1 sample",
        lights: "clusters",
        schedule: "compute",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "CD",
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

fn division(params: &Params) -> Division {
    Division::Clusters(*params.typed())
}

impl Technique for Clustered {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(ClusterParams::default())
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        cost::clustered_deferred(workload, division(params).most_pixels())
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, INFO.id, vk::Format::D32_SFLOAT)?;
        let division = division(frame.params);
        let lists =
            cells::build(graph, frame, INFO.id, division, &VisibleDepths::of_depth(&filled.depth, 1))?;
        gbuffer::shade(graph, frame, INFO.id, filled, &LightStep::Cells(lists))
    }
}
