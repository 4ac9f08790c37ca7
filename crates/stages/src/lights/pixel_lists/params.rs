//! Parameters of the stage that lists lights for every pixel.

use afterlight_frame::params::{AutoOr, parameters};

/// Most nodes, below where the count on the device ends.
const MOST_NODES: u32 = 1 << 30;

parameters! {
    /// Parameters of the lists of lights.
    #[derive(Copy)]
    pub struct LightListParams {
        /// nodes of the light lists; auto: as many as the view needs, counted; fixed: what finds none is dropped and told
        nodes: AutoOr<u32> = AutoOr::Auto, "light-nodes", 0..=MOST_NODES;
    }
}
