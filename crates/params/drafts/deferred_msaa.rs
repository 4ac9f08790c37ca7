//! Parameters of `deferred-msaa`.

use afterlight_params::parameters;

use super::clusters::CellParams;
use super::light_step::{LightParams, LightStepParams};

parameters! {
    /// Parameters of `deferred-msaa`.
    pub struct DeferredMsaaParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl DeferredMsaaParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
