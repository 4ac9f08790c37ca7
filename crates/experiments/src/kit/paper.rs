//! What papers say: figures stand as data in the experiments' folders.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use afterlight_measure::SCHEMA;

/// Where a paper's figures stand, and what they were measured on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PaperRecord {
    /// Key in REFERENCES.toml.
    pub key: String,
    pub section: String,
    pub device: String,
    /// Pixels.
    pub width: u32,
    pub height: u32,
}

/// What a paper without figures says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PaperWords {
    /// Key in REFERENCES.toml.
    pub key: String,
    pub section: String,
    pub says: String,
}

/// A file of a paper's figures: where they are from, then the figures.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PaperFigures<Figures> {
    pub source: PaperRecord,
    pub figures: Figures,
}

/// Reads an experiment's `paper.json`, which is compiled in.
///
/// # Panics
/// Where the file is not of the type; the experiment's tests read it.
pub(crate) fn paper_data<Data: DeserializeOwned>(json: &str) -> Data {
    serde_json::from_str(json).unwrap_or_else(|error| panic!("paper.json: {error}"))
}

/// What the JSON of an experiment beside a paper begins with.
#[derive(Serialize)]
pub(crate) struct Header {
    schema: u32,
    experiment: &'static str,
    scale: f64,
    paper: PaperRecord,
    /// What differs from the paper, and what stood in.
    notes: Vec<String>,
}

impl Header {
    pub fn new(experiment: &'static str, scale: f64, paper: PaperRecord, notes: Vec<String>) -> Header {
        Header { schema: SCHEMA, experiment, scale, paper, notes }
    }
}

/// 2^20 bytes: the unit of the papers' "MB", as their figures of known layouts show.
pub(crate) const MIB: f64 = (1u64 << 20) as f64;

/// Width and height of the papers' experiments on anti-aliasing, pixels.
pub(crate) const FULL_HD_PX: (u32, u32) = (1920, 1080);

/// Least triangles of a stand-in.
const STAND_IN_TRIANGLES_MIN: u32 = 16_384;

/// The colonnade that stands in for a scene of so many triangles, as many fewer as the image has fewer pixels.
pub(crate) fn stand_in(triangles: u32, scale: f64) -> String {
    let triangles = ((f64::from(triangles) * scale * scale).round() as u32).max(STAND_IN_TRIANGLES_MIN);
    format!("builtin:colonnade?triangles={triangles}")
}
