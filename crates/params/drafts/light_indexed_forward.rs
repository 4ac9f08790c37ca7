//! Parameters of `light-indexed-forward`.

/// Those of the packed light indices alone.
pub type LightIndexedForwardParams = super::light_indices::LightIndexParams;
