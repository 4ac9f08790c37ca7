//! Parameters of `forward-plus`.

/// Those of tiles alone.
pub type ForwardPlusParams = super::clusters::TileParams;
