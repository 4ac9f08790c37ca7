//! What a pixel may show, whatever a device rounds: the judge of pictures from any view.
//!
//! A device works in 32-bit floats and snaps vertices to a fraction of a pixel, so the ray through a pixel's centre alone would call
//! right pictures wrong at every edge. A [`Sight`] is what nine rays show, through the centre and around it, each surface with the view
//! distances that its plane has between them. What none of them shows is wrong.

use afterlight_scene::{AlphaMode, Camera, Light, Projection};
use glam::{DVec2, DVec3};

use crate::brdf::shade;
use crate::raster::{Hit, Ray, RayScene, place_of, ray_through};

/// How far from a pixel's centre a device may sample, pixels along each axis: Vulkan requires vertices to be snapped to 1/16 pixel or finer
/// (`subPixelPrecisionBits` of at least 4).
const SNAP_PX: f64 = 1.0 / 16.0;

/// Rounding of a position in 32-bit floats, as a fraction of the greatest coordinate: 8 units in the last place, for the products of two
/// matrices and a sum of four terms.
const POSITION_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

/// Rounding widens the rays to more than this where the eye nearly touches a surface, pixels: such pixels are not judged.
const WIDEST_PX: f64 = 1.5;

/// Places where a device may sample a pixel, in steps of [`SNAP_PX`] from its centre, which is the first.
const OFFSETS: [[i32; 2]; 9] = [[0, 0], [-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// Light between the places may be brighter or darker than at all of them, by this fraction of what it differs among them: highlights
/// of an eye near a floor are narrower than their distance.
const BETWEEN_PLACES: f64 = 0.05;

/// Depth as a device interpolates it may be off by this, of a range of 1: 16 units in the last place of depths below 1, since the plane of a large
/// triangle is a difference of terms of that size.
const DEPTH_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

/// What the device has in a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    /// No surface.
    Nothing,
    /// A surface whose view distance is between these, metres.
    Surface([f64; 2]),
}

impl Seen {
    /// What a stored depth says, reversed, 0 for no surface: `(a z + b) / (c z + d)` is the view distance of a depth z. The range
    /// holds what rounding of depth on a device may have changed.
    pub fn of_depth(depth: f32, [a, b, c, d]: [f32; 4]) -> Seen {
        if depth == 0.0 {
            return Seen::Nothing;
        }
        let [a, b, c, d] = [a, b, c, d].map(f64::from);
        let distance_m = |z: f64| match c * z + d {
            below if below > 0.0 => (a * z + b) / below,
            _ => f64::INFINITY,
        };
        let z = f64::from(depth);
        Seen::Surface([distance_m(z + DEPTH_ROUNDING), distance_m(z - DEPTH_ROUNDING)])
    }
}

/// A surface that a pixel may show.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    /// Instance, and triangle of its mesh.
    place: (u32, u32),
    /// Least and greatest view distance of its plane at the rays, metres.
    range_m: [f64; 2],
}

/// What a pixel may show.
#[derive(Clone, Debug, PartialEq)]
pub struct Sight {
    candidates: Vec<Candidate>,
    may_be_nothing: bool,
    /// Rounding of positions, metres.
    rounding_m: f64,
    /// What every ray shows first, where that is one triangle, and the ray through the centre is in no doubt.
    certain: Option<Hit>,
    /// How far its rays are from the pixel's centre along each axis, pixels.
    reach_px: f64,
}

/// A scene seen by a camera, ready to judge pixels.
pub struct Judge<'a> {
    rays: &'a RayScene<'a>,
    camera: &'a Camera,
    size_px: [u32; 2],
    rounding_m: f64,
}

impl<'a> Judge<'a> {
    /// A view of a scene.
    pub fn new(rays: &'a RayScene<'a>, camera: &'a Camera, size_px: [u32; 2]) -> Self {
        let bounds = rays.scene().bounds_ws();
        let greatest = |v: glam::Vec3| f64::from(v.abs().max_element());
        let reach_m = if bounds.is_empty() { 0.0 } else { greatest(bounds.min).max(greatest(bounds.max)) };
        let rounding_m = POSITION_ROUNDING * (reach_m + greatest(camera.eye_ws()));
        Self { rays, camera, size_px, rounding_m }
    }

    /// What a pixel may show, row 0 on top, by nine rays; `None` where rounding moves surfaces by more than 1.5 pixels, so that nothing can
    /// be said.
    pub fn sight(&self, pixel: [u32; 2]) -> Option<Sight> {
        self.sight_by(pixel, 1)
    }

    /// The same by 289 rays, which find surfaces so thin that they pass between the nine: rods of a hundredth of a pixel, seen from far.
    pub fn close_sight(&self, pixel: [u32; 2]) -> Option<Sight> {
        self.sight_by(pixel, 8)
    }

    /// Whether a triangle shows in the pixel, at any of 256 rays, that is thinner on the screen than the grid on which a device may snap its
    /// vertices: it is drawn as another triangle then, and what is continued from it to the pixel's centre may be anything.
    pub fn shows_a_sliver(&self, pixel: [u32; 2]) -> bool {
        let places = (0..16).flat_map(|y| (0..16).map(move |x| DVec2::new(f64::from(x), f64::from(y))));
        let corner = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1]));
        let mut seen = None;
        places.into_iter().any(|place| {
            let hit =
                self.rays.first_hit(&ray_through(self.camera, corner + (place + 0.5) / 16.0, self.size_px));
            let is_new = hit.map(|hit| hit.place()) != seen;
            seen = hit.map(|hit| hit.place());
            is_new && hit.is_some_and(|hit| self.is_sliver(&hit))
        })
    }

    /// Whether the least height of a triangle on the screen is below [`SNAP_PX`]; never of one that reaches behind the eye.
    fn is_sliver(&self, hit: &Hit) -> bool {
        let corners = self.rays.corners_ws(hit).map(|corner| place_of(self.camera, corner, self.size_px));
        let [Some(a), Some(b), Some(c)] = corners else { return false };
        let longest_px = (b - a).length().max((c - b).length()).max((a - c).length());
        (b - a).perp_dot(c - a).abs() < SNAP_PX * longest_px
    }

    /// What a pixel may show by rays in so many steps from the centre to each side.
    fn sight_by(&self, pixel: [u32; 2], steps: i32) -> Option<Sight> {
        let (narrow, nearest_m) = self.around(pixel, SNAP_PX, steps);
        let widened_px = SNAP_PX + self.rounding_m / self.pixel_width_m(nearest_m.max(0.0));
        if widened_px > WIDEST_PX {
            return None;
        }
        if widened_px < 1.1 * SNAP_PX { Some(narrow) } else { Some(self.around(pixel, widened_px, steps).0) }
    }

    /// Width of a pixel at a view distance, metres.
    fn pixel_width_m(&self, distance_m: f64) -> f64 {
        let height_m = match self.camera.projection {
            Projection::Perspective { fov_y_rad, .. } => {
                2.0 * distance_m * (0.5 * f64::from(fov_y_rad)).tan()
            }
            Projection::Orthographic { half_height_m, .. } => 2.0 * f64::from(half_height_m),
        };
        height_m / f64::from(self.size_px[1])
    }

    /// What rays around a pixel's centre show, and the nearest view distance among them, metres.
    fn around(&self, pixel: [u32; 2], offset_px: f64, steps: i32) -> (Sight, f64) {
        let center = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5;
        let others = (-steps..=steps).flat_map(|y| (-steps..=steps).map(move |x| [x, y]));
        let offsets = std::iter::once([0, 0]).chain(others.filter(|offset| *offset != [0, 0]));
        let ray = |[x, y]: [i32; 2]| {
            let place = center + offset_px / f64::from(steps) * DVec2::new(f64::from(x), f64::from(y));
            self.loosened(ray_through(self.camera, place, self.size_px))
        };
        let rays: Vec<Ray> = offsets.map(ray).collect();
        let mut sight = Sight {
            candidates: Vec::new(),
            may_be_nothing: false,
            rounding_m: self.rounding_m,
            certain: None,
            reach_px: offset_px,
        };
        let mut first: Vec<Option<Hit>> = Vec::new();
        let mut is_certain = true;
        for ray in &rays {
            let hits = self.rays.surfaces(ray, |hit| self.is_doubtful(hit));
            let is_closed = hits.last().is_some_and(|hit| !self.is_doubtful(hit));
            sight.may_be_nothing |= !is_closed;
            is_certain &= hits.len() == 1 && is_closed;
            first.push(hits.first().copied());
            for hit in &hits {
                if sight.candidates.iter().all(|one| one.place != hit.place()) {
                    let range_m = self.plane_range_m(hit, &rays);
                    sight.candidates.push(Candidate { place: hit.place(), range_m });
                }
            }
        }
        let place = |hit: &Option<Hit>| hit.map(|hit| hit.place());
        is_certain &= first.windows(2).all(|pair| place(&pair[0]) == place(&pair[1]));
        sight.certain = first[0].filter(|_| is_certain);
        let nearest_m = sight.candidates.iter().map(|one| one.range_m[0]).fold(f64::INFINITY, f64::min);
        (sight, nearest_m)
    }

    /// The ray with a near plane that rounding has moved towards the eye: what lies there is doubtful, and no farther surface may be missed.
    fn loosened(&self, ray: Ray) -> Ray {
        let [near_m, far_m] = ray.range_m;
        Ray { range_m: [near_m - self.near_doubt_m(near_m), far_m + self.near_doubt_m(far_m)], ..ray }
    }

    /// How far from the near or far plane surfaces may be cut or not, metres.
    fn near_doubt_m(&self, distance_m: f64) -> f64 {
        if distance_m.is_infinite() { 0.0 } else { self.rounding_m + 1e-5 * distance_m }
    }

    /// Whether a device may show what is behind a surface instead: a masked one, whose texture it filters in its own way, and one at the near
    /// or far plane.
    fn is_doubtful(&self, hit: &Hit) -> bool {
        let (near_m, far_m) = match self.camera.projection {
            Projection::Perspective { near_m, .. } => (f64::from(near_m), f64::INFINITY),
            Projection::Orthographic { near_m, far_m, .. } => (f64::from(near_m), f64::from(far_m)),
        };
        let is_masked = matches!(self.rays.material(hit.instance).alpha_mode, AlphaMode::Mask { .. });
        is_masked
            || hit.distance_m < near_m + self.near_doubt_m(near_m)
            || hit.distance_m > far_m - self.near_doubt_m(far_m)
    }

    /// Least and greatest view distance of a hit's plane at some rays; without an end where the plane is edge-on. A plane ends at its horizon
    /// in a view with perspective alone: in one without, it goes on behind the eye.
    fn plane_range_m(&self, hit: &Hit, rays: &[Ray]) -> [f64; 2] {
        let normal_ws = self.rays.plane_normal_ws(hit);
        let point_ws = self.rays.attributes(hit).position_ws;
        let has_horizon = matches!(self.camera.projection, Projection::Perspective { .. });
        let mut range_m = [hit.distance_m; 2];
        for ray in rays {
            let along = normal_ws.dot(ray.direction_ws);
            let distance_m = normal_ws.dot(point_ws - ray.origin_ws) / along;
            if !distance_m.is_finite() || (has_horizon && distance_m <= 0.0) {
                range_m[1] = f64::INFINITY;
                continue;
            }
            range_m = [range_m[0].min(distance_m), range_m[1].max(distance_m)];
        }
        range_m
    }

    /// Whether no other surface is as near as a hit, as coplanar ones are: which of them shows is decided by the order of draws.
    fn is_alone(&self, hit: &Hit, ray: &Ray) -> bool {
        let is_hit = |one: &Hit| one.place() == hit.place();
        let range_m = [ray.range_m[0], hit.distance_m * (1.0 + 1e-3)];
        let near = self.rays.surfaces(&Ray { range_m, ..*ray }, is_hit);
        let slack_m = 2.0 * self.rounding_m + 1e-5 * hit.distance_m;
        near.iter().all(|one| is_hit(one) || (one.distance_m - hit.distance_m).abs() > slack_m)
    }

    /// Linear radiance that a pixel may have, least and greatest of each channel, where a sight is certain of its surface and the surface
    /// has no texture: its centre is shaded, and places around it for highlights that are narrower than a pixel. `None` where nothing can
    /// be said. Without shadows and indirect light.
    pub fn radiance(&self, sight: &Sight, pixel: [u32; 2], lights: &[Light]) -> Option<[DVec3; 2]> {
        let hit = sight.certain.filter(|hit| self.rays.material(hit.instance).textures().next().is_none())?;
        let center = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5;
        let ambient = self.rays.scene().environment.ambient_radiance.as_dvec3();
        let mut range: Option<[DVec3; 2]> = None;
        for [x, y] in OFFSETS {
            let offset = DVec2::new(f64::from(x), f64::from(y));
            let ray = ray_through(self.camera, center + sight.reach_px * offset, self.size_px);
            if !self.rays.layers(&ray, hit.distance_m * (1.0 + 1e-3)).is_empty() {
                return None;
            }
            if !self.is_alone(&hit, &ray) {
                return None;
            }
            let hit = self.rays.first_hit(&ray).filter(|one| one.place() == hit.place())?;
            let surface = self.rays.surface(&hit);
            if surface.normal_ws.length_squared() < 0.5 {
                return None;
            }
            let found = shade(&surface, -ray.direction_ws.normalize(), lights, ambient);
            let [least, most] = range.unwrap_or([found; 2]);
            range = Some([least.min(found), most.max(found)]);
        }
        range.map(|[least, most]| {
            let between = BETWEEN_PLACES * (most - least);
            [least - between, most + between]
        })
    }
}

impl Sight {
    /// Whether every ray shows the same triangle first, in no doubt, or none shows any: what the pixel shows does not depend on how a device
    /// snaps vertices and filters masks.
    pub fn is_decided(&self) -> bool {
        self.certain.is_some() || self.candidates.is_empty()
    }

    /// Whether a device may have this in the pixel.
    pub fn accepts(&self, seen: Seen) -> bool {
        let Seen::Surface([near_m, far_m]) = seen else { return self.may_be_nothing };
        // Interpolation of a plane rounds by about 10 units in the last place of a distance.
        let slack_m = |distance_m: f64| self.rounding_m + 1e-6 * distance_m.abs();
        self.candidates.iter().any(|one| {
            let [least_m, most_m] = one.range_m;
            near_m <= most_m + slack_m(most_m) && far_m >= least_m - slack_m(least_m)
        })
    }

    /// What it would accept, for people.
    pub fn text(&self) -> String {
        let surface = |one: &Candidate| {
            format!(
                "triangle {} of instance {} at {:.6} to {:.6} m",
                one.place.1, one.place.0, one.range_m[0], one.range_m[1]
            )
        };
        let mut parts: Vec<String> = self.candidates.iter().take(3).map(surface).collect();
        if self.may_be_nothing {
            parts.push("no surface".to_owned());
        }
        parts.join(", or ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::load_source;
    use glam::Vec3;

    fn load(source: &str) -> afterlight_scene::Scene {
        load_source(source, &Default::default()).unwrap_or_else(|error| panic!("{error}"))
    }

    /// A lamp's rod is 3/128 pixel wide where `verify` found it.
    #[test]
    fn a_rod_between_the_nine_rays_is_found_by_more() {
        let scene = load("builtin:colonnade");
        let rays = RayScene::new(&scene);
        let numbers = "-6.7697783,4.513236,2.9304557,0.84286547,-8.888523,-23.133291,orthographic,26.562166,0.0026808789,123.77013";
        let camera = afterlight_scene::camera::select(&scene, Some(numbers)).expect("a camera");
        let judge = Judge::new(&rays, &camera, [169, 89]);
        let rod = Seen::Surface([1.8257; 2]);
        assert!(!judge.sight([95, 44]).expect("is judged").accepts(rod));
        assert!(judge.close_sight([95, 44]).expect("is judged").accepts(rod));
        // Beside it there is none.
        assert!(!judge.close_sight([92, 44]).expect("is judged").accepts(rod));
    }

    #[test]
    fn a_floor_is_accepted_where_it_is_and_nowhere_else() {
        let scene = load("builtin:floor");
        let rays = RayScene::new(&scene);
        let camera = Camera::look_at("eye", Vec3::new(0.0, 1.7, 0.0), Vec3::new(3.0, 1.0, -4.0), 1.0, 0.004);
        let judge = Judge::new(&rays, &camera, [64, 36]);
        let pixel = [32, 30];
        let sight = judge.sight(pixel).expect("is judged");
        let distance_m = rays
            .first_hit(&ray_through(&camera, DVec2::new(32.5, 30.5), [64, 36]))
            .expect("floor")
            .distance_m;
        let at = |factor: f64| Seen::Surface([distance_m * factor; 2]);
        assert!(sight.accepts(at(1.0)) && sight.accepts(at(1.001)));
        assert!(!sight.accepts(at(1.05)) && !sight.accepts(at(0.95)) && !sight.accepts(Seen::Nothing));
        let above = judge.sight([32, 0]).expect("is judged");
        assert!(above.accepts(Seen::Nothing) && !above.accepts(at(1.0)), "{}", above.text());
        assert!(judge.radiance(&sight, pixel, &scene.lights).is_some());
        assert!(judge.radiance(&above, [32, 0], &scene.lights).is_none());
    }

    #[test]
    fn an_eye_that_touches_a_surface_is_not_judged() {
        let scene = load("builtin:floor?width=100000");
        let rays = RayScene::new(&scene);
        let camera = Camera::look_at("eye", Vec3::new(9e3, 1e-3, 0.0), Vec3::new(9e3, 0.0, 0.0), 0.1, 1e-4);
        assert_eq!(Judge::new(&rays, &camera, [64, 36]).sight([3, 3]), None);
    }

    #[test]
    fn both_sides_of_a_silhouette_are_accepted() {
        let scene = load("builtin:edge");
        let rays = RayScene::new(&scene);
        let judge = Judge::new(&rays, &scene.cameras[0], [64, 36]);
        let sights: Vec<Sight> = (0..64 * 36).filter_map(|i| judge.sight([i % 64, i / 64])).collect();
        let one_only =
            sights.iter().filter(|sight| sight.certain.is_some() || sight.candidates.is_empty()).count();
        let both = sights.iter().filter(|sight| sight.may_be_nothing && !sight.candidates.is_empty()).count();
        assert_eq!(sights.len(), 64 * 36);
        // The diagonal between the two triangles is another edge.
        assert!(both > 1 && both < 36 && one_only > 2000, "{both} of both, {one_only} of one");
    }

    #[test]
    fn a_depth_is_a_range_of_distances() {
        let perspective = [0.0, 0.1, 1.0, 0.0];
        let Seen::Surface([near_m, far_m]) = Seen::of_depth(0.01, perspective) else { panic!("a surface") };
        assert!(near_m < 10.0 && far_m > 10.0 && far_m - near_m < 0.003, "{near_m} to {far_m}");
        assert_eq!(Seen::of_depth(0.0, perspective), Seen::Nothing);
        let Seen::Surface([_, far_m]) = Seen::of_depth(1e-9, perspective) else { panic!("a surface") };
        assert_eq!(far_m, f64::INFINITY);
    }
}
