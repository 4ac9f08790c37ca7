//! `depth-prepass`: depth first, then forward shading of what is visible alone.

// ORDER: 30

pub mod cost;

use afterlight_graph::{DepthTest, Graph, ImageHandle, Load, PassRole};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, Technique,
    TechniqueError, views::INVOCATIONS,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    surfaces::depth_first::{FIRST_FRAGMENT, draw_depth},
    surfaces::{RadianceTarget, depth_first::shaded_surfaces},
    views::InvocationCount,
};

/// The technique.
pub static TECHNIQUE: DepthPrepass = DepthPrepass;

/// See the module.
pub struct DepthPrepass;

static INFO: Info = Info {
    id: "depth-prepass",
    title: "Depth pre-pass",
    summary: "A pass for depth alone, then forward shading where the depth is equal: each pixel is shaded once.",
    sources: &[Source { key: "petrescu-2016", section: "4.2" }],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "loop over all",
        schedule: "fragment shader",
        resolve: "average of the hardware's samples",
    },
    appendix_a: AppendixA {
        id: "DPP",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    samples: ANY_SAMPLES,
    views: &["invocations"],
    ..Info::USUAL
};

impl Technique for DepthPrepass {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::depth_prepass(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let target = RadianceTarget::new(graph, frame, "depth-prepass");
        let shaded = shaded_surfaces(frame)?.depth(DepthTest::EQUAL).stencil(FIRST_FRAGMENT, 1);
        let mut count = frame.shows(INVOCATIONS).then(|| InvocationCount::new(graph, frame, "depth-prepass"));

        let depth = draw_depth(graph, frame, INFO.id)?;
        let mut pass = graph.raster("depth-prepass/shade", PassRole::Shading);
        frame.bind_scene(&mut pass);
        count = count.map(|count| count.bind(&mut pass));
        let radiance = target.attach(frame, &mut pass);
        let depth = pass.stencil(depth, Load::Keep);
        shaded.draw(frame, &mut pass);
        pass.finish();
        frame.board.put(OpaqueDepth(depth));
        count.map_or(Ok(radiance), |count| count.heat(graph, frame, "depth-prepass"))
    }
}
