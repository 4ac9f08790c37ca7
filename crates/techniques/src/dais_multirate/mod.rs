//! `dais-multirate`: DAIS with indirect light at a lower rate than direct light.

// ORDER: 160

mod params;

pub use params::DaisMultirateParams;

use afterlight_graph::{Graph, ImageHandle};

use crate::dais::{self, Asked, LowRate};
use afterlight_cost::{Cost, Workload};
use afterlight_frame::{Answers, Exactness, Frame, Info, Params, Source, Technique, TechniqueError, views};
use afterlight_shader::Shader;
use afterlight_stages::{lights::step, surfaces::triangles::RecordParams};

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
        lights: step::ANSWER,
        schedule: "compute, a thread a pixel; indirect light a few threads a triangle and cell of pixels",
        resolve: "once a triangle",
    },
    appendix_a: dais::APPENDIX_A,
    exactness: Exactness::Approximate {
        bound: "indirect light of a cell's pixels is that of their mean place; without --indirect as dais",
        min_psnr_db: 40.0,
    },
    approximations: &[dais::DERIVATIVE_TANGENTS],
    departures: &[
        "indirect light alone is shaded at the low rate, and what is shared is irradiance: the material stays at full rate",
        "the visibility buffer is finished before shading, so that the paper's second one and its pass are not needed",
        dais::KEPT_TANGENTS,
        dais::QUAD_GRADIENTS,
    ],
    samples: &[1, 2, 4, 8],
    views: views::TRIANGLES,
    ..Info::USUAL
};

impl Technique for DaisMultirate {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(DaisMultirateParams::default())
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        dais::cost::dais(workload, params.typed::<RecordParams>().floats())
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let params = frame.params.typed::<DaisMultirateParams>();
        let rate = LowRate::chosen(frame, INFO.id, params.rate)?;
        let asked = Asked { technique: INFO.id, lights: params.light_step().method(frame), rate };
        dais::record(graph, frame, &asked, (params.fill, params.record, params.raster))
    }
}
