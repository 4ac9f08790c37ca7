//! Parameters of `light-list`.

/// Those of the lists of lights alone.
pub type LightListParams = super::light_lists::LightListParams;
