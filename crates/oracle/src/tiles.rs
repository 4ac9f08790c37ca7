//! Tiled light culling: which lights touch a tile's part of the view, decided in f64.
//!
//! A tile is 16 × 16 pixels with the range of view distances that its surfaces have. Its side planes are rows of the matrix
//! world → clip combined, each divided by the length of its normal; they are those of the whole tile even
//! where the image's border cuts it. A light's sphere passes a plane where its centre is not further outside than its
//! range: a test of six half-spaces, which lets pass some spheres at the corners but misses none.

use afterlight_scene::{Camera, Light, LightKind};
use glam::{DMat4, DVec3, DVec4};

/// Width and height of a tile, pixels.
pub const TILE_SIZE_PX: u32 = 16;

/// A view, as far as tiles need it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileView {
    /// World to clip space.
    pub clip_from_world: DMat4,
    /// View distance of p, metres along the view direction: `dot(xyz, p) + w`.
    pub distance_from_world: DVec4,
    /// Width of the image, pixels.
    pub width_px: u32,
    /// Height of the image, pixels.
    pub height_px: u32,
}

/// What a tile decides on a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Whether the light is on the tile's list: `slack_m ≥ 0`.
    pub passes: bool,
    /// The least of the six tests, metres: how much smaller the range could be (where positive) or would have to be greater
    /// (where negative) for the other decision. Decisions with a slack within the rounding of 32-bit arithmetic may differ on a
    /// device. Infinite for lights without an end.
    pub slack_m: f64,
}

impl TileView {
    /// The view of a camera for an image.
    pub fn new(camera: &Camera, width_px: u32, height_px: u32) -> Self {
        let aspect = width_px as f32 / height_px as f32;
        let view_from_world = world_from_view(camera).inverse();
        let clip_from_view = camera.clip_from_view(aspect).as_dmat4();
        Self {
            clip_from_world: clip_from_view * view_from_world,
            distance_from_world: -view_from_world.row(2),
            width_px,
            height_px,
        }
    }

    /// Tiles across and down.
    pub fn tile_counts(&self) -> [u32; 2] {
        [self.width_px.div_ceil(TILE_SIZE_PX), self.height_px.div_ceil(TILE_SIZE_PX)]
    }

    /// The left, right, top and bottom half-spaces of a tile: `dot(xyz, p) + w ≥ 0` inside, in metres.
    pub fn side_planes(&self, tile: [u32; 2]) -> [DVec4; 4] {
        let ndc = |i: u32, size: u32| f64::from(i) * 2.0 * f64::from(TILE_SIZE_PX) / f64::from(size) - 1.0;
        let (left, right) = (ndc(tile[0], self.width_px), ndc(tile[0] + 1, self.width_px));
        let (top, bottom) = (ndc(tile[1], self.height_px), ndc(tile[1] + 1, self.height_px));
        let m = &self.clip_from_world;
        let (x, y, w) = (m.row(0), m.row(1), m.row(3));
        [x - w * left, w * right - x, y - w * top, w * bottom - y]
            .map(|plane| plane / plane.truncate().length())
    }

    /// Decides on every light for a tile whose surfaces lie between two view distances; no light where it has no surface.
    pub fn cull(&self, tile: [u32; 2], distances_m: Option<[f64; 2]>, lights: &[Light]) -> Vec<Decision> {
        let planes = self.side_planes(tile);
        let decide = |light: &Light| {
            let Some([nearest_m, farthest_m]) = distances_m else {
                return Decision { passes: false, slack_m: f64::NEG_INFINITY };
            };
            if light.kind == LightKind::Directional || !light.range_m.is_finite() {
                return Decision { passes: true, slack_m: f64::INFINITY };
            }
            let (center, range_m) = (light.position_ws.as_dvec3().extend(1.0), f64::from(light.range_m));
            let distance_m = self.distance_from_world.dot(center);
            let sides = planes.iter().map(|plane| plane.dot(center) + range_m);
            let depths = [distance_m + range_m - nearest_m, farthest_m - (distance_m - range_m)];
            let slack_m = sides.chain(depths).fold(f64::INFINITY, f64::min);
            Decision { passes: slack_m >= 0.0, slack_m }
        };
        lights.iter().map(decide).collect()
    }

    /// The range of view distances of every tile, row by row, from that of every pixel; `None` where nothing is seen.
    pub fn distance_bounds(&self, pixel_distances_m: &[Option<f64>]) -> Vec<Option<[f64; 2]>> {
        let [across, down] = self.tile_counts();
        let mut bounds: Vec<Option<[f64; 2]>> = vec![None; across as usize * down as usize];
        for (i, distance_m) in pixel_distances_m.iter().enumerate() {
            let Some(z) = *distance_m else { continue };
            let (x, y) = (i as u32 % self.width_px, i as u32 / self.width_px);
            let tile = (y / TILE_SIZE_PX * across + x / TILE_SIZE_PX) as usize;
            let [low, high] = bounds[tile].unwrap_or([z, z]);
            bounds[tile] = Some([low.min(z), high.max(z)]);
        }
        bounds
    }
}

/// Whether a light sends any light to a point: what culling must never miss. A spot's cone counts.
pub fn light_reaches(light: &Light, point_ws: DVec3) -> bool {
    crate::brdf::illuminance(light, point_ws).0.max_element() > 0.0
}

/// Camera to world, widened.
pub(crate) fn world_from_view(camera: &Camera) -> DMat4 {
    DMat4::from(camera.world_from_view.as_daffine3())
}
