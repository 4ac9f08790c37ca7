//! Parameters of `light-indexed`.

/// Those of the packed light indices alone.
pub type LightIndexedParams = super::light_indices::LightIndexParams;
