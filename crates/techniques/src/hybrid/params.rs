//! Parameters of `hybrid`.

use afterlight_frame::params::{choices, parameters};

choices! {
    /// Which path draws take.
    pub enum PathChoice {
        /// The one that is predicted to read and write less.
        Predicted = "predicted",
        /// Deferred shading for all.
        Deferred = "deferred",
        /// The light pre-pass for all.
        Prepass = "prepass",
    }
}

parameters! {
    /// Parameters of `hybrid`.
    #[derive(Copy)]
    pub struct HybridParams {
        /// path of each draw: the one that is predicted to read and write less, or one for all
        path: PathChoice = PathChoice::Predicted, "path";
        /// factor on the traffic that is predicted for a draw on the light pre-pass path: below 1 more draws take it
        prepass_weight: f32 = 1.0, "prepass-weight", 0.0..=1000.0;
    }
}
