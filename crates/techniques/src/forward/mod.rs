//! `forward`: one pass, every fragment visits every light.

// ORDER: 10

use afterlight_graph::{BufferRole, Graph, ImageHandle, Load, PassRole, gpu::vk};

use crate::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    cost::{Cost, Workload, forward},
    geometry::Surfaces,
    radiance_target::RadianceTarget,
    view::{INVOCATIONS, InvocationCount},
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
    params: &[],
    needs: &[],
    samples: ANY_SAMPLES,
    tessellation: true,
    views: &["invocations"],
};

impl Technique for Forward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        forward(workload, 1.0)
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
        frame.hand_over_depth(depth);
        count.map_or(Ok(radiance), |count| count.heat(graph, frame, "forward"))
    }
}

/// Surfaces shaded by a loop over all lights; they count their fragments where that is to be shown.
pub(crate) fn shaded_surfaces(frame: &Frame<'_>) -> Result<Surfaces, TechniqueError> {
    match frame.shows(INVOCATIONS) {
        true => Surfaces::shaded(frame, "forward/forward.frag#count", "forward/forward.frag#mask-count"),
        false => Surfaces::shaded(frame, "forward/forward.frag", "forward/forward.frag#mask"),
    }
}
