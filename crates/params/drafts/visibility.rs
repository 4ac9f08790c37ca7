//! Parameters of `visibility`.

use afterlight_params::parameters;

use super::clusters::CellParams;
use super::compute_raster::ComputeRasterParams;
use super::light_step::{LightParams, LightStepParams};

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
