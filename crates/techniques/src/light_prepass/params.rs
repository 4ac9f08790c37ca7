//! Parameters of `light-prepass`.

use afterlight_frame::params::{choices, parameters};

choices! {
    /// Whose light fragments take at several samples a pixel, where light is gathered once a pixel.
    pub enum EdgeLight {
        /// That of the pixel, of nine, whose surface is most like the fragment's.
        Alike = "alike",
        /// That of their own pixel, whatever surface it was gathered for (Petrescu et al. 2016, section 4.5).
        Pixel = "pixel",
    }
}

parameters! {
    /// Parameters of `light-prepass`.
    #[derive(Copy)]
    pub struct LightPrepassParams {
        /// whose light the fragments of a pixel take at several samples: that of the pixel, of their own and the eight around it, whose surface is most like theirs, or that of their own (the paper's)
        edge_light: EdgeLight = EdgeLight::Alike, "edge-light";
    }
}
