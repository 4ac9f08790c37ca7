//! Parameters of `deferred`.

use afterlight_frame::params::parameters;
use afterlight_stages::lights::{
    cells::CellParams,
    step::{GbufferLightParams, LightStepParams},
};

parameters! {
    /// Parameters of `deferred`.
    pub struct DeferredParams {
        /// Which lights a surface visits.
        ..lights: GbufferLightParams;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl DeferredParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
