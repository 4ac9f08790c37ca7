//! What every technique can be asked for: which draws, in what order.

use afterlight_params::{choices, parameters};

choices! {
    /// Which draws are left out on the CPU.
    pub enum Cull {
        /// Those outside the view.
        Frustum = "frustum",
        /// None.
        None = "none",
    }
}

choices! {
    /// Order of draws, the first drawn first.
    pub enum DrawOrder {
        /// By the distance of the centre of their bounds: 17.0 M fragments of Sponza at 3840×2160 on an H200, the ID pass in
        /// 4.5 ms instead of 6.0.
        Center = "center",
        /// By the distance of the nearest point of their bounds. Failed: on Sponza at 3840×2160 on an H200 it shades 26.5 M
        /// fragments, as many as no order at all (27.0 M); large draws that reach near the eye hide little.
        Near = "near",
        /// As in the scene.
        Scene = "scene",
    }
}

parameters! {
    /// Parameters that every technique has.
    #[derive(Copy)]
    pub struct DrawParams {
        /// draws outside the view are left out on the CPU
        cull: Cull = Cull::Frustum, "cull";
        /// order of draws: by the nearest point or the centre of their bounds, or as in the scene
        order: DrawOrder = DrawOrder::Center, "order";
    }
}
