//! Parameters of the stage that packs light indices into pixels.

use afterlight_frame::params::{choices, parameters};

choices! {
    /// Parts of a light's index, of 2 bits and three values each.
    pub enum IndexParts {
        /// As many as needed.
        Auto = "auto",
        /// Room for 80 lights.
        Four = "4",
        /// Room for 6,560 lights.
        Eight = "8",
        /// Room for 531,440 lights.
        Twelve = "12",
    }
}

impl IndexParts {
    /// How many there are, where that is not left open.
    pub fn count(self) -> Option<u32> {
        match self {
            Self::Auto => None,
            Self::Four => Some(4),
            Self::Eight => Some(8),
            Self::Twelve => Some(12),
        }
    }
}

parameters! {
    /// Parameters of packed light indices.
    #[derive(Copy)]
    pub struct LightIndexParams {
        /// parts of 2 bits, three values, that a light's index has: room for 80, 6,560 or 531,440 lights with an end; auto: as many as needed
        index_parts: IndexParts = IndexParts::Auto, "index-parts";
    }
}
