//! Parameters of `dais-list`.

use afterlight_frame::params::{AutoOr, parameters};
use afterlight_stages::{
    lights::{
        cells::CellParams,
        step::{LightParams, LightStepParams},
    },
    surfaces::triangles::RecordParams,
};

use crate::dais::{CacheParams, RateParams};

parameters! {
    /// Parameters of `dais-list`.
    pub struct DaisListParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// nodes of the lists; auto: as many as the view needs, counted; fixed: what finds none is dropped and told
        nodes: AutoOr<u32> = AutoOr::Auto, "nodes", 0..=(1 << 30);
        /// horizontal bands of the image that are drawn one after another, so that depth at the samples is held for one of them
        bands: u32 = 4, "bands", 1..=16;
        /// The cache through which fragments store triangles.
        ..cache: CacheParams;
        /// What is stored of a triangle.
        ..record: RecordParams;
        /// At what rate indirect light is shaded.
        ..rate: RateParams = RateParams::FULL;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl DaisListParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
