//! What geometry leaves behind of the surfaces that show, and how they are shaded from it.

pub mod claims;
pub mod compute_raster;
pub mod depth_first;
pub mod gbuffer;
pub mod geometry;
mod radiance_target;
pub mod samples;
pub mod shade;
pub mod triangles;
pub mod velocity;
pub mod visible;

pub use radiance_target::RadianceTarget;
