//! Light culling by cells: which lights touch a part of the view, a tile between two view distances, decided in f64.
//!
//! The sphere around what a light reaches touches a cell where it meets the box around the cell along the camera's axes and is outside
//! of none of the four planes at its sides. At corners each test rejects spheres that the other would pass; neither misses a light that
//! touches the cell. The cone of a spot light must also come within the radius of the sphere around the cell's corners.

use afterlight_scene::{Camera, Light, LightKind};
use glam::{DMat4, DVec2, DVec3, DVec4};

use crate::tiles::{Decision, TileView, world_from_view};

/// A view divided into tiles, each cut at view distances.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusterView {
    clip_from_world: DMat4,
    world_from_clip: DMat4,
    view_from_world: DMat4,
    /// Width and height of the image, pixels.
    pub size_px: [u32; 2],
    /// Width and height of a tile, pixels.
    pub tile_px: u32,
}

/// A part of the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Number of its tile, by rows.
    pub tile: u32,
    /// Nearest and farthest view distance, m.
    pub range_m: [f64; 2],
    /// A bit for each of 32 equal steps between the two: where the light must come.
    pub steps: u32,
}

/// View distances at which slices begin, and the last ends: in equal steps, or at equal ratios (Olsson et al. 2012, section 3.1).
pub fn slice_begins_m(range_m: [f64; 2], slices: u32, logarithmic: bool) -> Vec<f64> {
    let [near_m, far_m] = range_m;
    let begin = |k: u32| {
        let share = f64::from(k) / f64::from(slices);
        match logarithmic {
            true => near_m * (far_m / near_m).powf(share),
            false => near_m + share * (far_m - near_m),
        }
    };
    (0..=slices).map(begin).collect()
}

impl ClusterView {
    /// The view of a camera.
    pub fn new(camera: &Camera, size_px: [u32; 2], tile_px: u32) -> Self {
        let clip_from_world = TileView::new(camera, size_px[0], size_px[1]).clip_from_world;
        Self {
            clip_from_world,
            world_from_clip: clip_from_world.inverse(),
            view_from_world: world_from_view(camera).inverse(),
            size_px,
            tile_px,
        }
    }

    /// World to clip space.
    pub fn clip_from_world(&self) -> DMat4 {
        self.clip_from_world
    }

    /// Number of the tile of a pixel, by rows.
    pub fn tile(&self, pixel: [u32; 2]) -> u32 {
        let [x, y] = pixel.map(|v| v / self.tile_px);
        y * self.size_px[0].div_ceil(self.tile_px) + x
    }

    /// Corners of a cell in view space: left and right, top and bottom, near and far, in this order from the slowest.
    fn corners_vs(&self, cell: &Cell) -> [DVec3; 8] {
        let (low, high) = self.tile_ndc(cell.tile);
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
            let ndc = DVec2::new(pick(4, low.x, high.x), pick(2, low.y, high.y));
            self.point_vs(ndc, pick(1, cell.range_m[0], cell.range_m[1]))
        })
    }

    /// Normalised device coordinates of a tile's corners.
    fn tile_ndc(&self, tile: u32) -> (DVec2, DVec2) {
        let across = self.size_px[0].div_ceil(self.tile_px);
        let first = [tile % across, tile / across].map(|t| t * self.tile_px);
        let ndc = |px: [u32; 2]| {
            let [x, y] = [0, 1]
                .map(|i| 2.0 * f64::from(px[i].min(self.size_px[i])) / f64::from(self.size_px[i]) - 1.0);
            DVec2::new(x, y)
        };
        (ndc(first), ndc(first.map(|v| v + self.tile_px)))
    }

    /// The point of a ray through the image that has a view distance, in view space.
    fn point_vs(&self, ndc: DVec2, distance_m: f64) -> DVec3 {
        let at = |depth: f64| {
            let p = self.world_from_clip * DVec4::new(ndc.x, ndc.y, depth, 1.0);
            (self.view_from_world * (p / p.w)).truncate()
        };
        let (a, b) = (at(1.0), at(0.5));
        a + (b - a) * ((distance_m + a.z) / (a.z - b.z))
    }

    /// Decides on every light for a cell.
    pub fn cull(&self, cell: &Cell, lights: &[Light]) -> Vec<Decision> {
        let corners = self.corners_vs(cell);
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let world_from_view = self.view_from_world.inverse();
        let corners_ws = corners.map(|p| world_from_view.transform_point3(p));
        let low_ws = corners_ws.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high_ws = corners_ws.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let (center_ws, radius_m) = (0.5 * (low_ws + high_ws), 0.5 * low_ws.distance(high_ws));
        let planes = self.side_planes(cell.tile);
        let decide = |light: &Light| {
            let Some((sphere_ws, range_m)) = bounding_sphere(light) else {
                return Decision { passes: true, slack_m: f64::INFINITY };
            };
            let center_vs = self.view_from_world.transform_point3(sphere_ws);
            let to_box_m = center_vs.distance(center_vs.clamp(low, high));
            let sides = planes.iter().map(|plane| plane.dot(sphere_ws.extend(1.0)) + range_m);
            let more = [range_m - to_steps_m(cell, -center_vs.z), radius_m - to_cone_m(light, center_ws)];
            let slack_m = sides.chain(more).fold(range_m - to_box_m, f64::min);
            Decision { passes: slack_m >= 0.0, slack_m }
        };
        lights.iter().map(decide).collect()
    }

    /// The left, right, top and bottom half-spaces of a tile: `dot(xyz, p) + w ≥ 0` inside, in metres.
    fn side_planes(&self, tile: u32) -> [DVec4; 4] {
        let (low, high) = self.tile_ndc(tile);
        let m = &self.clip_from_world;
        let (x, y, w) = (m.row(0), m.row(1), m.row(3));
        [x - w * low.x, w * high.x - x, y - w * low.y, w * high.y - y]
            .map(|plane| plane / plane.truncate().length())
    }
}

/// Centre and radius, m, of the least sphere around what a light reaches; `None` where it has no end.
fn bounding_sphere(light: &Light) -> Option<(DVec3, f64)> {
    let (apex_ws, range_m) = (light.position_ws.as_dvec3(), f64::from(light.range_m));
    let axis = light.direction_ws.as_dvec3();
    if light.kind == LightKind::Directional || !range_m.is_finite() {
        return None;
    }
    let LightKind::Spot { outer_angle_rad, .. } = light.kind else { return Some((apex_ws, range_m)) };
    let (sin, cos) = f64::from(outer_angle_rad).sin_cos();
    Some(match f64::from(outer_angle_rad) / std::f64::consts::FRAC_PI_2 {
        share if share < 0.5 => (apex_ws + axis * (0.5 * range_m / cos), 0.5 * range_m / cos),
        share if share < 1.0 => (apex_ws + axis * (range_m * cos), range_m * sin),
        _ => (apex_ws, range_m),
    })
}

/// How far a view distance is from the nearest step of a cell that is marked, m.
fn to_steps_m(cell: &Cell, distance_m: f64) -> f64 {
    let [near_m, far_m] = cell.range_m;
    let end_m = |step: u32| near_m + (far_m - near_m) * f64::from(step) / 32.0;
    let marked = (0..32).filter(|step| cell.steps >> step & 1 == 1);
    marked
        .map(|step| (distance_m - distance_m.clamp(end_m(step), end_m(step + 1))).abs())
        .fold(f64::INFINITY, f64::min)
}

/// Distance of a point from the cone of a spot light without an end, negative inside; of other lights, and of cones wider than a
/// half-space, nothing is far.
fn to_cone_m(light: &Light, point_ws: DVec3) -> f64 {
    let LightKind::Spot { outer_angle_rad, .. } = light.kind else { return f64::NEG_INFINITY };
    let (sin, cos) = f64::from(outer_angle_rad).sin_cos();
    if cos <= 0.0 {
        return f64::NEG_INFINITY;
    }
    let to_point = point_ws - light.position_ws.as_dvec3();
    let along_m = to_point.dot(light.direction_ws.as_dvec3());
    let aside_m = (to_point.length_squared() - along_m * along_m).max(0.0).sqrt();
    match along_m * cos + aside_m * sin < 0.0 {
        true => to_point.length(),
        false => aside_m * cos - along_m * sin,
    }
}
