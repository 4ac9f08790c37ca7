//! The paper's Table 1 and its claims.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::kit::{PaperRecord, paper_data};

/// Table 1.
pub(crate) static PAPER: LazyLock<Paper> = LazyLock::new(|| paper_data(include_str!("paper.json")));

/// The paper's samples a pixel.
pub(crate) const PAPER_SAMPLES: u32 = 8;

/// What the paper measured.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Paper {
    pub source: PaperRecord,
    /// The two scenes of the paper.
    pub scenes: Vec<PaperScene>,
}

/// A scene of the paper with its lines of Table 1.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PaperScene {
    pub name: String,
    /// What file names of the scene hold.
    pub word: String,
    pub triangles: u32,
    pub dais: PaperRow,
    pub list: PaperRow,
    pub multirate: PaperRow,
    pub deferred: PaperRow,
    pub claimed: Claimed,
}

/// The paper's claims as ratios to deferred shading, as it rounds them.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Claimed {
    pub list_memory: f64,
    pub dais_time: f64,
    pub multirate_time: f64,
}

/// A line of Table 1. Its "MB" are MiB: 3840×2160×8 samples of 20 bytes are 1265.62.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PaperRow {
    pub z_prepass_ms: Option<f64>,
    pub derivatives_ms: Option<f64>,
    /// The depth pre-pass included.
    pub fill_ms: f64,
    pub shade_ms: f64,
    pub frame_ms: f64,
    pub triangle_buffer_mib: Option<f64>,
    pub total_mib: f64,
}

/// Width and height of Table 1, pixels.
pub(crate) fn paper_px() -> (u32, u32) {
    (PAPER.source.width, PAPER.source.height)
}

/// The paper, for a section of it.
pub(crate) fn paper_record(section: &str) -> PaperRecord {
    PaperRecord { section: section.to_owned(), ..PAPER.source.clone() }
}
