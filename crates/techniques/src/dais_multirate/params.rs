//! Parameters of `dais-multirate`.

use afterlight_frame::params::{choices, parameters};
use afterlight_stages::{
    lights::{cells::CellParams, step::{LightParams, LightStepParams}},
    surfaces::compute_raster::ComputeRasterParams,
};

use crate::dais::FillParams;

choices! {
    /// Shading samples of indirect light a pixel along each axis.
    pub enum Rate {
        /// One a pixel.
        Full = "1",
        /// One for 2 × 2 pixels.
        Half = "1/2",
        /// One for 4 × 4 pixels.
        Quarter = "1/4",
        /// One for 8 × 8 pixels.
        Eighth = "1/8",
    }
}

impl Rate {
    /// Width and height of the cell of pixels that may share a sample.
    pub fn cell_px(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
            Self::Eighth => 8,
        }
    }
}

choices! {
    /// How pixels find whom they share a sample with.
    pub enum Share {
        /// Quads where there can be, else the grid.
        Auto = "auto",
        /// Pixels of a cell of the shading grid, by a memoization table.
        Grid = "grid",
        /// Quads that one triangle fills, by subgroup quad operations.
        Quads = "quads",
    }
}

parameters! {
    /// At what rate indirect light is shaded, where the technique is made for low ones.
    #[derive(Copy)]
    pub struct RateParams {
        /// shading samples of indirect light a pixel along each axis; a triangle's neighbouring pixels share one
        rate: Rate = Rate::Half, "rate";
        /// who shares a shading sample: pixels of a cell of the shading grid, by a memoization table, or quads that one triangle fills, by subgroup quad operations (rate 1/2 alone); auto: quads where there can be
        share: Share = Share::Auto, "share";
    }
}

impl RateParams {
    /// Where full rate is what is expected.
    pub const FULL: Self = Self { rate: Rate::Full, share: Share::Auto };
}

parameters! {
    /// Parameters of `dais-multirate`.
    pub struct DaisMultirateParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// At what rate indirect light is shaded.
        ..rate: RateParams;
        /// How the triangle buffer is filled.
        ..fill: FillParams;
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
