//! Clustered light culling: which lights touch a part of the view, a tile between two view distances, decided in f64.
//!
//! A light's sphere touches a cluster where it meets the box around the cluster along the camera's axes and is outside of none of
//! the four planes at its sides: each lets pass some that the other does not, at the corners, neither misses one.

use afterlight_scene::{Camera, Light, LightKind};
use glam::{DMat4, DVec2, DVec3, DVec4};

use crate::tiles::{Decision, TileView, world_from_view};

/// A view divided into clusters.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusterView {
    clip_from_world: DMat4,
    world_from_clip: DMat4,
    view_from_world: DMat4,
    /// Width and height of the image, pixels.
    pub size_px: [u32; 2],
    /// Width and height of a tile, pixels.
    pub cluster_px: u32,
    /// View distances at which slices begin and the last ends, m, ascending, at least two.
    pub begins_m: Vec<f64>,
}

/// View distances at which slices begin, and the last ends: in equal steps, or at equal ratios (Olsson et al. 2012, section 3.1)
/// from at least 10⁻⁴ of the farthest distance.
pub fn slice_begins_m(range_m: [f64; 2], slices: u32, logarithmic: bool) -> Vec<f64> {
    let [near_m, far_m] = range_m;
    let first_m = near_m.max(1e-4 * far_m);
    let begin = |k: u32| {
        let share = f64::from(k) / f64::from(slices);
        match k {
            0 => near_m,
            k if k == slices => far_m,
            _ if logarithmic => first_m * (far_m / first_m).powf(share),
            _ => near_m + share * (far_m - near_m),
        }
    };
    (0..=slices).map(begin).collect()
}

impl ClusterView {
    /// The view of a camera.
    pub fn new(camera: &Camera, size_px: [u32; 2], cluster_px: u32, begins_m: Vec<f64>) -> Self {
        let clip_from_world = TileView::new(camera, size_px[0], size_px[1]).clip_from_world;
        Self {
            clip_from_world,
            world_from_clip: clip_from_world.inverse(),
            view_from_world: world_from_view(camera).inverse(),
            size_px,
            cluster_px,
            begins_m,
        }
    }

    /// World to clip space.
    pub fn clip_from_world(&self) -> DMat4 {
        self.clip_from_world
    }

    /// Slices of a tile.
    pub fn slices(&self) -> u32 {
        self.begins_m.len() as u32 - 1
    }

    /// Number of the cluster that holds what a pixel shows at a view distance within the grid: tile × slices + slice, tiles by
    /// rows, the slice the last that begins at the distance or before.
    pub fn cluster(&self, pixel: [u32; 2], distance_m: f64) -> u32 {
        let [x, y] = pixel.map(|v| v / self.cluster_px);
        let inner = &self.begins_m[1..self.begins_m.len() - 1];
        let slice = inner.iter().filter(|begin_m| **begin_m <= distance_m).count() as u32;
        (y * self.size_px[0].div_ceil(self.cluster_px) + x) * self.slices() + slice
    }

    /// Corners of a cluster in view space: left and right, top and bottom, near and far, in this order from the slowest.
    fn corners_vs(&self, cluster: u32) -> [DVec3; 8] {
        let (low, high) = self.tile_ndc(cluster);
        let slice = (cluster % self.slices()) as usize;
        let ends_m = [self.begins_m[slice], self.begins_m[slice + 1]];
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
            let ndc = DVec2::new(pick(4, low.x, high.x), pick(2, low.y, high.y));
            self.point_vs(ndc, pick(1, ends_m[0], ends_m[1]))
        })
    }

    /// Normalised device coordinates of a tile's corners.
    fn tile_ndc(&self, cluster: u32) -> (DVec2, DVec2) {
        let across = self.size_px[0].div_ceil(self.cluster_px);
        let tile = cluster / self.slices();
        let first = [tile % across, tile / across].map(|t| t * self.cluster_px);
        let ndc = |px: [u32; 2]| {
            let [x, y] = [0, 1]
                .map(|i| 2.0 * f64::from(px[i].min(self.size_px[i])) / f64::from(self.size_px[i]) - 1.0);
            DVec2::new(x, y)
        };
        (ndc(first), ndc(first.map(|v| v + self.cluster_px)))
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

    /// Decides on every light for a cluster.
    pub fn cull(&self, cluster: u32, lights: &[Light]) -> Vec<Decision> {
        let corners = self.corners_vs(cluster);
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let planes = self.side_planes(cluster);
        let decide = |light: &Light| {
            if light.kind == LightKind::Directional || !light.range_m.is_finite() {
                return Decision { passes: true, slack_m: f64::INFINITY };
            }
            let (center_ws, range_m) = (light.position_ws.as_dvec3().extend(1.0), f64::from(light.range_m));
            let center_vs = (self.view_from_world * center_ws).truncate();
            let to_box_m = center_vs.distance(center_vs.clamp(low, high));
            let sides = planes.iter().map(|plane| plane.dot(center_ws) + range_m);
            let slack_m = sides.fold(range_m - to_box_m, f64::min);
            Decision { passes: slack_m >= 0.0, slack_m }
        };
        lights.iter().map(decide).collect()
    }

    /// The left, right, top and bottom half-spaces of a cluster: `dot(xyz, p) + w ≥ 0` inside, in metres.
    fn side_planes(&self, cluster: u32) -> [DVec4; 4] {
        let (low, high) = self.tile_ndc(cluster);
        let m = &self.clip_from_world;
        let (x, y, w) = (m.row(0), m.row(1), m.row(3));
        [x - w * low.x, w * high.x - x, y - w * low.y, w * high.y - y]
            .map(|plane| plane / plane.truncate().length())
    }
}
