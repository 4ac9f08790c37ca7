//! `light-indexed-forward`: depth first, the indices of the four nearest lights a pixel, then forward shading that visits those.

// ORDER: 53

pub mod cost;

use afterlight_graph::{Graph, ImageHandle};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{Answers, AppendixA, Frame, Info, Params, Source, Technique, TechniqueError};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::indices::{self, LightIndexParams},
    surfaces::depth_first::{draw_depth, shade_visible},
};

/// The technique.
pub static TECHNIQUE: LightIndexedForward = LightIndexedForward;

/// See the module.
pub struct LightIndexedForward;

static INFO: Info = Info {
    id: "light-indexed-forward",
    title: "Light indexed forward shading",
    summary: "A depth pre-pass; light volumes are blended into the packed indices of the four nearest lights a pixel; then each surface visits those.",
    sources: &[
        Source { key: "petrescu-2016", section: "2.2" },
        Source { key: "petrescu-2016", section: "4.7" },
        Source { key: "trebilco-2009", section: "all" },
    ],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "four packed indices, by light volumes",
        schedule: "fragment shader",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "LiF",
        intersect: "exp",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: indices::EXACTNESS,
    departures: &[
        "one sample a pixel alone, where the hardware could average several: a pixel has one list of lights",
    ],
    ..Info::USUAL
};

impl Technique for LightIndexedForward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(LightIndexParams::default())
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        cost::light_indexed_forward(workload, indices::floats(workload, *params.typed()))
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let depth = draw_depth(graph, frame, INFO.id)?;
        let lights = indices::build(graph, frame, INFO.id, *frame.params.typed(), &depth)?;
        let (name, images) = lights.constant();
        let constants = vec![(name.to_owned(), images)];
        let shader = (INFO.id, "light_indexed_forward/forward.frag");
        shade_visible(graph, frame, shader, depth, constants, |pass| lights.bind(pass))
    }
}
