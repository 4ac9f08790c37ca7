//! Parameters of what reads a multisampled G-buffer.

use afterlight_frame::params::{choices, parameters};

choices! {
    /// Where surfaces are lit that are shaded a sample at a time.
    pub enum Position {
        /// At the pixel's centre.
        Center = "center",
        /// At the sample (Petrescu et al. 2016, section 4.4).
        Sample = "sample",
    }
}

choices! {
    /// Which pixels are shaded a sample at a time.
    pub enum Edges {
        /// Those whose samples hold several fragments, and those that a triangle covers in part.
        Fragments = "fragments",
        /// Those that a triangle covers in part, by centroid interpolation (Petrescu et al. 2016, section 4.4).
        Centroid = "centroid",
    }
}

parameters! {
    /// Where surfaces are lit.
    #[derive(Copy)]
    pub struct PositionParams {
        /// where surfaces are lit that are shaded a sample at a time: at the pixel's centre, as forward shading does, or at the sample (the paper's)
        position: Position = Position::Center, "position";
    }
}

parameters! {
    /// Which pixels are shaded a sample at a time.
    #[derive(Copy)]
    pub struct EdgeParams {
        /// which pixels are shaded a sample at a time: those that hold several fragments or that a triangle covers in part, or the latter alone, as the device's centroids tell (the paper's)
        edges: Edges = Edges::Fragments, "edges";
    }
}

impl PositionParams {
    /// Value of the specialization constant `AT_SAMPLES` of `source_samples.glsl`.
    pub fn at_samples(self) -> u32 {
        u32::from(self.position == Position::Sample)
    }
}

impl EdgeParams {
    /// Value of the specialization constant `COMPARES_FRAGMENTS` of `edge_mark.glsl`.
    pub fn compares_fragments(self) -> u32 {
        u32::from(self.edges == Edges::Fragments)
    }
}
