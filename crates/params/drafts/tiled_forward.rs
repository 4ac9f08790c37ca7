//! Parameters of `tiled-forward`.

/// Those of tiles alone.
pub type TiledForwardParams = super::clusters::TileParams;
