//! The JSON of `play`.

use serde::{Deserialize, Serialize};

use crate::{DeviceRecord, Distribution, SceneRecord, SettingsRecord};

/// What frames in flight along a camera path took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Play {
    /// [`crate::SCHEMA`].
    pub schema: u32,
    /// Where it ran.
    pub device: DeviceRecord,
    /// What was seen.
    pub scene: SceneRecord,
    /// How; the camera is that of the path's start.
    pub settings: SettingsRecord,
    /// Name of the camera path.
    pub path: String,
    /// Frames a second of the scene's time.
    pub fps: f64,
    /// Frames that were on their way at once.
    pub in_flight: u32,
    /// Frames after which the next technique took its turn; none where one drew all.
    pub switch_every: Option<u32>,
    /// The techniques, in the order of their turns.
    pub techniques: Vec<Played>,
    /// From the end of one frame to the end of the next on the device, milliseconds, all techniques; none without timestamps.
    pub frame_ms: Option<Distribution>,
    /// Time of the host's thread that a frame took, waiting for the device left out, milliseconds.
    pub cpu_ms: Option<Distribution>,
    /// Fraction of the time from the first frame's beginning to the last one's end in which the device had no frame to work on.
    pub idle_fraction: Option<f64>,
    /// Frames that took more than [`HITCH_FACTOR`] times the median of their neighbours.
    pub hitches: Vec<Hitch>,
    /// Lists that had to grow, and frames that were drawn again for it.
    pub capacity_events: Vec<CapacityEvent>,
    /// Frames that dropped something for want of room.
    pub fell_short: Vec<u64>,
    /// Larger plans that were made on another thread while frames went on.
    pub plans: Vec<PlanEvent>,
    /// Memory of all techniques, which were prepared at once; where sizes or samples change, of the last turn.
    pub memory: PlayMemory,
    /// What the process held before the first frame, at the beginning of each further round of turns, and after the last frame.
    pub held: Vec<Held>,
}

/// A larger plan that was made on another thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanEvent {
    /// The frame whose counters asked for it; none where it followed a plan that frames had outgrown by the time that it was ready.
    pub begun: Option<u64>,
    /// The first frame that was drawn with it; none where it was not ready before the last frame.
    pub taken: Option<u64>,
}

/// What a process holds at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Held {
    /// The frame before which it was counted.
    pub frame: u64,
    /// Bytes of buffers, images and heaps on the device.
    pub device_bytes: u64,
    /// Resources, recordings and other objects of the device.
    pub device_objects: u64,
    /// Resident memory of the process, where the system tells.
    pub host_bytes: Option<u64>,
}

/// A frame is a hitch where it takes more than this many times the median of its neighbours.
pub const HITCH_FACTOR: f64 = 1.5;

/// What the frames of one technique took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Played {
    /// Its id.
    pub technique: String,
    /// Frames that it drew.
    pub frames: u64,
    /// Device time of a frame from its first pass to its last, milliseconds; none without timestamps.
    pub gpu_ms: Option<Distribution>,
    /// Time of the host's thread that a frame took, waiting for the device left out, milliseconds.
    pub cpu_ms: Option<Distribution>,
    /// Whether another view needs no new plan.
    pub moves_without_plans: bool,
}

/// A frame that took longer than its neighbours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hitch {
    /// Its number.
    pub frame: u64,
    /// What it took, milliseconds.
    pub ms: f64,
    /// The median of its neighbours, milliseconds.
    pub neighbours_ms: f64,
    /// What happened in it; empty where nothing is known.
    pub causes: Vec<String>,
}

/// A list that had no room for what a frame needed, or hardly any.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CapacityEvent {
    /// The frame's number.
    pub frame: u64,
    /// What is counted: `blocks`.
    pub list: String,
    /// Elements that the frame needed.
    pub needed: u32,
    /// Elements that there was room for.
    pub capacity: u32,
    /// What was dropped before the frame was drawn again, in the list's own unit.
    pub dropped: u32,
}

/// Bytes that frames in flight hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlayMemory {
    /// Of the plans' images and buffers, which frames share.
    pub plan_bytes: u64,
    /// Of what each frame in flight holds for itself: inputs that the host writes, outputs that it reads.
    pub in_flight_bytes: u64,
}
