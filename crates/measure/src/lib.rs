//! Statistics, run records, the cost model.
//!
//! [`Run`] is the JSON that `compare` and `bench` write: schema 1, stable names. [`Spread`] is how every measured time is
//! told: median, least and greatest of the frames.

mod record;
mod stats;

pub use record::{
    Buffer, CostRecord, Counters, DeviceRecord, Difference, Memory, PSNR_IDENTICAL_DB, Pass, ProcessRecord,
    Run, RunResult, SCHEMA, SceneRecord, SettingsRecord, Status,
};
pub use stats::Spread;

pub use afterlight_roles::{BufferRole, PassRole, PassWork};
