//! `tiled`: a G-buffer, then a compute group a tile that culls lights and shades.

// ORDER: 60

pub mod cost;

use afterlight_graph::{Graph, ImageHandle, PassRole, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, Technique, TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::surfaces::gbuffer;

/// The technique.
pub static TECHNIQUE: Tiled = Tiled;

/// See the module.
pub struct Tiled;

static INFO: Info = Info {
    id: "tiled",
    title: "Tiled deferred shading",
    summary: "Surfaces fill a G-buffer; each 16×16 tile keeps the lights that touch its frustum and depth range.",
    sources: &[Source { key: "petrescu-2016", section: "4.8" }, Source { key: "olsson-2011", section: "4" }],
    answers: Answers {
        surface: "G-buffer, 1 sample",
        lights: "tiles",
        schedule: "compute, a group a tile",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "TD",
        intersect: "exp",
        transparency: "n",
        hardware_msaa: "n",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    ..Info::USUAL
};

impl Technique for Tiled {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::tiled_deferred(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, "tiled", vk::Format::D32_SFLOAT)?;

        let mut pass =
            frame.compute(graph, "tiled/shade", PassRole::Shading, &frame.shader("tiled/shade.comp")?);
        gbuffer::bind(&mut pass, &filled);
        let radiance = pass.write("hdr", filled.accumulation);
        pass.dispatch(frame.groups(16));
        pass.finish();
        frame.board.put(OpaqueDepth(filled.depth));
        Ok(radiance)
    }
}
