//! `deferred-dedup`: a multisampled G-buffer with triangle IDs, shaded once a triangle and pixel.

// ORDER: 120

pub mod cost;

use afterlight_graph::{BufferRole, Graph, ImageHandle, Load, PassRole, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, MULTIPLE_SAMPLES, OpaqueDepth, Params, Source, Technique,
    TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::step::{self, StepParams},
    surfaces::shade,
    surfaces::{
        geometry::SceneDraws,
        samples::{self, SampleBuffer, SampleImage, emission_tag, emission_variant},
        shade::SurfaceSource,
        visible::NO_TRIANGLE_RGBA8,
    },
};

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
        lights: step::ANSWER,
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
    needs: &[samples::STANDARD_LOCATIONS],
    samples: MULTIPLE_SAMPLES,
    views: shade::VIEWS,
    ..Info::USUAL
};

impl Technique for DeferredDedup {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(StepParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::deferred_dedup(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = fill(graph, frame)?;
        let lights = frame.params.typed::<StepParams>().light_step().method(frame);
        let source = SurfaceSource {
            folder: "deferred_dedup",
            tag: "",
            shading_tag: emission_tag(frame),
            shading_constants: &[],
            samples: frame.samples,
        };
        let radiance =
            shade::shade(graph, frame, (INFO.id, lights), source, &filled.surfaces(frame), &|pass| {
                filled.bind(pass)
            })?;
        frame.board.put(OpaqueDepth(filled.depth));
        Ok(radiance)
    }
}

/// Declares the pass `deferred-dedup/gbuffer` that fills 20 bytes a sample, depth included: base colour and metalness, normal and roughness,
/// triangle ID, view distance and occlusion (Schied and Dachsbacher 2015, section 5).
///
/// # Errors
/// A shader that is not compiled in.
fn fill(graph: &mut Graph, frame: &Frame<'_>) -> Result<SampleBuffer, TechniqueError> {
    let numbered = frame.tessellate_px.is_some();
    let [opaque, masked] = match numbered {
        false => ["deferred_dedup/dedup.frag", "deferred_dedup/dedup.frag#mask"],
        true => ["deferred_dedup/dedup.frag#numbered", "deferred_dedup/dedup.frag#mask-numbered"],
    };
    let mut surfaces =
        SceneDraws::shaded(frame, &emission_variant(frame, opaque), &emission_variant(frame, masked))?;
    let mut count = None;
    if numbered {
        surfaces = surfaces.numbered(frame, INFO.id)?;
        let buffer = graph.buffer(&format!("{}/triangle numbers", INFO.id), BufferRole::Counters, 4);
        count = Some(graph.clear_buffer(
            &format!("{}/clear triangle numbers", INFO.id),
            PassRole::Geometry,
            buffer,
            0,
        ));
    }
    let images = [
        SampleImage::attributes("gbuffer_base_color", vk::Format::R8G8B8A8_SRGB),
        SampleImage::attributes("gbuffer_normal", vk::Format::R8G8B8A8_UNORM),
        SampleImage {
            slot: "ids",
            role: BufferRole::Visibility,
            format: vk::Format::R8G8B8A8_UNORM,
            load: Load::Clear(NO_TRIANGLE_RGBA8),
        },
        SampleImage::attributes("gbuffer_distance", vk::Format::R8G8B8A8_UNORM),
    ];
    samples::fill(graph, frame, INFO.id, &surfaces, &images, count)
}
