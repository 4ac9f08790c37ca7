//! Parameters of `light-prepass`.

/// It has none of its own.
pub type LightPrepassParams = afterlight_params::NoParams;
