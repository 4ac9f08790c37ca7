//! Parameters of `deferred-ssaa`.

use afterlight_params::parameters;

use super::clusters::CellParams;
use super::light_step::{LightParams, LightStepParams};

parameters! {
    /// Parameters of `deferred-ssaa`.
    pub struct DeferredSsaaParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl DeferredSsaaParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
