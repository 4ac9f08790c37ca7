//! `forward`: one pass, every fragment visits every light.

// ORDER: 10

use afterlight_graph::{Graph, ImageHandle, Load, gpu::vk};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    cost::{Cost, Workload, forward},
    geometry::Surfaces,
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
        resolve: "one sample",
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
    samples: &[1],
};

impl Technique for Forward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        forward(workload, 1.0)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let radiance = graph.image("forward/radiance", frame.image_info(vk::Format::R16G16B16A16_SFLOAT));
        let depth = graph.image("forward/depth", frame.image_info(vk::Format::D32_SFLOAT));
        let surfaces = Surfaces::shaded(frame, "forward/forward.frag", "forward/forward.frag#mask")?;

        let mut pass = graph.raster("forward/shade");
        frame.bind_scene(&mut pass);
        let radiance = pass.color(radiance, Load::Clear(frame.background()));
        let _depth = pass.depth(depth, Load::Clear(0.0));
        surfaces.draw(frame, &mut pass);
        pass.finish();
        Ok(radiance)
    }
}
