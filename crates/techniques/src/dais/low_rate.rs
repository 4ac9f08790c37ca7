//! Indirect light of the family at a lower rate than direct light: its parameters, and what shading takes of them.

use afterlight_frame::{Frame, Info, ParamInfo, ParamKind, SourceSlots, TechniqueError};
use afterlight_graph::gpu;
use afterlight_stages::shared::indirect::IndirectLight;

const RATE_VALUES: &[&str] = &["1", "1/2", "1/4", "1/8"];
const RATE_SUMMARY: &str =
    "shading samples of indirect light a pixel along each axis; a triangle's neighbouring pixels share one";

/// Rate of indirect light, where the technique is made for low ones.
pub(crate) const RATE: ParamInfo = ParamInfo {
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

/// Threads of a group of `surfaces/shade/shade.comp`.
const SHADING_THREADS: u32 = 64;

/// Bytes of shared memory that the shading grid of a group takes: three words for each triangle that may show, three floats a
/// thread, and some.
fn grid_bytes(threads: u32, samples: u32) -> u32 {
    threads * (12 * samples + 12) + 256
}

/// Indirect light at a low rate: which part of `surfaces/low_rate/low_rate.glsl`.
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
