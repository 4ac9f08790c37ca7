//! `light-indexed`: a G-buffer, the indices of the four nearest lights a pixel, then a compute pass that visits those.

// ORDER: 51

pub mod cost;

use afterlight_graph::{Graph, ImageHandle, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{Answers, AppendixA, Frame, Info, Params, Source, Technique, TechniqueError};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::indices::{self, LightIndexParams},
    surfaces::gbuffer,
};

/// The technique.
pub static TECHNIQUE: LightIndexed = LightIndexed;

/// See the module.
pub struct LightIndexed;

static INFO: Info = Info {
    id: "light-indexed",
    title: "Light indexed deferred shading",
    summary: "Surfaces fill a G-buffer; light volumes are blended into the packed indices of the four nearest lights a pixel, which are then shaded.",
    sources: &[
        Source { key: "petrescu-2016", section: "2.2" },
        Source { key: "petrescu-2016", section: "4.7" },
        Source { key: "trebilco-2009", section: "all" },
    ],
    answers: Answers {
        surface: "G-buffer, 1 sample",
        lights: "four packed indices, by light volumes",
        schedule: "compute, a thread a pixel",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "LiD",
        intersect: "exp",
        transparency: "n",
        hardware_msaa: "n",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: indices::EXACTNESS,
    ..Info::USUAL
};

impl Technique for LightIndexed {
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
        cost::light_indexed(workload, indices::floats(workload, *params.typed()))
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, INFO.id, vk::Format::D32_SFLOAT)?;
        let lights = indices::build(graph, frame, INFO.id, *frame.params.typed(), &filled.depth)?;
        gbuffer::shade_by(graph, frame, (INFO.id, "light_indexed/shade.comp"), filled, |pass| {
            lights.bind(pass);
            let (constant, value) = lights.constant();
            pass.constant(constant, value);
        })
    }
}
