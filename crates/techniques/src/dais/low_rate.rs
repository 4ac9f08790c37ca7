//! Indirect light of the family at a lower rate than direct light: its parameters, and what shading takes of them.

use afterlight_frame::{
    Frame, TechniqueError,
    params::{choices, parameters},
};
use afterlight_graph::gpu;
use afterlight_stages::shared::indirect::IndirectLight;

choices! {
    /// Shading samples of indirect light a pixel along each axis.
    pub enum Rate {
        /// One a pixel.
        Full = "1",
        /// One for 2 × 2 pixels.
        Half = "1/2",
        /// One for 4 × 4 pixels.
        Quarter = "1/4",
        /// One for 8 × 8 pixels.
        Eighth = "1/8",
    }
}

impl Rate {
    /// Width and height of the cell of pixels that may share a sample.
    pub fn cell_px(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
            Self::Eighth => 8,
        }
    }
}

choices! {
    /// How pixels find whom they share a sample with.
    pub enum Share {
        /// Quads where there can be, else the grid.
        Auto = "auto",
        /// Pixels of a cell of the shading grid, by a memoization table.
        Grid = "grid",
        /// Quads that one triangle fills, by subgroup quad operations.
        Quads = "quads",
    }
}

parameters! {
    /// At what rate indirect light is shaded, where the technique is made for low ones.
    #[derive(Copy)]
    pub struct RateParams {
        /// shading samples of indirect light a pixel along each axis; a triangle's neighbouring pixels share one
        rate: Rate = Rate::Half, "rate";
        /// who shares a shading sample: pixels of a cell of the shading grid, by a memoization table, or quads that one triangle fills, by subgroup quad operations (rate 1/2 alone); auto: quads where there can be
        share: Share = Share::Auto, "share";
    }
}

impl RateParams {
    /// Where full rate is what is expected.
    pub const FULL: Self = Self { rate: Rate::Full, share: Share::Auto };
}

/// Subgroup quad operations, and votes, in compute shaders.
fn has_quads(features: &gpu::Features) -> bool {
    use gpu::vk::{ShaderStageFlags, SubgroupFeatureFlags};
    features.subgroup_operations.contains(SubgroupFeatureFlags::QUAD | SubgroupFeatureFlags::VOTE)
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

    /// The specialization constants of `low_rate.glsl`.
    pub fn constants(&self) -> Vec<(&'static str, u32)> {
        if self.quads { Vec::new() } else { vec![("CELL_PX", self.cell_px)] }
    }
}
