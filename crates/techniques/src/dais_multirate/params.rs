//! Parameters of `dais-multirate`.

use afterlight_frame::params::parameters;
use afterlight_stages::{
    lights::{
        cells::CellParams,
        step::{LightParams, LightStepParams},
    },
    surfaces::{compute_raster::ComputeRasterParams, triangles::RecordParams},
};

use crate::dais::{FillParams, RateParams};

parameters! {
    /// Parameters of `dais-multirate`.
    pub struct DaisMultirateParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// At what rate indirect light is shaded.
        ..rate: RateParams;
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

impl DaisMultirateParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
