//! Parameters of `tiled`.

/// It has none of its own.
pub type TiledParams = afterlight_params::NoParams;
