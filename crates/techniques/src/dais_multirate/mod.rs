//! `dais-multirate`: DAIS with indirect light at a lower rate than direct light.

// ORDER: 160

use afterlight_graph::{Graph, ImageHandle};

use crate::dais::{
    self,
    low_rate::{LowRate, RATE, SHARE},
};
use afterlight_cost::{Cost, Workload};
use afterlight_frame::{Answers, Exactness, Frame, Info, Params, Source, Technique, TechniqueError, views};
use afterlight_shader::Shader;
use afterlight_stages::{lights::step, surfaces::compute_raster};

/// The technique.
pub static TECHNIQUE: DaisMultirate = DaisMultirate;

/// See the module.
pub struct DaisMultirate;

static INFO: Info = Info {
    id: "dais-multirate",
    title: "DAIS with multi-rate shading",
    summary: "As dais, with direct light at full rate and indirect light once for the pixels of a cell that show the same triangle.",
    sources: &[
        Source { key: "schied-2015", section: "4.4" },
        Source { key: "ragan-kelley-2011", section: "3" },
        Source { key: "larson-1998", section: "all" },
    ],
    answers: Answers {
        surface: "triangle IDs and a triangle buffer",
        lights: "loop over all, tiles, clusters, or a tree",
        schedule: "compute, a thread a pixel; indirect light a few threads a triangle and cell of pixels",
        resolve: "once a triangle",
    },
    appendix_a: dais::APPENDIX_A,
    exactness: Exactness::Approximate {
        bound: "indirect light of a cell's pixels is that of their mean place; without --indirect as dais",
        min_psnr_db: 40.0,
    },
    params: &[
        step::LIGHTS,
        RATE,
        SHARE,
        dais::FILL,
        dais::CACHE_BUCKETS,
        dais::REFERENCE_BITS,
        compute_raster::VISIBILITY,
        compute_raster::SMALL,
    ],
    needs: &[],
    samples: &[1, 2, 4, 8],
    tessellation: true,
    views: views::TRIANGLES,
};

impl Technique for DaisMultirate {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        crate::dais::cost::dais(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let rate = LowRate::chosen(frame, &INFO)?;
        dais::record(graph, frame, &INFO, rate.as_ref())
    }
}
