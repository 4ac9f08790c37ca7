//! Parameters of `visibility`.

use afterlight_frame::params::parameters;
use afterlight_stages::{
    lights::{
        cells::CellParams,
        step::{LightParams, LightStepParams},
    },
    surfaces::compute_raster::ComputeRasterParams,
};

parameters! {
    /// Parameters of `visibility`.
    pub struct VisibilityParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// Who finds the triangles.
        ..raster: ComputeRasterParams;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl VisibilityParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
