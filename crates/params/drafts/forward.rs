//! Parameters of `forward`.

/// It has none of its own.
pub type ForwardParams = afterlight_params::NoParams;
