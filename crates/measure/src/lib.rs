//! Statistics and run records.
//!
//! [`Run`] is the JSON that `compare` and `bench` write: schema 1, stable names. [`Spread`] is how every measured time is
//! told: median, least and greatest of the frames. Predicted costs are kept beside what was measured ([`CostRecord`]); the
//! formulas that predict them stand with the techniques, not here. [`Verification`] is the JSON that `verify` writes, [`Play`] that of `play`.

mod play;
mod record;
mod stats;
mod verification;

pub use play::{CapacityEvent, HITCH_FACTOR, Held, Hitch, PlanEvent, Play, PlayMemory, Played};
pub use record::{
    Buffer, CostRecord, Counters, DeviceRecord, Difference, Memory, PSNR_IDENTICAL_DB, Pass, ProcessRecord,
    Run, RunResult, SCHEMA, SceneRecord, SettingsRecord, Status,
};
pub use stats::{Distribution, Spread};
pub use verification::{Finding, LeftOut, Margin, Probes, Verification};

pub use afterlight_roles::{BufferRole, PassRole, PassWork};
