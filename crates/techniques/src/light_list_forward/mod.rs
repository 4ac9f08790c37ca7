//! `light-list-forward`: depth first, a list of lights a pixel, then forward shading that walks it.

// ORDER: 54

use afterlight_graph::{DepthTest, Graph, ImageHandle, Load};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    cost::{self, Cost, Workload},
    depth_prepass::{FIRST_FRAGMENT, draw_depth},
    geometry::Surfaces,
    light_lists,
    radiance_target::RadianceTarget,
};

/// The technique.
pub static TECHNIQUE: LightListForward = LightListForward;

/// See the module.
pub struct LightListForward;

static INFO: Info = Info {
    id: "light-list-forward",
    title: "Forward shading by per-pixel light lists",
    summary: "A depth pre-pass; light volumes leave in every pixel a linked list of the lights that reach it; then each surface walks its pixel's.",
    sources: &[
        Source { key: "petrescu-2016", section: "2.2" },
        Source { key: "petrescu-2016", section: "4.7" },
    ],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "per-pixel lists, by light volumes",
        schedule: "fragment shader",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "LLiF",
        intersect: "exp",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    params: &[light_lists::NODES],
    needs: &[],
    samples: &[1],
    tessellation: true,
    views: &[],
};

impl Technique for LightListForward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::light_list_forward(&light_lists::with_lists(workload))
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let depth = draw_depth(graph, frame, INFO.id)?;
        let lists = light_lists::build(graph, frame, &INFO, &depth)?;

        let target = RadianceTarget::new(graph, frame, INFO.id);
        let shader = "light_list_forward/forward.frag";
        let shaded = Surfaces::shaded(frame, shader, &format!("{shader}#mask"))?
            .depth(DepthTest::EQUAL)
            .stencil(FIRST_FRAGMENT, 1);
        let mut pass = graph.raster("light-list-forward/shade");
        frame.bind_scene(&mut pass);
        lists.bind(&mut pass);
        let radiance = target.attach(frame, &mut pass);
        let _depth = pass.stencil(depth, Load::Keep);
        shaded.draw(frame, &mut pass);
        pass.finish();
        Ok(radiance)
    }
}
