//! What the cost model of Petrescu et al. 2016 predicts from: its symbols, counted for a scene and a view.
//!
//! The formulas stand with the techniques ([`Technique::predict`](afterlight_techniques::Technique::predict)). Nothing here
//! opens a device.

mod workload;

pub use workload::{of_view, vertices};
