//! Parameters of the stage that lists lights for tiles and clusters.

use afterlight_frame::params::{choices, parameters};

/// Most slices: words of bits that `cells.comp.glsl` has for a tile.
const MOST_SLICES: u32 = 256;

choices! {
    /// View distances at which clusters end.
    pub enum Slicing {
        /// At equal ratios.
        Logarithmic = "logarithmic",
        /// In equal steps.
        Uniform = "uniform",
    }
}

parameters! {
    /// How tiles divide the image.
    #[derive(Copy, Eq)]
    pub struct TileParams {
        /// width and height of a tile, pixels
        tile_px: u32 = 16, "tile-px", 8..=256;
    }
}

parameters! {
    /// How clusters divide the view.
    #[derive(Copy, Eq)]
    pub struct ClusterParams {
        /// width and height of a cluster, pixels
        cluster_px: u32 = 16, "cluster-px", 8..=256;
        /// clusters of a tile, one behind the other, between the ends of the scene
        slices: u32 = 128, "slices", 1..=MOST_SLICES;
        /// view distances at which clusters end: in equal steps, or at equal ratios
        slicing: Slicing = Slicing::Logarithmic, "slicing";
    }
}

parameters! {
    /// How cells divide the view, for who has the choice among tiles and clusters.
    #[derive(Copy, Eq)]
    pub struct CellParams {
        /// Those of tiles.
        ..tiles: TileParams;
        /// Those of clusters.
        ..clusters: ClusterParams;
    }
}
