//! From a scene, a view of it and any technique to an image.
//!
//! The renderer knows stages, which compose every frame (shadows, indirect light, transparency, filters, the tone map), and no technique: it is
//! given one as a `&dyn Technique`, which brings its own shaders.

mod renderer;
pub mod supersample;

pub use renderer::{Prepared, Renderer, StoredDepth};
