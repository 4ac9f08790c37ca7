//! Views that are drawn at random: purely, from a seed, a number and the sample counts that a device has.

use afterlight_scene::points::{SurfacePoint, surface_points};
use afterlight_scene::rng::SplitMix64;
use afterlight_scene::{Scene, camera};
use afterlight_techniques::{Effects, Indirect, Shadows, Transparency};
use glam::{DVec3, Vec3};

use crate::FrameSpec;

/// Points of surfaces that eyes are put at.
const POINTS: usize = 4096;

/// Least and greatest angle of view, degrees.
const FOV_DEG: [f32; 2] = [5.0, 150.0];

/// Least and greatest width of an image, pixels: a comparison of hundreds of small images finds more than one of a large one. Where an image
/// is a few pixels high, its pixel quads reach over its edge, and their mip levels say nothing of larger ones.
const WIDTH_PX: [f32; 2] = [64.0, 640.0];

/// Most seeded lights.
const LIGHTS: f32 = 5_000.0;

/// Where a camera is put.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// A camera of the scene.
    Scene,
    /// Anywhere in the bounds, looking anywhere.
    Inside,
    /// Outside of the bounds, looking at something within.
    Outside,
    /// In a surface, or within a thousandth of the scene's extent of one.
    InWall,
    /// Above a surface, looking along it.
    Grazing,
    /// Near a surface, looking at it.
    Near,
    /// At the height of a person's eye over a surface, looking about level.
    Standing,
    /// Looking straight along an axis.
    Axis,
}

impl Place {
    const ALL: [Place; 8] = [
        Place::Inside,
        Place::Outside,
        Place::InWall,
        Place::Grazing,
        Place::Near,
        Place::Standing,
        Place::Axis,
        Place::Scene,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Place::Scene => "the scene's camera",
            Place::Inside => "inside",
            Place::Outside => "outside",
            Place::InWall => "in a wall",
            Place::Grazing => "grazing",
            Place::Near => "near a surface",
            Place::Standing => "standing",
            Place::Axis => "along an axis",
        }
    }
}

/// What views of a scene are drawn from.
pub struct Stage {
    points: Vec<SurfacePoint>,
    min: Vec3,
    size_m: Vec3,
    /// Greatest extent, positive, metres.
    extent_m: f32,
    cameras: u32,
    /// Where world space has its origin, in the coordinates of the scene's file.
    origin_file: DVec3,
}

impl Stage {
    /// The stage that a scene is.
    pub fn of(scene: &Scene) -> Stage {
        let bounds = scene.bounds_ws();
        let is_sound =
            bounds.min.is_finite() && bounds.size().is_finite() && bounds.size().max_element() > 0.0;
        let (min, size_m) =
            if is_sound { (bounds.min, bounds.size()) } else { (Vec3::NEG_ONE, Vec3::splat(2.0)) };
        let points = surface_points(scene, POINTS, 1);
        Stage {
            points: points.into_iter().filter(|point| point.position_ws.is_finite()).collect(),
            min,
            size_m,
            extent_m: size_m.max_element(),
            cameras: scene.cameras.len() as u32,
            origin_file: scene.origin_file,
        }
    }

    /// A point in the coordinates of the scene's file, as `--camera` has it: digits that give the same point again.
    fn point_text(&self, point_ws: Vec3) -> String {
        if self.origin_file == DVec3::ZERO {
            return format!("{},{},{}", point_ws.x, point_ws.y, point_ws.z);
        }
        let point = self.origin_file + point_ws.as_dvec3();
        format!("{},{},{}", point.x, point.y, point.z)
    }

    /// A point of a surface; the middle of the bounds where there is no surface.
    fn point(&self, rng: &mut SplitMix64) -> SurfacePoint {
        let pick = rng.next_f32();
        let point = self.points.get((pick * self.points.len() as f32) as usize).copied();
        point.unwrap_or(SurfacePoint { position_ws: self.min + 0.5 * self.size_m, normal_ws: Vec3::Y })
    }

    fn within(&self, rng: &mut SplitMix64) -> Vec3 {
        self.min + self.size_m * Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
    }
}

/// What is not drawn, since it was asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fixed {
    /// Image width, pixels.
    pub width: Option<u32>,
    /// Image height, pixels.
    pub height: Option<u32>,
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// Number of seeded lights; 0 keeps the scene's own.
    pub lights: Option<u32>,
    /// Device, by a part of its name or its index.
    pub device: Option<String>,
    /// Time at which animated nodes are posed, seconds.
    pub time_s: Option<f64>,
    /// Turns on Vulkan validation.
    pub validate: bool,
}

/// A view that was drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Its number.
    pub index: u64,
    /// Where its camera is.
    pub place: Place,
    /// What `compare` is given to repeat it.
    pub spec: FrameSpec,
}

/// The generator of a view, whatever views are drawn before it.
pub(crate) fn generator(seed: u64, index: u64) -> SplitMix64 {
    let mixed = SplitMix64::new(seed).next_u64() ^ index;
    SplitMix64::new(SplitMix64::new(mixed).next_u64())
}

/// Draws the view of a number; `samples` are the numbers of samples that the device has. Whatever is fixed, the rest is drawn as if it were not.
pub fn draw(stage: &Stage, seed: u64, index: u64, samples: &[u32], fixed: &Fixed) -> View {
    let mut rng = generator(seed, index);
    let rng = &mut rng;
    let (place, camera) = draw_camera(stage, rng);
    let width = log_between(rng, WIDTH_PX) as u32;
    let height = (width as f32 * rng.between(0.4, 1.2)).max(48.0) as u32;
    // Half of the views have one sample, which is where bounds are closest.
    let several = samples.get((rng.next_f32() * samples.len() as f32) as usize).copied().unwrap_or(1);
    let samples = if rng.next_f32() < 0.4 { 1 } else { several };
    let own_lights = rng.next_f32() < 0.25;
    let seeded = log_between(rng, [1.0, LIGHTS]) as u32;
    let light_seed = rng.next_u64() >> 32;
    let effects = draw_effects(rng);
    let spec = FrameSpec {
        width: fixed.width.unwrap_or(width),
        height: fixed.height.unwrap_or(height),
        samples: fixed.samples.unwrap_or(samples),
        lights: fixed.lights.unwrap_or(if own_lights { 0 } else { seeded }),
        light_seed,
        camera: Some(camera),
        device: fixed.device.clone(),
        time_s: fixed.time_s,
        effects,
        validate: fixed.validate,
        ..FrameSpec::default()
    };
    View { index, place, spec }
}

/// A number between two, uniform in its logarithm.
fn log_between(rng: &mut SplitMix64, [low, high]: [f32; 2]) -> f32 {
    rng.between(low.ln(), high.ln()).exp().clamp(low, high)
}

fn draw_effects(rng: &mut SplitMix64) -> Effects {
    let mut effects = Effects::default();
    let (shadows, indirect, opaque) = (rng.next_f32() < 0.35, rng.next_f32() < 0.25, rng.next_f32() < 0.2);
    let size_px = [128, 256, 512, 1024][(rng.next_f32() * 4.0) as usize];
    if shadows {
        effects.shadows.method = Shadows::Map;
    }
    if indirect {
        effects.indirect.method = Indirect::Rsm;
    }
    if shadows || indirect {
        // One option sets both sizes.
        (effects.shadows.map_size_px, effects.indirect.map_size_px) = (size_px, size_px);
    }
    if opaque {
        effects.transparency.order = Transparency::None;
    }
    effects
}

/// A camera in the words of `--camera`.
fn draw_camera(stage: &Stage, rng: &mut SplitMix64) -> (Place, String) {
    // A scene's own cameras are few: they are drawn less often.
    let pick = (rng.next_f32() * (Place::ALL.len() as f32 - 0.7)) as usize;
    let place = Place::ALL[pick.min(Place::ALL.len() - 1)];
    let own = rng.next_f32();
    if place == Place::Scene && stage.cameras > 0 {
        return (place, ((own * stage.cameras as f32) as u32).min(stage.cameras - 1).to_string());
    }
    let (eye_ws, direction) = draw_pose(stage, place, rng);
    // As far as the scene is wide: rounding of the target then turns the view by less than a thousandth of a pixel.
    let target_ws = eye_ws
        + direction.try_normalize().unwrap_or(Vec3::NEG_Z) * stage.extent_m.max(1e-3 * eye_ws.length());
    let pose = [eye_ws, target_ws].map(|point| stage.point_text(point)).join(",");
    (place, format!("{pose},{}", draw_lens(stage, rng)))
}

/// The eye, and where it looks; the direction is of any length.
fn draw_pose(stage: &Stage, place: Place, rng: &mut SplitMix64) -> (Vec3, Vec3) {
    let extent_m = stage.extent_m;
    let point = stage.point(rng);
    let anywhere = direction(rng);
    // Unit vectors in the point's plane.
    let along =
        point.normal_ws.cross(anywhere).try_normalize().unwrap_or(point.normal_ws.any_orthonormal_vector());
    match place {
        Place::Inside | Place::Scene => (stage.within(rng), anywhere),
        Place::Outside => {
            let center_ws = stage.min + 0.5 * stage.size_m;
            let eye_ws = center_ws + anywhere * extent_m * log_between(rng, [0.6, 20.0]);
            (eye_ws, stage.within(rng) - eye_ws)
        }
        Place::InWall => {
            let offset_m = extent_m * rng.between(-1e-3, 1e-3);
            (point.position_ws + point.normal_ws * offset_m, anywhere)
        }
        Place::Grazing => {
            let height_m = extent_m * log_between(rng, [1e-5, 1e-2]);
            (
                point.position_ws + point.normal_ws * height_m,
                along + point.normal_ws * rng.between(-0.1, 0.05),
            )
        }
        Place::Near => {
            let height_m = extent_m * log_between(rng, [1e-4, 0.1]);
            let eye_ws = point.position_ws + point.normal_ws * height_m;
            (eye_ws, -point.normal_ws + along * rng.between(0.0, 1.5))
        }
        Place::Standing => {
            let eye_ws = point.position_ws + Vec3::Y * 1.7f32.min(0.2 * extent_m);
            (eye_ws, Vec3::new(anywhere.x, rng.between(-0.5, 0.3), anywhere.z))
        }
        Place::Axis => {
            let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
            (stage.within(rng), axes[(rng.next_f32() * 6.0) as usize % 6])
        }
    }
}

/// A unit vector, uniform over the sphere.
fn direction(rng: &mut SplitMix64) -> Vec3 {
    let (y, turn) = (rng.between(-1.0, 1.0), rng.between(0.0, std::f32::consts::TAU));
    let radius = (1.0 - y * y).max(0.0).sqrt();
    Vec3::new(radius * turn.cos(), y, radius * turn.sin())
}

/// A lens in the words of `--camera`: an angle of view, with a near plane by the rule of cameras made to fit, the usual one, or any; in one of ten
/// views without perspective.
fn draw_lens(stage: &Stage, rng: &mut SplitMix64) -> String {
    let extent_m = stage.extent_m;
    let fov_deg = rng.between(FOV_DEG[0], FOV_DEG[1]);
    let given_m = extent_m * log_between(rng, [1e-5, 1e-2]);
    let half_height_m = extent_m * log_between(rng, [0.01, 1.0]);
    let far_m = extent_m * rng.between(1.0, 6.0);
    let [flat, near] = [rng.next_f32(), rng.next_f32()];
    if flat < 0.1 {
        let near_m = if near < 0.5 { 0.0 } else { given_m };
        return format!("orthographic,{half_height_m},{near_m},{far_m}");
    }
    match near {
        near if near < 0.4 => format!("{fov_deg},{}", camera::near_of_extent_m(extent_m)),
        near if near < 0.6 => format!("{fov_deg}"),
        _ => format!("{fov_deg},{given_m}"),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use afterlight_scene::{Projection, builtin};

    use super::*;

    fn scene(source: &str) -> Scene {
        builtin::build(source).expect("is there")
    }

    /// Whatever is drawn, the program takes it: a command that repeats a view is no use otherwise.
    #[test]
    fn every_view_is_taken_and_has_a_camera() {
        for source in ["builtin:colonnade?triangles=17000&texture=16", "builtin:floor", "builtin:edge"] {
            let scene = scene(source);
            let stage = Stage::of(&scene);
            for index in 0..2_000 {
                let view = draw(&stage, 7, index, &[1, 4], &Fixed::default());
                view.spec.check().unwrap_or_else(|error| panic!("{source}: view {index}: {error}"));
                let camera = camera::select(&scene, view.spec.camera.as_deref())
                    .unwrap_or_else(|error| panic!("{source}: view {index}: {error}"));
                assert!(camera.eye_ws().is_finite() && camera.world_from_view.is_finite(), "{camera:?}");
                if let (Projection::Perspective { fov_y_rad, .. }, false) =
                    (camera.projection, view.place == Place::Scene)
                {
                    assert!((4.99..150.01).contains(&fov_y_rad.to_degrees()), "{}", fov_y_rad.to_degrees());
                }
            }
        }
    }

    /// A scene far from its file's origin has the same views, in words that lead to the same places.
    #[test]
    fn views_of_a_far_scene_are_named_in_its_coordinates() {
        let near = scene("builtin:spheres?segments=8");
        let far = Scene { origin_file: DVec3::new(1_400_000.3, 35.2, -900_000.6), ..near.clone() };
        for index in 0..200 {
            let [a, b] = [&near, &far].map(|scene| {
                let view = draw(&Stage::of(scene), 5, index, &[1], &Fixed::default());
                camera::select(scene, view.spec.camera.as_deref()).expect("a camera").world_from_view
            });
            assert!(a.abs_diff_eq(b, 1e-5), "view {index}: {a} {b}");
        }
    }

    #[test]
    fn an_empty_scene_has_views() {
        let stage = Stage::of(&Scene::default());
        for index in 0..200 {
            let view = draw(&stage, 1, index, &[1], &Fixed::default());
            assert!(camera::select(&Scene::default(), view.spec.camera.as_deref()).is_ok());
        }
    }

    #[test]
    fn every_place_every_effect_and_every_number_of_samples_is_drawn() {
        let stage = Stage::of(&scene("builtin:colonnade?triangles=17000&texture=16"));
        let mut counts: BTreeMap<String, u32> = BTreeMap::new();
        for index in 0..1_000 {
            let View { place, spec, .. } = draw(&stage, 3, index, &[1, 2, 4, 8], &Fixed::default());
            let camera = spec.camera.expect("is drawn");
            for what in [
                place.name().to_owned(),
                format!("{} samples", spec.samples),
                format!("shadows {}", spec.effects.shadows.method),
                format!("indirect {}", spec.effects.indirect.method),
                format!("transparency {}", spec.effects.transparency.order),
                format!("orthographic {}", camera.contains("orthographic")),
                format!("near given {}", camera.split(',').count() == 8),
                format!("lights {}", (spec.lights as f32).max(1.0).log10() as u32),
                format!("own lights {}", spec.lights == 0),
            ] {
                *counts.entry(what).or_default() += 1;
            }
        }
        assert_eq!(counts.len(), 8 + 4 + 2 + 2 + 2 + 2 + 2 + 4 + 2, "{counts:?}");
        assert!(counts.values().all(|count| *count >= 20), "{counts:?}");
    }

    #[test]
    fn a_view_does_not_depend_on_what_is_drawn_before_it_or_fixed() {
        let stage = Stage::of(&scene("builtin:spheres?segments=8"));
        let free = draw(&stage, 5, 11, &[1, 4], &Fixed::default());
        let fixed = Fixed { width: Some(99), lights: Some(3), ..Fixed::default() };
        let other = draw(&stage, 5, 11, &[1, 4], &fixed);
        assert_eq!((other.spec.width, other.spec.lights), (99, 3));
        let again = FrameSpec { width: free.spec.width, lights: free.spec.lights, ..other.spec };
        assert_eq!(again, free.spec);
        assert_ne!(free.spec.camera, draw(&stage, 5, 12, &[1, 4], &Fixed::default()).spec.camera);
        assert_ne!(free.spec.camera, draw(&stage, 6, 11, &[1, 4], &Fixed::default()).spec.camera);
    }
}
