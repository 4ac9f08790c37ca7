//! `deferred-dedup`: a multisampled G-buffer with triangle IDs, shaded once a triangle and pixel.

// ORDER: 120

pub mod cost;

use afterlight_graph::{Graph, ImageHandle};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, MULTIPLE_SAMPLES, OpaqueDepth, Params, Source, Technique,
    TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{lights::step, surfaces::shade};

/// The technique.
pub static TECHNIQUE: DeferredDedup = DeferredDedup;

/// See the module.
pub struct DeferredDedup;

static INFO: Info = Info {
    id: "deferred-dedup",
    title: "Deferred shading once a triangle and pixel",
    summary: "A multisampled G-buffer of 20 bytes a sample; samples of one triangle share one evaluation.",
    sources: &[Source { key: "schied-2015", section: "5" }],
    answers: Answers {
        surface: "G-buffer, MSAA with triangle IDs",
        lights: "loop over all, tiles, clusters, or a tree",
        schedule: "compute, a thread a pixel",
        resolve: "once a triangle",
    },
    appendix_a: AppendixA {
        id: "DAA",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "y",
        light_access: "seq",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    params: &[step::LIGHTS],
    needs: &[shade::STANDARD_LOCATIONS],
    samples: MULTIPLE_SAMPLES,
    tessellation: true,
    views: shade::VIEWS,
};

impl Technique for DeferredDedup {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::deferred_dedup(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = shade::fill_dedup(graph, frame, "deferred-dedup")?;
        let surfaces = filled.surfaces(frame);
        let source = ("dedup", frame.samples);
        let radiance = shade::shade(graph, frame, &INFO, source, &surfaces, &|pass| filled.bind(pass))?;
        drop(surfaces);
        frame.board.put(OpaqueDepth(filled.depth));
        Ok(radiance)
    }
}
