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
        /// The device where the scene has many draws, else the host: two dispatches took 0.03 ms of a frame
        /// of few draws, of which the host was spared 0.01.
        Auto = "auto",
        /// The device, by two dispatches before the first pass: the host's time does not grow with the number of draws. It sorts
        /// triangles with alpha blending as well.
        Gpu = "gpu",
        /// The host, which writes indirect commands for each view.
        Cpu = "cpu",
    }
}

/// Most draws that the host chooses of its own accord: 100,000 took it 6.4 ms a frame.
const DRAWS_ON_HOST_MAX: usize = 2048;
/// Most triangles with alpha blending that it sorts so: 40,000 took it 1.4 ms a frame.
const BLENDED_ON_HOST_MAX: usize = 4096;

impl CullOn {
    /// Whether the device chooses the draws of a scene with so many.
    pub const fn chooses_on_device(self, draws: usize) -> bool {
        self.is_device(draws, DRAWS_ON_HOST_MAX)
    }

    /// Whether the device sorts so many triangles with alpha blending.
    pub const fn sorts_on_device(self, triangles: usize) -> bool {
        self.is_device(triangles, BLENDED_ON_HOST_MAX)
    }

    const fn is_device(self, found: usize, on_host_max: usize) -> bool {
        match self {
            Self::Auto => found > on_host_max,
            Self::Gpu => true,
            Self::Cpu => false,
        }
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
        cull_on: CullOn = CullOn::Auto, "cull-on";
        /// draws whose bounds are smaller than so many pixels across are left out, which changes the picture; 0 leaves out none
        cull_px: f32 = 0.0, "cull-px", 0.0..=64.0;
        /// order of draws: by the nearest point or the centre of their bounds, or as in the scene
        order: DrawOrder = DrawOrder::Center, "order";
    }
}
