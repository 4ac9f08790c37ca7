//! Parameters of `dais`.

use afterlight_frame::params::{choices, parameters};
use afterlight_stages::{
    lights::{
        cells::CellParams,
        step::{LightParams, LightStepParams},
    },
    surfaces::{compute_raster::ComputeRasterParams, triangles::RecordParams},
};

choices! {
    /// Who fills the triangle buffer.
    pub enum Fill {
        /// Compute, fragments where surfaces are tessellated.
        Auto = "auto",
        /// Compute over a finished visibility buffer.
        Resolve = "resolve",
        /// Fragments through a memoization cache after a depth pre-pass (the paper's).
        Cache = "cache",
    }
}

parameters! {
    /// Size of the memoization cache.
    #[derive(Copy)]
    pub struct CacheParams {
        /// buckets of two entries in the memoization cache through which fragments store triangles
        buckets: u32 = 8192, "cache-buckets", 1..=(1 << 16);
    }
}

parameters! {
    /// How the triangle buffer is filled.
    #[derive(Copy)]
    pub struct FillParams {
        /// who fills the triangle buffer: compute over a finished visibility buffer, or fragments through a memoization cache after a depth pre-pass (the paper's); auto: compute, fragments where surfaces are tessellated
        fill: Fill = Fill::Auto, "fill";
        /// The cache that fragments fill it through.
        ..cache: CacheParams;
        /// fill=cache: bits of the reference in a visibility sample that holds coverage as well; where triangles need more, samples hold 32 bits of reference and no coverage
        reference_bits: u32 = 24, "reference-bits", 8..=24;
    }
}

parameters! {
    /// Parameters of `dais`.
    pub struct DaisParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// How the triangle buffer is filled.
        ..fill: FillParams;
        /// What is stored of a triangle.
        ..record: RecordParams;
        /// Who finds the triangles.
        ..raster: ComputeRasterParams;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl DaisParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
