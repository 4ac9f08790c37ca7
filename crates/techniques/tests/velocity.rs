//! Velocities of surfaces against a twin in f64: rays find what each pixel shows, and where that stood in the frame before.

mod common;

use std::sync::Arc;

use afterlight_frame::TessellationEffect;
use afterlight_oracle::{
    deform::posed_vertices_ws,
    raster::{Hit, RayScene, place_of, ray_through},
};
use afterlight_renderer::{Done, FlightOptions, FrameContext, Renderer, ScenePose};
use afterlight_stages::surfaces::velocity::{NOWHERE_PX, VELOCITY};
use afterlight_techniques::{
    Params, Settings, Technique, TechniqueError, find, registry,
    scene::{AlphaMode, Camera, LoadOptions, Pose, Scene, load},
    shader::Shader,
};
use common::{Stage, compiled_variant};
use glam::{Affine3A, DVec2, DVec3, Quat, Vec3};

const SIZE: (u32, u32) = (96, 64);
const SIZE_PX: [u32; 2] = [SIZE.0, SIZE.1];
/// 16-bit floats round by this share of the value.
const ROUNDING: f64 = 1.0 / 2048.0;
/// What 32-bit floats lose between vertices and pixels, pixels.
const LOST_PX: f64 = 0.01;
/// Nearer to an edge of a triangle than this, as a barycentric coordinate, rounding may show another one.
const DOUBTFUL: f64 = 1e-3;
/// Where a ray as far beside a pixel's centre shows another triangle, rounding may.
const AROUND_PX: f64 = 0.02;

/// A frame of a flight.
#[derive(Clone)]
struct Shown {
    camera: Camera,
    pose: Option<Pose>,
    cut: bool,
}

impl Shown {
    fn still(camera: &Camera) -> Self {
        Self { camera: camera.clone(), pose: None, cut: false }
    }
}

/// Velocities of each frame of a flight, pixels, rows from the top.
fn flown(
    stage: &Stage,
    technique: &'static dyn Technique,
    (samples, shaders): (u32, &[Shader]),
    frames: &[Shown],
) -> Vec<Vec<[f32; 2]>> {
    let settings = Settings { samples, ..stage.from(frames[0].camera.clone(), SIZE, 3) };
    flown_with(stage, technique, (&settings, shaders), frames)
}

/// The same with settings, whose view it chooses.
fn flown_with(
    stage: &Stage,
    technique: &'static dyn Technique,
    (settings, shaders): (&Settings, &[Shader]),
    frames: &[Shown],
) -> Vec<Vec<[f32; 2]>> {
    let id = technique.info().id;
    let settings = Settings { view: "velocity".to_owned(), ..settings.clone() };
    let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
    let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    renderer.add_shaders(shaders.iter().cloned());
    let scene_moves = frames.iter().any(|frame| frame.pose.is_some());
    let options = FlightOptions { scene_moves, ..FlightOptions::default() };
    let mut flight = renderer
        .fly(technique, &Params::default(), &settings.camera, options)
        .unwrap_or_else(|e| panic!("{id}: {e}"));
    let mut velocities = Vec::new();
    for (index, frame) in (0..).zip(frames) {
        let pose = frame.pose.as_ref().map(|pose| Arc::new(ScenePose::of(&stage.scene, pose, false)));
        let (camera, cut) = (frame.camera.clone(), frame.cut);
        let context = FrameContext { index, time_s: 0.1 * index as f64, cut, camera, pose };
        flight.frame(context, &mut |_| Ok(())).unwrap_or_else(|e| panic!("{id}: {e}"));
        flight.land(&mut |_| Ok(())).unwrap_or_else(|e| panic!("{id}: {e}"));
        velocities.push(velocities_of(&flight.executor().read_image(VELOCITY).expect("kept")));
    }
    velocities
}

fn velocities_of(bytes: &[u8]) -> Vec<[f32; 2]> {
    let value = |half: &[u8]| half::f16::from_le_bytes([half[0], half[1]]).to_f32();
    bytes.chunks_exact(4).map(|pixel| [value(&pixel[..2]), value(&pixel[2..])]).collect()
}

/// A scene in the poses of a frame and of the one before.
struct Twin<'a> {
    scene: &'a Scene,
    now: Scene,
    before: Vec<Vec<DVec3>>,
    cameras: [&'a Camera; 2],
}

impl<'a> Twin<'a> {
    fn new(scene: &'a Scene, before: &'a Shown, now: &'a Shown) -> Self {
        let rest = scene.pose_at(0.0);
        let mut posed = scene.clone();
        if let Some(pose) = &now.pose {
            posed.take_pose(pose);
        }
        let pose = before.pose.as_ref().unwrap_or(&rest);
        let vertices = |i| posed_vertices_ws(scene, pose, i).iter().map(|vertex| vertex.position).collect();
        let before_ws = (0..scene.instances.len()).map(vertices).collect();
        Self { scene, now: posed, before: before_ws, cameras: [&before.camera, &now.camera] }
    }

    /// Where the point of a hit stood in the frame before.
    fn point_before_ws(&self, hit: &Hit) -> DVec3 {
        let mesh = &self.scene.meshes[self.scene.instances[hit.instance as usize].mesh as usize];
        let first = mesh.first_index as usize + 3 * hit.triangle as usize;
        let corner = |k: usize| self.before[hit.instance as usize][self.scene.indices[first + k] as usize];
        let [b, c] = hit.barycentric.to_array();
        (1.0 - b - c) * corner(0) + b * corner(1) + c * corner(2)
    }

    /// What a pixel shows; `None` where rounding decides that.
    fn surely_shown(&self, rays: &RayScene<'_>, center_px: DVec2) -> Option<Option<Hit>> {
        let is_doubtful = |hit: &Hit| {
            hit.edge_distance < DOUBTFUL || rays.material(hit.instance).alpha_mode != AlphaMode::Opaque
        };
        let at = |offset_px: DVec2| {
            let ray = ray_through(self.cameras[1], center_px + offset_px, SIZE_PX);
            match rays.surfaces(&ray, is_doubtful).first() {
                None => Some(None),
                Some(hit) => (!is_doubtful(hit)).then_some(Some(*hit)),
            }
        };
        let place = |hit: &Option<Hit>| hit.map(|hit| hit.place());
        let shown = at(DVec2::ZERO)?;
        let around = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y];
        let is_steady =
            around.into_iter().all(|one| at(AROUND_PX * one).is_some_and(|hit| place(&hit) == place(&shown)));
        is_steady.then_some(shown)
    }

    /// How far off velocities are, in what is allowed; and of how many pixels with a surface, pixels without one. Pixels whose surface rounding
    /// decides are left out.
    fn worst(&self, found: &[[f32; 2]]) -> (f64, usize, usize) {
        let rays = RayScene::new(&self.now);
        let (mut worst, mut surfaces, mut empty) = (0.0f64, 0, 0);
        for (k, found) in found.iter().enumerate() {
            let pixel = [k as u32 % SIZE.0, k as u32 / SIZE.0];
            let center_px = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5;
            let found = DVec2::from_array(found.map(f64::from));
            let Some(shown) = self.surely_shown(&rays, center_px) else { continue };
            let expected = shown.map_or(DVec2::ZERO, |hit| self.velocity_px(&hit, center_px));
            let allowed = expected.abs() * ROUNDING + LOST_PX;
            worst = worst.max(((found - expected).abs() / allowed).max_element());
            (surfaces, empty) = match shown {
                Some(_) => (surfaces + 1, empty),
                None => (surfaces, empty + 1),
            };
        }
        (worst, surfaces, empty)
    }

    /// Velocity of the point of a hit at a place.
    fn velocity_px(&self, hit: &Hit, place_px: DVec2) -> DVec2 {
        let farthest_px = DVec2::splat(NOWHERE_PX.into());
        let before_px = place_of(self.cameras[0], self.point_before_ws(hit), SIZE_PX);
        before_px.map_or(farthest_px, |before_px| (place_px - before_px).clamp(-farthest_px, farthest_px))
    }
}

/// A walk that turns and sinks.
fn path(stage: &Stage, frames: u16) -> Vec<Shown> {
    let first = stage.scene.cameras.first().expect("a camera").clone();
    let forward = -Vec3::from(first.world_from_view.matrix3.z_axis);
    let at = |frame: u16| {
        let t = f32::from(frame);
        let place = first.eye_ws() + forward * (0.3 * t) - Vec3::Y * 0.05 * t;
        let aim = Quat::from_rotation_y(0.03 * t) * forward;
        let mut camera = Camera::look_at("walk", place, place + aim, 1.0, 0.1);
        camera.projection = first.projection;
        Shown::still(&camera)
    };
    (0..frames).map(at).collect()
}

fn is_zero(velocities: &[[f32; 2]]) -> bool {
    velocities.iter().all(|velocity| *velocity == [0.0; 2])
}

#[test]
fn a_camera_that_moves_moves_all_surfaces() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let mut frames = path(&stage, 4);
    // About turn: what shows now was behind the eye.
    let mut around = frames[3].clone();
    around.camera.world_from_view.matrix3 *= glam::Mat3A::from_rotation_y(std::f32::consts::PI);
    frames.push(around);
    let forward = find("forward").expect("known");
    let velocities = flown(&stage, forward, (1, &[]), &frames);
    assert!(is_zero(&velocities[0]), "nothing was before the first frame");
    for k in 1..frames.len() {
        let twin = Twin::new(&stage.scene, &frames[k - 1], &frames[k]);
        let (worst, surfaces, empty) = twin.worst(&velocities[k]);
        println!("frame {k}: {worst:.3} of what is allowed, {surfaces} pixels, {empty} without a surface");
        assert!(worst <= 1.0, "frame {k}: {worst:.3} times what is allowed");
        assert!(surfaces > 3000, "{surfaces} pixels compared");
        let mixed_up = Twin::new(&stage.scene, &frames[k], &frames[k]).worst(&velocities[k]).0;
        assert!(mixed_up > 10.0, "frame {k} does not move");
    }
    let nowhere = velocities[4].iter().filter(|velocity| **velocity == [NOWHERE_PX; 2]).count();
    assert!(nowhere > 1000, "{nowhere} pixels show what was behind the eye");
}

/// Samples whose nodes, skins and morph targets move.
const SAMPLES: [&str; 4] = [
    "motion/RiggedFigure/RiggedFigure.glb",
    "motion/01_morphed_cube/01_morphed_cube.gltf",
    "motion/robot/robot.glb",
    "motion/06_parent-inverse-anim/06_parent-inverse-anim.gltf",
];

/// Poses of the first animation as the camera goes by; the last frame shows the pose before once more.
fn moving(stage: &Stage) -> Vec<Shown> {
    let mut frames = path(stage, 5);
    let duration_s = stage.scene.animations.first().map_or(0.0, |animation| animation.duration_s);
    for (frame, part) in frames.iter_mut().zip([0.1, 0.22, 0.37, 0.5, 0.5]) {
        frame.pose = Some(stage.scene.pose_at(part * duration_s));
    }
    frames
}

/// Instances that turn and rise as the camera goes by.
fn turning(stage: &Stage) -> Vec<Shown> {
    let mut frames = path(stage, 3);
    for (frame, t) in frames.iter_mut().zip([0.0, 1.0, 2.0f32]) {
        let mut pose = stage.scene.pose_at(0.0);
        for (k, world_from_object) in pose.world_from_object.iter_mut().enumerate() {
            let rise = Affine3A::from_translation(Vec3::Y * 0.1 * t * (k % 2) as f32);
            *world_from_object =
                rise * *world_from_object * Affine3A::from_rotation_y(0.02 * t * (k % 3) as f32);
        }
        frame.pose = Some(pose);
    }
    frames
}

#[test]
fn instances_move_by_their_own_matrices() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let frames = turning(&stage);
    let forward = find("forward").expect("known");
    let velocities = flown(&stage, forward, (1, &[]), &frames);
    for k in 1..frames.len() {
        let (worst, surfaces, _) = Twin::new(&stage.scene, &frames[k - 1], &frames[k]).worst(&velocities[k]);
        println!("frame {k}: {worst:.3} of what is allowed, {surfaces} pixels");
        assert!(worst <= 1.0, "frame {k}: {worst:.3} times what is allowed");
    }
    let vertex = "surfaces/geometry/surface.vert";
    let changed = ("= position_before(position_os)", "= world");
    let mutant = compiled_variant(&format!("{vertex}#velocity"), &format!("{vertex}.glsl"), &[changed]);
    let found = flown(&stage, forward, (1, &[mutant]), &frames);
    let worst = Twin::new(&stage.scene, &frames[0], &frames[1]).worst(&found[1]).0;
    assert!(worst > 10.0, "surfaces where they are now: not caught, {worst:.3}");
}

#[test]
fn what_moves_by_itself_moves_with_the_camera() {
    let gpu = afterlight_testkit::gpu();
    let Some(root) = afterlight_testkit::shared_scenes() else { return };
    let forward = find("forward").expect("known");
    let mut deformed = 0;
    for sample in SAMPLES {
        let file = root.join("samples").join(sample);
        let scene = load(&file, &LoadOptions::default()).unwrap_or_else(|e| panic!("{sample}: {e}"));
        deformed += usize::from(!scene.deformations.is_empty());
        let stage = Stage::of(&gpu, scene);
        let frames = moving(&stage);
        let velocities = flown(&stage, forward, (1, &[]), &frames);
        assert!(is_zero(&velocities[0]), "{sample}: nothing was before the first frame");
        for k in 1..frames.len() {
            let twin = Twin::new(&stage.scene, &frames[k - 1], &frames[k]);
            let (worst, surfaces, empty) = twin.worst(&velocities[k]);
            println!("{sample}, frame {k}: {worst:.3} of what is allowed, {surfaces} and {empty} pixels");
            assert!(worst <= 1.0, "{sample}, frame {k}: {worst:.3} times what is allowed");
            assert!(surfaces > 100, "{sample}: {surfaces} pixels compared");
            let rigid = Shown { pose: frames[k].pose.clone(), ..frames[k - 1].clone() };
            let by_camera = Twin::new(&stage.scene, &rigid, &frames[k]).worst(&velocities[k]).0;
            let moves = k < 4;
            assert_eq!(by_camera > 1.0, moves, "{sample}, frame {k}: {by_camera:.3} off the camera's alone");
        }
    }
    assert!(deformed >= 2, "{deformed} samples with skins or morph targets");
}

/// Shaders that take one thing of this frame for that of the frame before: the twin sees each.
#[test]
fn mutants_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let Some(root) = afterlight_testkit::shared_scenes() else { return };
    let forward = find("forward").expect("known");
    let vertex = "surfaces/geometry/surface.vert#velocity";
    let mutant = |header: &str, from: &str, to: &str| compiled_variant(vertex, header, &[(from, to)]);
    let before = "surfaces/geometry/before.glsl";
    let mutants = [
        (
            "this frame's matrix",
            mutant(
                "surfaces/geometry/clip_before.glsl",
                "frame.clip_from_world_before",
                "frame.clip_from_world",
            ),
            "motion/RiggedFigure/RiggedFigure.glb",
        ),
        (
            "this frame's shapes",
            mutant(
                before,
                "vec3(positions_before[i], positions_before[i + 1u], positions_before[i + 2u])",
                "now_os",
            ),
            "motion/RiggedFigure/RiggedFigure.glb",
        ),
    ];
    for (what, shader, sample) in mutants {
        let scene = load(&root.join("samples").join(sample), &LoadOptions::default());
        let stage = Stage::of(&gpu, scene.unwrap_or_else(|e| panic!("{sample}: {e}")));
        let frames = moving(&stage);
        let velocities = flown(&stage, forward, (1, &[shader]), &frames);
        let worst = Twin::new(&stage.scene, &frames[0], &frames[1]).worst(&velocities[1]).0;
        println!("{what}: {worst:.1} times what is allowed");
        assert!(worst > 3.0, "{what}: not caught, {worst:.3}");
    }
}

#[test]
fn the_first_frame_and_a_cut_move_nothing() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let mut frames = path(&stage, 5);
    frames[2].cut = true;
    let forward = find("forward").expect("known");
    let zero: Vec<bool> = flown(&stage, forward, (1, &[]), &frames).iter().map(|one| is_zero(one)).collect();
    assert_eq!(zero, [true, false, true, false, false]);
    // A camera that stands still moves nothing either.
    let still = vec![frames[0].clone(); 3];
    assert!(flown(&stage, forward, (1, &[]), &still).iter().all(|one| is_zero(one)));
    // Nor does a view alone, however often it runs.
    let mut settings = stage.from(frames[0].camera.clone(), SIZE, 3);
    settings.view = "velocity".to_owned();
    let mut alone = stage.prepare(forward, &settings);
    for _ in 0..2 {
        alone.run().expect("drawn");
        assert!(is_zero(&velocities_of(&alone.executor().read_image(VELOCITY).expect("kept"))));
        let black = alone.final_rgba8().expect("read");
        assert!(black.chunks_exact(4).all(|pixel| pixel[..3] == [0; 3]));
    }
}

/// Velocities are of the scene, not of who draws it: one for all techniques, at any number of samples.
#[test]
fn every_technique_shows_the_same() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let frames = path(&stage, 2);
    let expected = flown(&stage, find("forward").expect("known"), (1, &[]), &frames);
    for technique in registry() {
        let samples = if technique.info().samples.contains(&4) { 4 } else { 1 };
        let found = flown(&stage, *technique, (samples, &[]), &frames);
        assert!(found == expected, "{} at {samples} samples", technique.info().id);
    }
}

/// Greatest distance of velocities from those of the points that depth of a frame drawn alone shows, seen through both cameras, in what is
/// allowed; and of how many pixels.
fn off_depth(
    stage: &Stage,
    settings: &Settings,
    [before, now]: [&Camera; 2],
    found: &[[f32; 2]],
) -> (f64, usize) {
    let settings = Settings { camera: now.clone(), keep_depth: true, ..settings.clone() };
    let mut alone = stage.prepare(find("forward").expect("known"), &settings);
    alone.run().expect("drawn");
    let depth = alone.depth().expect("read").expect("kept");
    let [a, b, c, d] = depth.to_distance.map(f64::from);
    let (mut worst, mut count) = (0.0f64, 0);
    for (k, (found, z)) in found.iter().zip(&depth.values).enumerate() {
        let center_px = DVec2::new((k as u32 % SIZE.0).into(), (k as u32 / SIZE.0).into()) + 0.5;
        let z = f64::from(*z);
        if z == 0.0 {
            worst = worst.max(if *found == [0.0; 2] { 0.0 } else { f64::INFINITY });
            continue;
        }
        let ray = ray_through(now, center_px, SIZE_PX);
        let point_ws = ray.origin_ws + (a * z + b) / (c * z + d) * ray.direction_ws;
        let before_px = place_of(before, point_ws, SIZE_PX).expect("before the eye");
        let expected = center_px - before_px;
        let allowed = expected.abs() * ROUNDING + LOST_PX;
        worst =
            worst.max(((DVec2::from_array(found.map(f64::from)) - expected).abs() / allowed).max_element());
        count += 1;
    }
    (worst, count)
}

/// Surfaces as they are, divided, and displaced: their velocities are those of the depths that `forward` draws.
#[test]
fn velocities_are_of_the_depth_that_is_drawn() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let frames = path(&stage, 3);
    let forward = find("forward").expect("known");
    let mut ways = vec![None];
    if afterlight_testkit::has_tessellation(&gpu) {
        ways.extend([Some((8.0, 0.0)), Some((4.0, 80.0))]);
    }
    for way in ways {
        let mut settings = stage.from(frames[0].camera.clone(), SIZE, 3);
        if let Some((edge_px, displacement_mm)) = way {
            settings.effects.tessellation = TessellationEffect { edge_px: Some(edge_px), displacement_mm };
        }
        let velocities = flown_with(&stage, forward, (&settings, &[]), &frames);
        for k in 1..frames.len() {
            let cameras = [&frames[k - 1].camera, &frames[k].camera];
            let (worst, count) = off_depth(&stage, &settings, cameras, &velocities[k]);
            println!("{way:?}, frame {k}: {worst:.3} of what is allowed, {count} pixels");
            assert!(worst <= 1.0 && count > 4000, "{way:?}, frame {k}: {worst:.3}, {count} pixels");
        }
    }
}

/// However many frames are on their way, each shows what it shows alone on its way.
#[test]
fn frames_in_flight_show_the_same() {
    let gpu = afterlight_testkit::gpu();
    let Some(root) = afterlight_testkit::shared_scenes() else { return };
    let forward = find("forward").expect("known");
    for sample in SAMPLES {
        let scene = load(&root.join("samples").join(sample), &LoadOptions::default());
        let stage = Stage::of(&gpu, scene.unwrap_or_else(|e| panic!("{sample}: {e}")));
        let frames = moving(&stage);
        let mut settings = stage.from(frames[0].camera.clone(), SIZE, 3);
        settings.view = "velocity".to_owned();
        let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
        let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let pictures = [1, 3].map(|in_flight| {
            let options =
                FlightOptions { in_flight, pictures: true, scene_moves: true, ..FlightOptions::default() };
            let flight = renderer.fly(forward, &Params::default(), &settings.camera, options);
            let mut flight = flight.unwrap_or_else(|e| panic!("{sample}: {e}"));
            let mut pictures = Vec::new();
            let mut done = |frame: &Done<'_>| -> Result<(), TechniqueError> {
                pictures.push(frame.rgba8.expect("asked for").to_vec());
                Ok(())
            };
            // Every pose twice in a row, so that places of the flight meet surfaces that have stopped.
            for (index, frame) in (0..).zip(frames.iter().flat_map(|frame| [frame, frame])) {
                let pose = frame.pose.as_ref().expect("a pose");
                let pose = Some(Arc::new(ScenePose::of(&stage.scene, pose, false)));
                let camera = frames[0].camera.clone();
                let context = FrameContext { index, time_s: 0.0, cut: false, camera, pose };
                flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{sample}: {e}"));
            }
            flight.land(&mut done).unwrap_or_else(|e| panic!("{sample}: {e}"));
            pictures
        });
        assert!(pictures[0] == pictures[1], "{sample}: another picture with others on their way");
        let is_black = |picture: &Vec<u8>| picture.chunks_exact(4).all(|pixel| pixel[..3] == [0; 3]);
        let black: Vec<bool> = pictures[0].iter().map(is_black).collect();
        let expected = [true, true, false, true, false, true, false, true, true, true];
        assert_eq!(black, expected, "{sample}: what stops moves no more");
    }
}
