//! Parameters of `light-list-forward`.

/// Those of the lists of lights alone.
pub type LightListForwardParams = super::light_lists::LightListParams;
