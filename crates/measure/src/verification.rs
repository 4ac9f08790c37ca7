//! The JSON of `verify`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{DeviceRecord, Difference, SceneRecord};

/// What the check of random views found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// [`crate::SCHEMA`].
    pub schema: u32,
    /// Where it ran.
    pub device: DeviceRecord,
    /// What was seen; its lights are those of the scene itself.
    pub scene: SceneRecord,
    /// Version of the program.
    pub version: String,
    /// Seed of the views.
    pub seed: u64,
    /// Number of the first view: views of one seed may be checked by several programs.
    pub first: u64,
    /// Views that were checked.
    pub views: u64,
    /// Views that were asked for: more than were checked where the time was up.
    pub views_asked: u64,
    /// Time that the views took, seconds.
    pub seconds: f64,
    /// Images that were compared to the reference's.
    pub comparisons: u64,
    /// One a technique and way of visibility, in the order of the registry.
    pub techniques: Vec<Margin>,
    /// What the ray caster says of the reference itself.
    pub probes: Probes,
    /// What was not compared, with how often.
    pub left_out: Vec<LeftOut>,
    /// What is off, the worst first: at most as many as were asked for.
    pub off: Vec<Finding>,
    /// How many are off in all.
    pub off_count: u64,
    /// Images within their bounds only without pixels whose surface Vulkan leaves open, at edges and rims of masks: one of 1,000 at most.
    #[serde(default)]
    pub undecided: u64,
    /// The images that are least within their bounds, the worst first; none that is equal to the reference's.
    pub nearest: Vec<Finding>,
}

/// How near a technique came to its bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Margin {
    /// The technique's id, and its way of visibility where it has two.
    pub technique: String,
    /// Images that were compared.
    pub comparisons: u64,
    /// Of those, how many are off.
    pub off: u64,
    /// The least PSNR above the bound, dB, negative where one is off; [`crate::PSNR_IDENTICAL_DB`] less the bound where all are
    /// equal to the reference's, none where nothing was compared.
    pub least_margin_db: Option<f64>,
    /// The view that gave it.
    pub view: Option<u64>,
}

/// What the ray caster says of sampled pixels of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Probes {
    /// Pixels whose surface was judged.
    pub surfaces: u64,
    /// Pixels whose radiance was judged as well.
    pub radiances: u64,
    /// Pixels of which nothing can be said: 32-bit floats move their surfaces by more than a pixel and a half.
    pub unjudged: u64,
    /// Pixels that are off.
    pub off: u64,
}

/// Comparisons that were not made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The technique's id.
    pub technique: String,
    /// Why.
    pub reason: String,
    /// How often.
    pub count: u64,
}

/// An image of a view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Number of the view.
    pub view: u64,
    /// What was drawn for the camera: `inside`, `in a wall`, …
    pub place: String,
    /// The technique's id; the reference's where the ray caster found its pixels off.
    pub technique: String,
    /// Parameters that are not as they are by default.
    pub params: BTreeMap<String, String>,
    /// Why it is off; none where it is within its bound.
    pub reason: Option<String>,
    /// How far it is from the reference; none where it drew nothing, and for the reference itself.
    pub difference: Option<Difference>,
    /// Least PSNR that it must have, dB.
    pub bound_db: f64,
    /// PSNR above the bound, dB.
    pub margin_db: Option<f64>,
    /// Pixels whose greatest difference of a channel is 4 or more of 255; pixels that the ray caster found off, for the reference.
    pub pixels_off: u64,
    /// Pixels whose surface Vulkan leaves open, without which the image keeps its bound; 0 where it keeps it with them, or not at all.
    #[serde(default)]
    pub pixels_undecided: u64,
    /// The command that repeats exactly this.
    pub command: String,
    /// File of its picture, where one was written.
    pub picture: Option<String>,
}
