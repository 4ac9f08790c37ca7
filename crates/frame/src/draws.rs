//! What every technique can be asked for: which draws, in what order, and who chooses them.

use afterlight_params::{choices, parameters};

choices! {
    /// Which draws are left out.
    pub enum Cull {
        /// Those outside the view.
        Frustum = "frustum",
        /// None.
        None = "none",
    }
}

choices! {
    /// Who chooses draws and puts them in order. Both come to the same, bit by bit.
    pub enum CullOn {
        /// The device, by two dispatches before the first pass: the host's time does not grow with the number of draws.
        Gpu = "gpu",
        /// The host, which writes indirect commands for each view.
        Cpu = "cpu",
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
        /// draws outside the view are left out
        cull: Cull = Cull::Frustum, "cull";
        /// who chooses and orders draws, the device or the host; the picture is the same
        cull_on: CullOn = CullOn::Gpu, "cull-on";
        /// draws whose bounds are smaller than so many pixels across are left out, which changes the picture; 0 leaves out none
        cull_px: f32 = 0.0, "cull-px", 0.0..=64.0;
        /// order of draws: by the nearest point or the centre of their bounds, or as in the scene
        order: DrawOrder = DrawOrder::Center, "order";
    }
}
