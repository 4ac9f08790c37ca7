//! `dais-multirate`: DAIS with indirect light at a lower rate than direct light.

// ORDER: 160

mod params;

pub use params::{DaisMultirateParams, Rate, RateParams, Share};

use afterlight_graph::{Graph, ImageHandle};

use crate::dais::{self, Asked};
use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, Exactness, Frame, Info, Params, Source, SourceSlots, Technique,
    TechniqueError, views,
};
use afterlight_graph::gpu;
use afterlight_shader::Shader;
use afterlight_stages::{lights::step, shared::indirect::IndirectLight};

/// The technique.
pub static TECHNIQUE: DaisMultirate = DaisMultirate;

/// See the module.
pub struct DaisMultirate;

/// Subgroup quad operations in compute shaders.
fn has_quads(features: &gpu::Features) -> bool {
    use gpu::vk::{ShaderStageFlags, SubgroupFeatureFlags};
    features.subgroup_operations.contains(SubgroupFeatureFlags::QUAD)
        && features.subgroup_stages.contains(ShaderStageFlags::COMPUTE)
}

/// Threads of a group of `multisample/shade.comp`.
const SHADING_THREADS: u32 = 64;

/// Bytes of shared memory that the shading grid of a group takes: three words for each triangle that may show, three floats a
/// thread, and some.
fn grid_bytes(threads: u32, samples: u32) -> u32 {
    threads * (12 * samples + 12) + 256
}

/// Indirect light at a low rate: which of `low_rate.glsl`.
pub(crate) struct LowRate {
    cell_px: u32,
    quads: bool,
}

impl LowRate {
    /// What parameters ask for; `None` at full rate or without indirect light.
    ///
    /// # Errors
    /// Quads at another rate than 1/2; what the device lacks.
    pub fn chosen(
        frame: &Frame<'_>,
        technique: &'static str,
        RateParams { rate, share }: RateParams,
    ) -> Result<Option<Self>, TechniqueError> {
        let quads = match share {
            Share::Auto => rate == Rate::Half && has_quads(frame.features()),
            Share::Grid => false,
            Share::Quads => true,
        };
        if quads && rate != Rate::Half {
            return Err(TechniqueError::Conflict {
                technique,
                found: format!("share=quads with rate={rate}"),
                expected: "rate=1/2, or share=grid".to_owned(),
            });
        }
        if rate == Rate::Full || !frame.board.has::<IndirectLight>() {
            return Ok(None);
        }
        let unavailable = |missing: String| Err(TechniqueError::Unavailable { technique, missing });
        if quads && !has_quads(frame.features()) {
            return unavailable(
                "subgroup quad operations for share=quads (share=grid does without)".to_owned(),
            );
        }
        let needed = grid_bytes(SHADING_THREADS, frame.samples);
        let there = frame.features().max_shared_memory_bytes;
        if !quads && needed > there {
            return unavailable(format!(
                "{needed} bytes of shared memory for share=grid at {} samples (there are {there})",
                frame.samples
            ));
        }
        Ok(Some(Self { cell_px: rate.cell_px(), quads }))
    }

    /// Tag of the shading shader's variants.
    pub fn tag(&self) -> &'static str {
        if self.quads { "quads" } else { "grid" }
    }

    /// Sets the specialization constants of `low_rate.glsl`.
    pub fn constants(&self, pass: &mut dyn SourceSlots) {
        if !self.quads {
            pass.constant("CELL_PX", self.cell_px);
        }
    }
}

static INFO: Info = Info {
    id: "dais-multirate",
    title: "DAIS with multi-rate shading",
    summary: "As dais, with direct light at full rate and indirect light once for the pixels of a cell that show the same triangle.",
    sources: &[
        Source { key: "schied-2015", section: "4.4" },
        Source { key: "ragan-kelley-2011", section: "3" },
        Source { key: "larson-1998", section: "all" },
    ],
    answers: Answers {
        surface: "triangle IDs and a triangle buffer",
        lights: step::ANSWER,
        schedule: "compute, a thread a pixel; indirect light a few threads a triangle and cell of pixels",
        resolve: "once a triangle",
    },
    appendix_a: dais::APPENDIX_A,
    exactness: Exactness::Approximate {
        bound: "indirect light of a cell's pixels is that of their mean place; without --indirect as dais",
        min_psnr_db: 40.0,
    },
    samples: &[1, 2, 4, 8],
    views: views::TRIANGLES,
    ..Info::USUAL
};

impl Technique for DaisMultirate {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(DaisMultirateParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        crate::dais::cost::dais(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let params = frame.params.typed::<DaisMultirateParams>();
        let rate = LowRate::chosen(frame, INFO.id, params.rate)?;
        let asked = Asked { technique: INFO.id, lights: params.light_step().method(frame), rate };
        dais::record(graph, frame, &asked, (params.fill, params.raster))
    }
}
