//! `deferred`: a G-buffer, then one volume a light that adds to the accumulation.

// ORDER: 40

use afterlight_graph::{Graph, ImageHandle, Load, PassRole, gpu::vk};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    clusters::Surfaces,
    cost::{self, Cost, Workload},
    gbuffer,
    light_step::{self, LightStep},
    volumes,
};

/// The technique.
pub static TECHNIQUE: Deferred = Deferred;

/// See the module.
pub struct Deferred;

static INFO: Info = Info {
    id: "deferred",
    title: "Deferred shading",
    summary: "Surfaces fill a G-buffer; each light's volume is drawn over it and adds what the light gives.",
    sources: &[Source { key: "petrescu-2016", section: "4.3" }],
    answers: Answers {
        surface: "G-buffer, 1 sample",
        lights: "light volumes; or a loop over all, lists, tiles, clusters, a tree",
        schedule: "fragment shader; compute with lists of lights",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "D",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "n",
        light_access: "seq",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    params: &[light_step::GBUFFER_LIGHTS],
    needs: &[],
    samples: &[1],
    tessellation: true,
    views: &[],
};

impl Technique for Deferred {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::deferred(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let mut filled = gbuffer::fill(graph, frame, INFO.id, vk::Format::D32_SFLOAT)?;
        match light_step::chosen(frame, &INFO) {
            "volumes" => {}
            "lists" => {
                let lists = LightStep::lists(graph, frame, &INFO, &filled.depth)?;
                return gbuffer::shade(graph, frame, INFO.id, filled, &lists);
            }
            _ => {
                let surfaces = Surfaces::of_depth(&filled.depth, 1);
                let step = LightStep::build(graph, frame, &INFO, &surfaces)?;
                drop(surfaces);
                return gbuffer::shade(graph, frame, INFO.id, filled, &step);
            }
        }
        let mut pass = graph.raster("deferred/lights", PassRole::Shading);
        frame.bind_scene(&mut pass);
        gbuffer::bind(&mut pass, &filled);
        filled.accumulation = pass.color(filled.accumulation, Load::Keep);
        pass.depth_read_only(&filled.depth);
        volumes::draw_all(frame, &mut pass, "volumes/light.frag", 1)?;
        pass.finish();
        frame.hand_over_depth(filled.depth);
        Ok(filled.accumulation)
    }
}
