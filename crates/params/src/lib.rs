//! Typed parameters: one declaration of a struct gives what a command line, a file, a record and a panel of widgets need.
//!
//! [`parameters!`] declares a struct whose fields are plain Rust values, and implements [`ParamSet`] for it: what parameters there
//! are, with ranges, defaults and summaries, and how each is set and told as text. [`choices!`] declares an enum whose variants
//! have names. [`Params`] holds sets of any type, and gives them back by type. What renders reads fields; text is
//! parsed once, where it comes in.
//!
//! ```
//! use afterlight_params::{AutoOr, Params, choices, parameters};
//!
//! choices! {
//!     /// Who fills a buffer.
//!     pub enum Fill {
//!         /// Whoever is faster.
//!         Auto = "auto",
//!         /// A pass in compute.
//!         Resolve = "resolve",
//!     }
//! }
//!
//! parameters! {
//!     /// What a stage can be asked for.
//!     pub struct StageParams {
//!         /// width and height of a tile, pixels
//!         tile_px: u32 = 16, "tile-px", 8..=256;
//!     }
//! }
//!
//! parameters! {
//!     /// Parameters of a technique.
//!     pub struct ExampleParams {
//!         /// who fills the buffer
//!         fill: Fill = Fill::Auto, "fill";
//!         /// nodes of the lists; auto: as many as the view needs
//!         nodes: AutoOr<u32> = AutoOr::Auto, "nodes", 0..=(1 << 30);
//!         /// Those of a stage that it uses.
//!         ..stage: StageParams;
//!     }
//! }
//!
//! let mut params = Params::of(ExampleParams::default());
//! params.set("fill", "resolve").expect("a name of `Fill`");
//! params.set("tile-px", "32").expect("in range");
//! assert_eq!(params.typed::<ExampleParams>().fill, Fill::Resolve);
//! assert_eq!(params.typed::<StageParams>().tile_px, 32);
//! let error = params.set("tile-px", "2").expect_err("out of range");
//! assert_eq!(error.to_string(), r#"parameter tile-px: found "2", expected a whole number from 8 to 256"#);
//! ```

mod choice;
mod declare;
mod info;
mod options;
mod params;
mod set;
mod value;

pub use choice::{Choice, Words};
pub use info::{ParamInfo, ParamKind};
pub use options::{OptionInfo, options};
pub use params::Params;
pub use set::{NoParams, ParamError, ParamSet};
pub use value::{AutoOr, Limits, Numeric, ParamValue};

#[doc(hidden)]
pub mod macro_support {
    //! What the macros of this crate expand to.
    pub use crate::value::{capitals, read, tell, text};
    pub use serde;
}
