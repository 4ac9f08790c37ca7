//! Parameters of the stage that rasterises in compute.

use afterlight_frame::params::{choices, parameters};

choices! {
    /// Who finds the triangles that show.
    pub enum Visibility {
        /// Compute on a GPU that has 64-bit buffer atomics, else a raster pass.
        Auto = "auto",
        /// A raster pass.
        Raster = "raster",
        /// Rasterisation in compute.
        Compute = "compute",
    }
}

parameters! {
    /// Who finds the triangles of a technique that reads triangle IDs.
    #[derive(Copy)]
    pub struct ComputeRasterParams {
        /// who finds the triangles that show: a raster pass, or rasterisation in compute; auto: compute on a GPU that has 64-bit buffer atomics
        visibility: Visibility = Visibility::Auto, "visibility";
        /// visibility=compute: side in pixels below which one thread rasterises a triangle; larger ones are cut into tiles
        small_px: u32 = 16, "small-px", 1..=64;
    }
}
