//! Parameters of `forward-multipass`.

use afterlight_frame::params::{choices, parameters};

choices! {
    /// What a light's pass covers.
    pub enum Scissor {
        /// The light's bounds on the image.
        Light = "light",
        /// All of it.
        None = "none",
    }
}

parameters! {
    /// Parameters of `forward-multipass`.
    pub struct ForwardMultipassParams {
        /// a light's pass covers the light's bounds on the image, or all of it
        scissor: Scissor = Scissor::Light, "scissor";
    }
}
