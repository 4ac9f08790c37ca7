//! CPU twins in f64; imports nothing that it checks.
//!
//! Each function here is written from its source (the glTF specification, a paper), not from the shader that it is the
//! twin of. Inputs come as the scene holds them, 32-bit, and are widened first.

pub mod brdf;
pub mod clusters;
pub mod deform;
pub mod furnace;
pub mod packing;
pub mod raster;
pub mod rsm;
pub mod shadow;
pub mod sight;
pub mod tangent;
pub mod texture;
pub mod tiles;
pub mod tonemap;
