//! From a scene, a view of it and any technique to an image.
//!
//! The renderer knows stages, which compose every frame (shadows, indirect light, transparency, filters, the tone map), and no technique: it is
//! given one as a `&dyn Technique`, which brings its own shaders.

mod ahead;
mod before;
mod chain;
mod embedded;
mod flight;
mod pose;
mod prepared;
mod renderer;
pub mod supersample;

pub use ahead::Ahead;
pub use embedded::Embedded;
pub use flight::{Done, Event, Flight, FlightOptions, FrameContext, Shortfall};
pub use pose::{PosedBounds, ScenePose};
pub use prepared::{Prepared, StoredDepth};
pub use renderer::Renderer;
