//! Parameters of `depth-prepass`.

/// It has none of its own.
pub type DepthPrepassParams = afterlight_params::NoParams;
