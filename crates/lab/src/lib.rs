//! The laboratory: a scene on a device with a view of it, techniques with their parameters, frames that are measured one after
//! another or in turn, images compared.
//!
//! A [`FrameSpec`] says what to draw and where; a [`Session`] is that scene on that device; [`measure`] and [`measure_in_turn`]
//! draw frames of [`Chosen`] techniques and return run records; [`compare`] does so for several and judges their images;
//! [`verify`](verify::verify) does so from views that it draws at random. A
//! [`Listener`] hears how far work is: nothing here prints.
//!
//! ```no_run
//! use afterlight_lab::{FrameSpec, Session, Silent, choose, compare};
//! # fn main() -> Result<(), afterlight_lab::LabError> {
//! let spec = FrameSpec { width: 640, height: 360, lights: 100, ..FrameSpec::default() };
//! let session = Session::open("builtin:colonnade", &spec, false, &Silent)?;
//! let chosen = choose("techniques", &["tiled".into(), "deferred".into()], &spec.set)?;
//! let reference = choose("reference", &["forward".into()], &[])?.remove(0);
//! let compared = compare(&session, &spec, &chosen, reference, 5, &Silent)?;
//! for result in &compared.run.results {
//!     println!("{}: {:?}", result.technique, result.frame_ms);
//! }
//! session.finish(&spec, &Silent)?;
//! # Ok(()) }
//! ```

mod chosen;
mod compare;
mod conclusion;
mod differences;
mod effects;
mod error;
mod listener;
pub mod play;
mod session;
mod setup;
pub mod spec;
mod trial;
mod turns;
pub mod verify;

pub use chosen::{Chosen, choose, technique};
pub use compare::{Compared, check_samples_of, compare, failure, most_fragments};
pub use conclusion::{Conclusion, TIME_FACTOR};
pub use differences::differences;
pub use error::LabError;
pub use listener::{Listener, Silent, Task};
pub use play::{PlaySpec, play};
pub use session::{Session, StartUp, ms_since, open_device};
pub use setup::{Setup, budget_bytes, measure_setups, renderer_with};
pub use spec::FrameSpec;
pub use trial::{Entrant, InTurn, Measured, measure, measure_and, measure_in_turn};
