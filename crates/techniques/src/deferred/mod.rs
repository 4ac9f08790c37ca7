//! `deferred`: a G-buffer, then one volume a light that adds to the accumulation.

// ORDER: 40

pub mod cost;
mod params;

pub use params::DeferredParams;

use afterlight_graph::{Graph, ImageHandle, Load, PassRole, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, SurfaceNormals, Technique,
    TechniqueError, params::AutoOr,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{
        cells::VisibleDepths,
        step::{LightMethod, LightStep},
        volumes,
    },
    surfaces::gbuffer,
};

/// The technique.
pub static TECHNIQUE: Deferred = Deferred;

/// See the module.
pub struct Deferred;

static INFO: Info = Info {
    id: "deferred",
    title: "Deferred shading",
    summary: "VisibleDepths fill a G-buffer; each light's volume is drawn over it and adds what the light gives.",
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
    departures: &[
        "no composition pass: lights are added with the albedo applied, so that the sum of a pixel is its radiance; the paper adds light alone and applies the albedo last",
    ],
    ..Info::USUAL
};

impl Technique for Deferred {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(DeferredParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::deferred(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let mut filled = gbuffer::fill(graph, frame, INFO.id, vk::Format::D32_SFLOAT)?;
        match frame.params.typed::<DeferredParams>().light_step().method(frame) {
            LightMethod::Volumes => {}
            LightMethod::Lists => {
                let lists = LightStep::lists(graph, frame, INFO.id, AutoOr::Auto, &filled.depth)?;
                return gbuffer::shade(graph, frame, INFO.id, filled, &lists);
            }
            method @ (LightMethod::All | LightMethod::Cells(_) | LightMethod::Tree) => {
                let step = LightStep::build(
                    graph,
                    frame,
                    INFO.id,
                    method,
                    &VisibleDepths::of_depth(&filled.depth, 1),
                )?;
                return gbuffer::shade(graph, frame, INFO.id, filled, &step);
            }
        }
        let mut pass = graph.raster("deferred/lights", PassRole::Shading);
        frame.bind_scene(&mut pass);
        gbuffer::bind(&mut pass, &filled);
        filled.accumulation = pass.color(filled.accumulation, Load::Keep);
        pass.depth_read_only(&filled.depth);
        volumes::draw_all(frame, &mut pass, "lights/volumes/light.frag", 1)?;
        pass.finish();
        frame.board.put(OpaqueDepth(filled.depth));
        frame.board.put(SurfaceNormals(filled.normal));
        Ok(filled.accumulation)
    }
}
