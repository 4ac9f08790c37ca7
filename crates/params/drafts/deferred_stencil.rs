//! Parameters of `deferred-stencil`.

/// It has none of its own.
pub type DeferredStencilParams = afterlight_params::NoParams;
