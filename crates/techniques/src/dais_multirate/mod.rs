//! `dais-multirate`: DAIS with indirect light at a lower rate than direct light.

// ORDER: 160

use afterlight_graph::{Graph, ImageHandle};

use crate::dais;
use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, Exactness, Frame, Info, ParamInfo, ParamKind, Params, Source, SourceSlots, Technique,
    TechniqueError, views,
};
use afterlight_graph::gpu;
use afterlight_shader::Shader;
use afterlight_stages::{lights::step, shared::indirect::IndirectLight, surfaces::compute_raster};

/// The technique.
pub static TECHNIQUE: DaisMultirate = DaisMultirate;

/// See the module.
pub struct DaisMultirate;

const RATE_VALUES: &[&str] = &["1", "1/2", "1/4", "1/8"];
const RATE_SUMMARY: &str =
    "shading samples of indirect light a pixel along each axis; a triangle's neighbouring pixels share one";

/// Rate of indirect light, where the technique is made for low ones.
const RATE: ParamInfo = ParamInfo {
    key: "rate",
    summary: RATE_SUMMARY,
    kind: ParamKind::Choice { values: RATE_VALUES },
    default: "1/2",
};
/// Rate of indirect light, where full rate is what is expected.
pub(crate) const FULL_RATE: ParamInfo = ParamInfo { default: "1", ..RATE };
/// How pixels find whom they share a sample with.
pub(crate) const SHARE: ParamInfo = ParamInfo {
    key: "share",
    summary: "who shares a shading sample: pixels of a cell of the shading grid, by a memoization table, or quads that one triangle fills, by subgroup quad operations (rate 1/2 alone); auto: quads where there can be",
    kind: ParamKind::Choice { values: &["auto", "grid", "quads"] },
    default: "auto",
};

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
    /// What a frame of the technique asks for by its parameters [`RATE`] and [`SHARE`]; `None` at full rate or without indirect
    /// light.
    ///
    /// # Errors
    /// Quads at another rate than 1/2; what the device lacks.
    pub fn chosen(frame: &Frame<'_>, info: &'static Info) -> Result<Option<Self>, TechniqueError> {
        let rate = frame.params.text(info, RATE.key);
        let cell_px: u32 = rate.rsplit('/').next().and_then(|n| n.parse().ok()).unwrap_or(1);
        let quads = match frame.params.text(info, SHARE.key) {
            "auto" => cell_px == 2 && has_quads(frame.features()),
            share => share == "quads",
        };
        if quads && cell_px != 2 {
            return Err(TechniqueError::Conflict {
                technique: info.id,
                found: format!("share=quads with rate={rate}"),
                expected: "rate=1/2, or share=grid".to_owned(),
            });
        }
        if cell_px == 1 || !frame.board.has::<IndirectLight>() {
            return Ok(None);
        }
        let unavailable = |missing: String| Err(TechniqueError::Unavailable { technique: info.id, missing });
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
        Ok(Some(Self { cell_px, quads }))
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
        lights: "loop over all, tiles, clusters, or a tree",
        schedule: "compute, a thread a pixel; indirect light a few threads a triangle and cell of pixels",
        resolve: "once a triangle",
    },
    appendix_a: dais::APPENDIX_A,
    exactness: Exactness::Approximate {
        bound: "indirect light of a cell's pixels is that of their mean place; without --indirect as dais",
        min_psnr_db: 40.0,
    },
    params: &[
        step::LIGHTS,
        RATE,
        SHARE,
        dais::FILL,
        dais::CACHE_BUCKETS,
        dais::REFERENCE_BITS,
        compute_raster::VISIBILITY,
        compute_raster::SMALL,
    ],
    needs: &[],
    samples: &[1, 2, 4, 8],
    tessellation: true,
    views: views::TRIANGLES,
};

impl Technique for DaisMultirate {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        crate::dais::cost::dais(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let rate = LowRate::chosen(frame, &INFO)?;
        dais::record(graph, frame, &INFO, rate.as_ref())
    }
}
