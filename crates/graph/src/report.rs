//! What a run of a frame took: times, counts and bytes.

pub use afterlight_gpu::Statistics;
use afterlight_roles::{BufferRole, PassRole, PassWork};

/// What one pass took.
#[derive(Clone, Debug, PartialEq)]
pub struct PassReport {
    /// The pass's name.
    pub name: String,
    /// What it is for.
    pub role: PassRole,
    /// By what kind of commands the device does it.
    pub work: PassWork,
    /// Device time in nanoseconds from the end of the pass before to the end of this one, barriers included: the passes'
    /// times add up to the frame's. `None` where the device has no timestamps.
    pub time_ns: Option<f64>,
    /// What the pipeline counted; `None` in a frame that does not count, and where the device has no statistics queries.
    pub statistics: Option<Statistics>,
    /// Whether it is work that techniques share by its role, reported apart.
    pub shared: bool,
}

/// What one resource occupies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResourceReport {
    /// The resource's name.
    pub name: String,
    /// What it holds.
    pub role: BufferRole,
    /// Bytes by the device's memory requirements.
    pub bytes: u64,
    /// Whether it belongs to work that techniques share by its role.
    pub shared: bool,
    /// Whether it is the final colour target, which the technique's bytes leave out.
    pub output: bool,
    /// Whether it is a version of a resource with history.
    pub is_history: bool,
}

/// What one run of a frame took.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameReport {
    /// Passes in the order in which they ran.
    pub passes: Vec<PassReport>,
    /// Device time of the whole frame in nanoseconds. `None` where the device has no timestamps.
    pub frame_ns: Option<f64>,
    /// Host time to record the frame's commands, in nanoseconds.
    pub cpu_record_ns: u64,
    /// Host time from the submission to its end, in nanoseconds.
    pub cpu_wait_ns: u64,
    /// Everything that the frame allocates; resources that live outside the graph are left out.
    pub memory: Vec<ResourceReport>,
    /// Bytes that are allocated at once: resources that live at different times share them.
    pub peak_bytes: u64,
    /// Bytes of all resources but the final colour target and what is shared, each counted in full.
    pub technique_bytes: u64,
    /// Bytes of resources with history, both versions of each, which live for the whole frame.
    pub history_bytes: u64,
}

impl FrameReport {
    /// Returns the device time in nanoseconds of the passes that techniques do not share.
    pub fn technique_ns(&self) -> Option<f64> {
        self.passes.iter().filter(|pass| !pass.shared).map(|pass| pass.time_ns).sum()
    }

    /// Returns the report of the pass of that name.
    pub fn pass(&self, name: &str) -> Option<&PassReport> {
        self.passes.iter().find(|pass| pass.name == name)
    }
}
