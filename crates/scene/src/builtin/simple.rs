//! The built-in scenes that tests are made of.

use std::f64::consts::TAU;

use glam::{Affine3A, DVec2, DVec3, Quat, Vec3};

use super::kit::{Front, MeshData, SceneBuilder};
use crate::{
    AlphaMode, Camera, Environment, Light, LightKind, Material, Projection, Sampler, Scene, TextureRef, Wrap,
    animation::{Animation, Curve, Interpolation, NodeTrack},
    rng::SplitMix64,
};

/// A light from infinity; lux.
fn sun(direction_ws: Vec3, intensity: Vec3) -> Light {
    Light {
        kind: LightKind::Directional,
        position_ws: Vec3::ZERO,
        direction_ws: direction_ws.normalize(),
        intensity,
        range_m: f32::INFINITY,
    }
}

/// A light in all directions, of the range where its illuminance falls below 1/100 lux.
pub(super) fn lamp(position_ws: Vec3, intensity: Vec3) -> Light {
    Light {
        kind: LightKind::Point,
        position_ws,
        direction_ws: Vec3::NEG_Z,
        intensity,
        range_m: 10.0 * intensity.max_element().sqrt(),
    }
}

/// An orthographic camera that looks along −Z at the origin, 1 m from the middle to the upper edge.
fn flat_camera(name: &str) -> Camera {
    Camera {
        name: name.into(),
        world_from_view: Affine3A::from_translation(Vec3::new(0.0, 0.0, 5.0)),
        projection: Projection::Orthographic { half_height_m: 1.0, near_m: 0.1, far_m: 10.0 },
    }
}

fn plain(name: &str, color: [f32; 3], metallic_factor: f32, roughness_factor: f32) -> Material {
    let [r, g, b] = color;
    Material {
        name: name.to_owned(),
        base_color_factor: [r, g, b, 1.0],
        metallic_factor,
        roughness_factor,
        ..Material::default()
    }
}

fn unit_sphere(segments: u32) -> MeshData {
    let mut mesh = MeshData::default();
    mesh.sphere(segments, DVec3::ZERO, 1.0);
    mesh
}

/// A grid of spheres of one colour: metalness from 0 to 1 upwards, roughness from 0 to 1 to the right.
pub(super) fn spheres(rows: u32, columns: u32, segments: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let data = unit_sphere(segments);
    let fraction = |i: u32, n: u32| if n > 1 { i as f32 / (n - 1) as f32 } else { 0.5 };
    let mut first = None;
    for row in 0..rows {
        for column in 0..columns {
            let (metal, roughness) = (fraction(row, rows), fraction(column, columns));
            let name = format!("metal {metal:.2} roughness {roughness:.2}");
            let material = b.material(plain(&name, [0.95, 0.64, 0.36], metal, roughness));
            // vertices and indices are shared: a mesh differs by its material alone
            let mesh = match first {
                None => b.mesh(&name, &data, material),
                Some(first) => {
                    let mut mesh = b.scene.meshes[first as usize].clone();
                    mesh.name.clone_from(&name);
                    mesh.material = material;
                    b.scene.meshes.push(mesh);
                    b.scene.meshes.len() as u32 - 1
                }
            };
            first = first.or(Some(mesh));
            let center = Vec3::new(
                2.4 * (column as f32 - 0.5 * (columns - 1) as f32),
                2.4 * (row as f32 - 0.5 * (rows - 1) as f32),
                0.0,
            );
            b.place(&name, mesh, Affine3A::from_translation(center));
        }
    }
    let (half_x, half_y) = (1.2 * columns as f32, 1.2 * rows as f32);
    b.scene.lights = vec![
        sun(Vec3::new(-0.5, -0.8, -0.7), Vec3::splat(2.0)),
        lamp(Vec3::new(-half_x, half_y, 4.0), Vec3::new(60.0, 70.0, 90.0)),
        lamp(Vec3::new(half_x, -half_y, 4.0), Vec3::new(90.0, 60.0, 40.0)),
    ];
    b.scene.environment = Environment {
        ambient_radiance: Vec3::splat(0.08),
        background_radiance: Vec3::new(0.02, 0.025, 0.035),
    };
    let distance_m = (half_y / 20f32.to_radians().tan()).max(half_x / 33f32.to_radians().tan()) + 1.5;
    let eye_ws = Vec3::new(0.0, 0.0, distance_m);
    b.scene.cameras = vec![Camera::look_at("front", eye_ws, Vec3::ZERO, 42f32.to_radians(), 0.1)];
    b.scene
}

/// White spheres of several materials, ambient and background radiance 1, no light: every pixel is 1.
pub(super) fn furnace(segments: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let data = unit_sphere(segments);
    for (i, (metal, roughness)) in
        [(0.0, 0.0), (0.0, 0.5), (0.0, 1.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0)].into_iter().enumerate()
    {
        let name = format!("metal {metal} roughness {roughness}");
        let material = b.material(plain(&name, [1.0; 3], metal, roughness));
        let mesh = b.mesh(&name, &data, material);
        let center = Vec3::new(2.2 * (i % 3) as f32 - 2.2, 1.1 - 2.2 * (i / 3) as f32, 0.0);
        b.place(&name, mesh, Affine3A::from_translation(center));
    }
    b.scene.environment = Environment { ambient_radiance: Vec3::ONE, background_radiance: Vec3::ONE };
    let eye_ws = Vec3::new(0.0, 0.0, 8.0);
    b.scene.cameras = vec![Camera::look_at("front", eye_ws, Vec3::ZERO, 40f32.to_radians(), 0.1)];
    b.scene
}

/// The slanted line of `builtin:edge` at a height y in [−1, 1], metres: white to its left. The slope is
/// no ratio of small numbers, so pixels are cut at many different places.
const EDGE_X_AT_0_M: f64 = 0.0625;
/// Metres to the right for each metre up along that line.
const EDGE_SLOPE: f64 = 0.296_875;
/// How far the white triangles reach to the left and beyond the upper and lower borders, metres.
const EDGE_REACH_M: [f64; 2] = [64.0, 2.0];

/// Two unlit white triangles on black, seen by an orthographic camera (2 m high, 2·width/height m
/// wide, centred at the origin): they cover x < 1/16 + 19/64 y, to x = −64 m (so images of up to 64 times
/// their height) and to y = ±2 m. [`edge_coverage`] gives what they cover of every pixel. The line's ends are at
/// y = ±2: (0.65625, 2) and (−0.53125, −2), exact in `f32`.
pub(super) fn edge() -> Scene {
    let mut b = SceneBuilder::default();
    let material = b.material(Material { unlit: true, ..plain("white", [1.0; 3], 0.0, 1.0) });
    let [reach_x, reach_y] = EDGE_REACH_M;
    let position = |s: f64, t: f64| {
        let y = reach_y * (2.0 * t - 1.0);
        let edge_x = EDGE_X_AT_0_M + EDGE_SLOPE * y;
        DVec3::new(-reach_x + (edge_x + reach_x) * s, y, 0.0)
    };
    let mesh = MeshData::default()
        .with_patch([1, 1], Front::Along(DVec3::Z), position, |s, t| DVec2::new(s, 1.0 - t));
    b.add("edge", &mesh, material);
    b.scene.environment = Environment { ambient_radiance: Vec3::ZERO, background_radiance: Vec3::ZERO };
    b.scene.cameras = vec![flat_camera("front")];
    b.scene
}

/// What `builtin:edge` covers of each pixel of an image, 0 to 1, row by row from the top: the exact
/// area of the pixel's square to the left of the slanted line. (A device snaps vertices to a grid of 1/256 pixel or finer,
/// so its own edge may lie off this one by that much.)
pub fn edge_coverage(width: u32, height: u32) -> Vec<f64> {
    let pixel_m = 2.0 / f64::from(height.max(1));
    let mut coverage = Vec::with_capacity(width as usize * height as usize);
    for row in 0..height {
        let y1 = 1.0 - f64::from(row) * pixel_m;
        for column in 0..width {
            let x0 = (f64::from(column) - 0.5 * f64::from(width)) * pixel_m;
            // the line's place in pixels from the pixel's left border, at its lower and upper border
            let at = |y: f64| (EDGE_X_AT_0_M + EDGE_SLOPE * y - x0) / pixel_m;
            coverage.push(mean_of_clamped_line(at(y1 - pixel_m), at(y1)));
        }
    }
    coverage
}

/// Mean over t in [0, 1] of `clamp(a + (b − a) t, 0, 1)`, for a ≤ b.
fn mean_of_clamped_line(a: f64, b: f64) -> f64 {
    if b - a < 1e-12 {
        return (0.5 * (a + b)).clamp(0.0, 1.0);
    }
    // antiderivative of clamp(x, 0, 1)
    let integral = |x: f64| {
        if x <= 0.0 {
            0.0
        } else if x < 1.0 {
            0.5 * x * x
        } else {
            x - 0.5
        }
    };
    (integral(b) - integral(a)) / (b - a)
}

/// Smooth gradients with a step along the diagonal, as an unlit picture that fills the view: above the diagonal
/// brightness rises to the right, below it to the left, so the step is greatest at the ends and vanishes in the middle.
pub(super) fn gradients(size_px: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let mut pixels = Vec::with_capacity((size_px * size_px * 4) as usize);
    for y in 0..size_px {
        for x in 0..size_px {
            let u = (x as f32 + 0.5) / size_px as f32;
            let v = (y as f32 + 0.5) / size_px as f32;
            let above = u > v;
            let color = if above { [u, 0.35 + 0.3 * v, 1.0 - v] } else { [1.0 - u, v, 0.2 + 0.4 * u] };
            pixels.extend(color.map(|c| (c * 255.0 + 0.5) as u8));
            pixels.push(255);
        }
    }
    let image = b.image("gradients", size_px, pixels);
    let sampler = Sampler { wrap_u: Wrap::Clamp, wrap_v: Wrap::Clamp, ..Sampler::default() };
    let texture = TextureRef { sampler, ..super::textures::texture(image) };
    let material = b.material(Material {
        unlit: true,
        base_color_texture: Some(texture),
        ..plain("gradients", [1.0; 3], 0.0, 1.0)
    });
    // as wide as 16:9 sees; beyond that the background shows
    let (half_x, half_y) = (16.0 / 9.0, 1.0);
    let mut mesh = MeshData::default();
    mesh.patch(
        [16, 9],
        Front::Along(DVec3::Z),
        |s, t| DVec3::new(half_x * (2.0 * s - 1.0), half_y * (2.0 * t - 1.0), 0.0),
        |s, t| DVec2::new(s, 1.0 - t),
    );
    b.add("gradients", &mesh, material);
    b.scene.environment = Environment { ambient_radiance: Vec3::ZERO, background_radiance: Vec3::ZERO };
    b.scene.cameras = vec![flat_camera("front")];
    b.scene
}

/// One unit sphere at the origin and one directional light of π lux, so that a white Lambertian
/// surface that faces it has radiance 1; no ambient light.
pub(super) fn sphere(segments: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let material = b.material(plain("sphere", [0.8, 0.5, 0.3], 0.0, 0.5));
    b.add("sphere", &unit_sphere(segments), material);
    b.scene.lights = vec![sun(Vec3::new(-1.0, -1.0, -1.0), Vec3::splat(std::f32::consts::PI))];
    b.scene.environment = Environment { ambient_radiance: Vec3::ZERO, background_radiance: Vec3::ZERO };
    let eye_ws = Vec3::new(0.0, 0.0, 4.0);
    b.scene.cameras = vec![Camera::look_at("front", eye_ws, Vec3::ZERO, 40f32.to_radians(), 0.1)];
    b.scene
}

/// Triangles about a common axis, each turned and tilted, that pass through one another and
/// through a floor.
pub(super) fn intersect(blades: u32) -> Scene {
    let mut b = SceneBuilder::default();
    for i in 0..blades {
        let turn = f64::from(i) / f64::from(blades);
        let color = [0.0, 1.0, 2.0].map(|c: f64| (0.55 + 0.4 * (TAU * (turn + c / 3.0)).cos()) as f32);
        let material = b.material(Material { double_sided: true, ..plain("blade", color, 0.0, 0.6) });
        // a quad whose upper edge has no length: one triangle
        let mesh = MeshData::default().with_patch(
            [1, 1],
            Front::Along(DVec3::Z),
            |s, t| DVec3::new((2.4 * s - 1.2) * (1.0 - t), 2.2 * t - 0.7, 0.0),
            |s, t| DVec2::new(s, 1.0 - t),
        );
        let mesh = b.mesh("blade", &mesh, material);
        let turned = Quat::from_rotation_y((0.5 * TAU * turn) as f32) * Quat::from_rotation_x(0.35);
        b.place(&format!("blade {i}"), mesh, Affine3A::from_quat(turned));
    }
    let floor = b.material(plain("floor", [0.5; 3], 0.0, 0.8));
    let mut mesh = MeshData::default();
    mesh.rectangle([1, 1], DVec3::Y, DVec3::new(-3.0, 0.0, -3.0), [DVec3::X * 6.0, DVec3::Z * 6.0], 1.0);
    b.add("floor", &mesh, floor);
    b.scene.lights = vec![sun(Vec3::new(-0.4, -1.0, -0.6), Vec3::splat(2.0))];
    b.scene.environment = Environment { ambient_radiance: Vec3::splat(0.2), background_radiance: Vec3::ZERO };
    let (eye_ws, target_ws) = (Vec3::new(0.6, 1.6, 4.0), Vec3::new(0.0, 0.4, 0.0));
    b.scene.cameras = vec![Camera::look_at("front", eye_ws, target_ws, 40f32.to_radians(), 0.1)];
    b.scene
}

/// Two triangles in the plane y = 0, and an eye 1.7 m above their middle: both reach from behind the eye to the horizon, so
/// they cross the near plane and lie far outside of the image, where an imprecise rasteriser goes wrong.
pub(super) fn floor(width_m: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let material = b.material(plain("floor", [0.6, 0.55, 0.5], 0.0, 0.7));
    let width_m = f64::from(width_m);
    let mut mesh = MeshData::default();
    let corner = DVec3::new(-0.5 * width_m, 0.0, -0.5 * width_m);
    mesh.rectangle([1, 1], DVec3::Y, corner, [DVec3::X * width_m, DVec3::Z * width_m], 1.0);
    b.add("floor", &mesh, material);
    b.scene.lights = vec![
        sun(Vec3::new(-0.3, -1.0, -0.5), Vec3::splat(1.5)),
        lamp(Vec3::new(1.5, 1.0, -4.0), Vec3::splat(8.0)),
    ];
    b.scene.environment =
        Environment { ambient_radiance: Vec3::splat(0.1), background_radiance: Vec3::new(0.05, 0.06, 0.08) };
    let (eye_ws, target_ws) = (Vec3::new(0.0, 1.7, 0.0), Vec3::new(3.0, 1.2, -4.0));
    let near_m = crate::camera::near_of_extent_m(width_m as f32);
    b.scene.cameras = vec![Camera::look_at("standing", eye_ws, target_ws, 60f32.to_radians(), near_m)];
    b.scene
}

/// Length of the loop of `builtin:moving`, seconds.
const LOOP_S: f32 = 4.0;

/// Objects that slide, spin, swing (a child node of a spinning one) and scale.
pub(super) fn moving(segments: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let floor = b.material(plain("floor", [0.6, 0.6, 0.62], 0.0, 0.7));
    let mut mesh = MeshData::default();
    mesh.rectangle([8, 8], DVec3::Y, DVec3::new(-6.0, -1.0, -4.0), [DVec3::X * 12.0, DVec3::Z * 8.0], 1.0);
    b.add("floor", &mesh, floor);

    let red = b.material(plain("red", [0.8, 0.1, 0.08], 0.0, 0.4));
    let ball = b.mesh("ball", &unit_sphere(segments), red);
    let gold = b.material(plain("gold", [1.0, 0.77, 0.34], 1.0, 0.3));
    let mut data = MeshData::default();
    data.cuboid(DVec3::ZERO, DVec3::new(1.2, 0.2, 0.2), 1.0);
    let bar = b.mesh("bar", &data, gold);
    let blue = b.material(plain("blue", [0.1, 0.25, 0.8], 0.0, 0.5));
    let mut data = MeshData::default();
    data.cuboid(DVec3::ZERO, DVec3::splat(0.5), 1.0);
    let cube = b.mesh("cube", &data, blue);

    let slider = b.place("slider", ball, Affine3A::from_translation(Vec3::new(-3.0, 0.0, 0.0)));
    let spinner = b.place("spinner", bar, Affine3A::from_translation(Vec3::new(0.0, 0.6, 1.0)));
    let scaler = b.place("scaler", cube, Affine3A::from_translation(Vec3::new(3.0, -0.2, -1.0)));
    let local = Affine3A::from_scale_rotation_translation(Vec3::splat(0.4), Quat::IDENTITY, Vec3::X * 1.7);
    let swinger = b.node("swinger", Some(spinner), local);
    let world_from_object = (b.scene.nodes[spinner as usize].local * local.as_daffine3()).as_affine3a();
    b.scene.instances.push(crate::Instance { mesh: cube, node: swinger, world_from_object });

    b.scene.animations = vec![Animation {
        name: "loop".to_owned(),
        duration_s: f64::from(LOOP_S),
        tracks: vec![
            NodeTrack { translation: Some(slide()), ..track(slider, Vec3::new(-3.0, 0.0, 0.0), Vec3::ONE) },
            NodeTrack {
                rotation: Some(spin(Vec3::Y)),
                ..track(spinner, Vec3::new(0.0, 0.6, 1.0), Vec3::ONE)
            },
            NodeTrack { scale: Some(pulse()), ..track(scaler, Vec3::new(3.0, -0.2, -1.0), Vec3::ONE) },
            NodeTrack { rotation: Some(spin(Vec3::X)), ..track(swinger, Vec3::X * 1.7, Vec3::splat(0.4)) },
        ],
        weights: Vec::new(),
    }];
    b.scene.lights = vec![
        sun(Vec3::new(-0.4, -1.0, -0.5), Vec3::splat(2.0)),
        lamp(Vec3::new(2.0, 3.0, 3.0), Vec3::new(20.0, 16.0, 10.0)),
    ];
    b.scene.environment =
        Environment { ambient_radiance: Vec3::splat(0.15), background_radiance: Vec3::new(0.03, 0.04, 0.06) };
    let (eye_ws, target_ws) = (Vec3::new(0.0, 3.0, 9.0), Vec3::ZERO);
    b.scene.cameras = vec![Camera::look_at("front", eye_ws, target_ws, 42f32.to_radians(), 0.1)];
    b.scene
}

fn track(node: u32, rest_translation: Vec3, rest_scale: Vec3) -> NodeTrack {
    NodeTrack { node, rest_translation: rest_translation.as_dvec3(), rest_scale, ..NodeTrack::default() }
}

/// To the right and back.
fn slide() -> Curve<Vec3> {
    let left = Vec3::new(-3.0, 0.0, 0.0);
    Curve {
        times_s: vec![0.0, 0.5 * LOOP_S, LOOP_S],
        values: vec![left, left + Vec3::new(3.0, 0.0, -2.0), left],
        interpolation: Interpolation::Linear,
    }
}

/// Once around an axis, by thirds: between two keys less than half a turn.
fn spin(axis: Vec3) -> Curve<Quat> {
    let thirds = [0.0, 1.0, 2.0, 3.0f32];
    Curve {
        times_s: thirds.map(|k| k * LOOP_S / 3.0).to_vec(),
        values: thirds.map(|k| Quat::from_axis_angle(axis, k * TAU as f32 / 3.0)).to_vec(),
        interpolation: Interpolation::Linear,
    }
}

/// Grows and shrinks, without a jump in speed.
fn pulse() -> Curve<Vec3> {
    let [still, small, large] = [Vec3::ZERO, Vec3::ONE, Vec3::splat(1.6)];
    Curve {
        times_s: vec![0.0, 0.5 * LOOP_S, LOOP_S],
        values: vec![still, small, still, still, large, still, still, small, still],
        interpolation: Interpolation::CubicSpline,
    }
}

/// An alpha mask with glTF's cutoff.
pub(super) const MASK: AlphaMode = AlphaMode::Mask { cutoff: 0.5 };

/// Distance between figures of the crowd, m.
const CROWD_STEP_M: f32 = 1.6;

/// A body of revolution about +Y, 1 m high: radius and height of points along its profile, m.
type Profile = [[f64; 2]];

/// Name, colour and profile of the crowd's figures.
const FIGURES: [(&str, [f32; 3], &Profile); 4] = [
    ("stone", [0.62, 0.56, 0.5], &[[0.0, 0.0], [0.5, 0.1], [0.46, 0.5], [0.2, 0.62], [0.0, 0.64]]),
    (
        "vase",
        [0.62, 0.26, 0.18],
        &[[0.0, 0.0], [0.24, 0.0], [0.4, 0.4], [0.16, 0.8], [0.24, 1.0], [0.0, 0.9]],
    ),
    (
        "pawn",
        [0.22, 0.42, 0.55],
        &[[0.0, 0.0], [0.36, 0.0], [0.12, 0.6], [0.24, 0.8], [0.12, 1.0], [0.0, 1.0]],
    ),
    ("cone", [0.3, 0.45, 0.25], &[[0.0, 0.0], [0.4, 0.0], [0.0, 1.0]]),
];

/// The point at a fraction of a profile, whose pieces are of equal length in it.
fn along(profile: &Profile, t: f64) -> DVec2 {
    let at = t * (profile.len() - 1) as f64;
    let piece = (at as usize).min(profile.len() - 2);
    let [from, to] = [profile[piece], profile[piece + 1]].map(DVec2::from);
    from.lerp(to, at - piece as f64)
}

/// Figures of four kinds in rows on a floor, of random size, turn and place: many nodes of few meshes.
pub(super) fn crowd(nodes: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let figures = FIGURES.map(|(name, color, profile)| {
        let mut data = MeshData::default();
        let pieces = profile.len() as u32 - 1;
        data.revolve([12, pieces], DVec3::ZERO, false, |t| along(profile, t), DVec2::ONE);
        let material = b.material(plain(name, color, 0.0, 0.6));
        (name, b.mesh(name, &data, material))
    });
    let columns = f64::from(nodes).sqrt().ceil() as u32;
    let half_m = 0.5 * CROWD_STEP_M * columns as f32;
    let mut random = SplitMix64::new(17);
    for i in 0..nodes {
        let (name, mesh) = figures[random.next_u64() as usize % figures.len()];
        let place = [i % columns, i / columns].map(|step| {
            let off_the_row = 0.5 * (random.next_f32() - 0.5);
            (step as f32 + 0.5 + off_the_row) * CROWD_STEP_M - half_m
        });
        let turn = Quat::from_rotation_y(random.between(0.0, std::f32::consts::TAU));
        let size = Vec3::splat(random.between(0.5, 1.3));
        let at_ws = Vec3::new(place[0], 0.0, place[1]);
        b.place(&format!("{name} {i}"), mesh, Affine3A::from_scale_rotation_translation(size, turn, at_ws));
    }
    let ground = b.material(plain("ground", [0.4, 0.38, 0.34], 0.0, 0.9));
    let mut floor = MeshData::default();
    let width_m = 2.0 * f64::from(half_m + 4.0);
    let corner = DVec3::new(-0.5 * width_m, 0.0, -0.5 * width_m);
    floor.rectangle([1, 1], DVec3::Y, corner, [DVec3::X * width_m, DVec3::Z * width_m], 1.0);
    b.add("floor", &floor, ground);
    b.scene.lights = vec![sun(Vec3::new(0.4, -1.0, -0.3), Vec3::new(2.6, 2.4, 2.1))];
    b.scene.environment =
        Environment { ambient_radiance: Vec3::splat(0.12), background_radiance: Vec3::new(0.25, 0.32, 0.42) };
    let camera = |name, eye_ws: Vec3| Camera::look_at(name, eye_ws, Vec3::ZERO, 55f32.to_radians(), 0.1);
    b.scene.cameras = vec![
        camera("standing", Vec3::new(0.0, 1.7, half_m + 2.0)),
        camera("above", Vec3::new(0.0, half_m, half_m)),
    ];
    b.scene
}
