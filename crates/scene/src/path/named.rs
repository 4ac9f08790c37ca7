//! Paths that come with the program, for scenes that are known.
//!
//! Each is a few places with the points that are looked at from there. Test `routes_keep_off_walls` measures how near they come to any
//! triangle. A file is taken for a known scene by its name and its size: a model of that name in other units has none of them.

use glam::Vec3;

use super::{CameraPath, Keyframe};
use crate::Scene;

/// A path through a scene that is known.
pub(super) struct Route {
    pub(super) name: &'static str,
    /// Beginning of the scene's name, in lower case.
    scene: &'static str,
    /// Extent of the scene, metres; known to a tenth.
    size_m: [f32; 3],
    closed: bool,
    duration_s: f64,
    near_m: f32,
    fov_deg: f32,
    /// Eyes and targets, metres, in the file's coordinates.
    places: &'static [([f64; 3], [f64; 3])],
}

const COLONNADE_M: [f32; 3] = [30.28, 8.0, 12.0];
const SPONZA_M: [f32; 3] = [29.75, 12.44, 18.3];
const SAN_MIGUEL_M: [f32; 3] = [84.75, 53.98, 73.89];

const ROUTES: &[Route] = &[
    // Along the hall on one side of the fountain, back on the other, above it.
    Route {
        name: "nave",
        scene: "builtin:colonnade",
        size_m: COLONNADE_M,
        closed: true,
        duration_s: 24.0,
        near_m: 0.05,
        fov_deg: 60.0,
        places: &[
            ([-12.0, 1.7, -0.3], [-6.0, 2.2, -0.9]),
            ([-6.0, 1.75, -0.9], [0.0, 2.2, -1.2]),
            ([-1.5, 1.8, -1.25], [4.0, 2.4, -0.6]),
            ([5.0, 1.9, -0.8], [11.0, 3.0, 1.5]),
            ([10.5, 2.3, 0.0], [12.5, 3.4, 4.0]),
            ([9.0, 3.2, 0.9], [3.0, 3.6, 2.6]),
            ([3.0, 4.2, 0.6], [-3.0, 3.0, -0.5]),
            ([-4.0, 4.0, 0.4], [-10.0, 2.4, -1.5]),
            ([-10.0, 2.6, 0.6], [-13.5, 2.4, -2.6]),
        ],
    },
    // From the end of an aisle through the arch that no drape closes, to the fountain.
    Route {
        name: "arcade",
        scene: "builtin:colonnade",
        size_m: COLONNADE_M,
        closed: false,
        duration_s: 14.0,
        near_m: 0.05,
        fov_deg: 62.0,
        places: &[
            ([-12.8, 1.75, -4.8], [-8.4, 2.2, -3.4]),
            ([-10.6, 1.7, -4.6], [-7.0, 2.1, -1.6]),
            ([-9.4, 1.7, -3.9], [-7.2, 2.0, 0.4]),
            ([-9.1, 1.7, -2.8], [-6.0, 2.0, 1.2]),
            ([-8.0, 1.75, -1.3], [-2.5, 2.2, 1.2]),
            ([-5.6, 1.8, 0.4], [-0.2, 2.0, 0.2]),
            ([-2.9, 1.9, 1.4], [0.6, 1.6, -0.4]),
        ],
    },
    // Along the hall under the banners, back a storey higher between them.
    Route {
        name: "nave",
        scene: "sponza",
        size_m: SPONZA_M,
        closed: true,
        duration_s: 24.0,
        near_m: 0.05,
        fov_deg: 60.0,
        places: &[
            ([-8.5, 1.7, -0.3], [-3.5, 2.0, -0.5]),
            ([-3.0, 1.8, -0.5], [2.5, 2.6, -1.2]),
            ([2.5, 2.0, -0.5], [7.0, 3.4, 0.6]),
            ([7.2, 2.3, -0.3], [9.5, 3.6, 3.0]),
            ([5.0, 2.9, 0.0], [0.0, 3.4, 1.6]),
            ([0.0, 3.8, -0.2], [-5.0, 4.0, -0.4]),
            ([-4.6, 3.2, -0.2], [-9.5, 2.8, -2.0]),
            ([-7.4, 2.2, -0.2], [-10.5, 2.0, -2.6]),
            ([-8.8, 1.8, -0.25], [-8.4, 1.9, -4.4]),
        ],
    },
    // Around the hall behind its columns, at the height of a person's eyes.
    Route {
        name: "aisles",
        scene: "sponza",
        size_m: SPONZA_M,
        closed: true,
        duration_s: 32.0,
        near_m: 0.05,
        fov_deg: 60.0,
        places: &[
            ([-9.0, 1.7, -3.6], [-4.0, 1.9, -3.7]),
            ([-4.0, 1.7, -3.65], [1.0, 1.9, -3.5]),
            ([2.0, 1.7, -3.65], [7.0, 1.9, -3.5]),
            ([7.4, 1.7, -3.6], [9.4, 1.8, -1.2]),
            ([8.7, 1.7, -2.2], [9.0, 1.9, 2.4]),
            ([8.8, 1.7, 0.2], [7.4, 1.8, 3.4]),
            ([8.5, 1.7, 2.2], [4.4, 1.8, 3.4]),
            ([7.2, 1.7, 3.0], [2.0, 1.9, 3.1]),
            ([2.0, 1.7, 3.05], [-3.0, 1.9, 2.9]),
            ([-4.0, 1.7, 3.05], [-9.0, 1.9, 2.9]),
            ([-8.6, 1.7, 2.95], [-10.2, 1.8, 0.8]),
            ([-9.6, 1.7, 1.6], [-9.6, 1.9, -2.6]),
            ([-9.7, 1.7, -0.8], [-8.4, 1.8, -4.4]),
            ([-9.6, 1.7, -2.6], [-6.4, 1.8, -4.0]),
        ],
    },
    // Around the courtyard, above its tables.
    Route {
        name: "courtyard",
        scene: "san_miguel",
        size_m: SAN_MIGUEL_M,
        closed: false,
        duration_s: 22.0,
        near_m: 0.05,
        fov_deg: 62.0,
        places: &[
            ([8.8, 3.6, 1.7], [15.0, 3.0, 4.0]),
            ([13.6, 3.7, 1.5], [20.0, 3.0, 4.6]),
            ([19.0, 3.8, 2.0], [20.6, 3.0, 8.0]),
            ([20.6, 3.7, 5.2], [14.0, 2.8, 8.0]),
            ([20.2, 3.6, 8.8], [13.0, 2.8, 7.4]),
            ([17.6, 3.6, 11.2], [12.0, 3.0, 6.0]),
            ([13.6, 3.7, 11.5], [12.4, 3.2, 4.0]),
            ([9.4, 3.7, 11.5], [14.0, 3.0, 3.0]),
        ],
    },
    // From the passage into the courtyard.
    Route {
        name: "entrance",
        scene: "san_miguel",
        size_m: SAN_MIGUEL_M,
        closed: false,
        duration_s: 14.0,
        near_m: 0.05,
        fov_deg: 60.0,
        places: &[
            ([31.0, 1.7, 2.2], [24.0, 1.7, 2.0]),
            ([27.0, 1.7, 2.1], [20.0, 1.8, 2.4]),
            ([23.5, 1.75, 2.0], [17.0, 2.0, 3.6]),
            ([20.6, 2.3, 2.3], [14.0, 2.4, 5.4]),
            ([17.6, 3.1, 3.0], [12.0, 2.8, 7.0]),
            ([15.4, 3.6, 4.2], [10.4, 3.0, 8.4]),
        ],
    },
];

/// The routes through a scene.
pub(super) fn of(scene: &Scene) -> impl Iterator<Item = &'static Route> {
    let name = scene.name.to_ascii_lowercase();
    let size_m = scene.bounds_ws().size();
    ROUTES.iter().filter(move |route| {
        let expected_m = Vec3::from(route.size_m);
        name.starts_with(route.scene) && (size_m - expected_m).abs().cmple(0.1 * expected_m).all()
    })
}

impl Route {
    pub(super) fn path(&self, scene: &Scene) -> CameraPath {
        let key = |(eye_ws, target_ws): &([f64; 3], [f64; 3])| Keyframe {
            eye_ws: *eye_ws,
            target_ws: Some(*target_ws),
            fov_deg: self.fov_deg,
            ..Keyframe::default()
        };
        let keyframes = self.places.iter().map(key).collect();
        let duration_s = Some(self.duration_s);
        CameraPath::of_keyframes(self.name, self.near_m, self.closed, duration_s, keyframes).through(scene)
    }
}
