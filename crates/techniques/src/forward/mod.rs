//! `forward`: one pass, every fragment visits every light.

// ORDER: 10

pub mod cost;

use afterlight_graph::{BufferRole, Graph, ImageHandle, Load, PassRole, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, Technique,
    TechniqueError, VisitsAllLights, views::INVOCATIONS,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    surfaces::RadianceTarget, surfaces::depth_first::shaded_surfaces, views::InvocationCount,
};

/// The technique.
pub static TECHNIQUE: Forward = Forward;

/// See the module.
pub struct Forward;

static INFO: Info = Info {
    id: "forward",
    title: "Forward shading",
    summary: "Every fragment of every surface visits every light; the reference of all comparisons.",
    sources: &[Source { key: "petrescu-2016", section: "4.1" }],
    answers: Answers {
        surface: "nothing",
        lights: "loop over all",
        schedule: "fragment shader",
        resolve: "average of the hardware's samples",
    },
    appendix_a: AppendixA {
        id: "F",
        intersect: "imp",
        transparency: "y",
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

impl Technique for Forward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::forward(workload, 1.0)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let target = RadianceTarget::new(graph, frame, "forward");
        let depth =
            graph.image("forward/depth", BufferRole::Depth, frame.multisampled_info(vk::Format::D32_SFLOAT));
        let surfaces = shaded_surfaces(frame)?;
        let mut count = frame.shows(INVOCATIONS).then(|| InvocationCount::new(graph, frame, "forward"));

        let mut pass = graph.raster("forward/shade", PassRole::Shading);
        frame.bind_scene(&mut pass);
        count = count.map(|count| count.bind(&mut pass));
        let radiance = target.attach(frame, &mut pass);
        let depth = pass.depth(depth, Load::Clear(0.0));
        surfaces.draw(frame, &mut pass);
        pass.finish();
        frame.board.put(OpaqueDepth(depth));
        frame.board.put(VisitsAllLights);
        count.map_or(Ok(radiance), |count| count.heat(graph, frame, "forward"))
    }
}
