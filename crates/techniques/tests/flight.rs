//! Frames in flight are, to the bit, the pictures that a view prepared alone gives, for every technique along a path.

mod common;

use std::sync::Arc;

use afterlight_image::Rgba8Image;
use afterlight_renderer::{Done, Event, Flight, FlightOptions, FrameContext, Renderer, ScenePose, Shortfall};
use afterlight_techniques::{
    Indirect, Params, Settings, Shadows, Technique, TechniqueError, find, registry,
    scene::{self, Camera, Light, Projection},
};
use common::{Stage, image_of, params, psnr};
use glam::{Affine3A, Vec3};

const SIZE: (u32, u32) = (97, 55);
/// Panes, foliage cards, drapes, and textures of every kind.
const SCENE: &str = "builtin:colonnade?triangles=20000";
const LIGHTS: u32 = 20;
/// Techniques that visit lights in no defined order agree with themselves to this, dB.
const UNORDERED_DB: f64 = 100.0;

/// A walk along the colonnade that turns around, so that draws and panes come and go, with a jump.
fn path(stage: &Stage, frames: u64) -> Vec<Camera> {
    let first = stage.scene.cameras.first().expect("a camera").clone();
    let Projection::Perspective { fov_y_rad, near_m } = first.projection else {
        panic!("found an orthographic camera, expected a perspective one")
    };
    let eye = first.eye_ws();
    let forward = -Vec3::from(first.world_from_view.matrix3.z_axis);
    let at = |frame: u64| {
        let t = frame as f32;
        let jump = if frame % 5 == 4 { 2.0 } else { 0.0 };
        let place = eye + forward * (0.7 * t + jump) + Vec3::Y * 0.1 * t;
        let turn = glam::Quat::from_rotation_y(0.4 * t);
        Camera::look_at("flight", place, place + turn * forward, fov_y_rad, near_m)
    };
    (0..frames).map(at).collect()
}

/// Frames of a scene that stands still.
fn still(cameras: &[Camera]) -> impl Iterator<Item = FrameContext> + '_ {
    (0..).zip(cameras).map(|(index, camera)| FrameContext {
        index,
        time_s: 0.25,
        cut: false,
        camera: camera.clone(),
        pose: None,
    })
}

/// Flies and returns pictures and events.
fn flown(
    flight: &mut Flight,
    contexts: impl IntoIterator<Item = FrameContext>,
) -> (Vec<Rgba8Image>, Vec<Vec<Event>>) {
    let (mut pictures, mut events) = (Vec::new(), Vec::new());
    let mut done = |frame: &Done<'_>| -> Result<(), TechniqueError> {
        assert_eq!(frame.index, pictures.len() as u64, "frames come in their order");
        assert!(!frame.fell_short);
        let pixels = frame.rgba8.expect("asked for").to_vec();
        pictures.push(Rgba8Image { width: SIZE.0, height: SIZE.1, pixels });
        events.push(frame.events.to_vec());
        Ok(())
    };
    for context in contexts {
        flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{e}"));
    }
    flight.land(&mut done).unwrap_or_else(|e| panic!("{e}"));
    (pictures, events)
}

/// Frames whose picture is not that of its view, and by how much, dB.
fn unlike(flown: &[Rgba8Image], alone: &[Rgba8Image]) -> Vec<(usize, f64)> {
    assert_eq!(flown.len(), alone.len());
    let pairs = flown.iter().zip(alone).enumerate();
    pairs.filter(|(_, (a, b))| a.pixels != b.pixels).map(|(i, (a, b))| (i, psnr(a, b))).collect()
}

fn options() -> FlightOptions {
    FlightOptions { pictures: true, ..FlightOptions::default() }
}

/// Pictures of a technique from each camera alone.
fn alone(
    stage: &Stage,
    technique: &dyn Technique,
    params: &Params,
    samples: u32,
    path: &[Camera],
) -> Vec<Rgba8Image> {
    let of = |camera: &Camera| {
        let mut settings = stage.from(camera.clone(), SIZE, LIGHTS);
        settings.samples = samples;
        image_of(&mut stage.prepare_with(technique, &settings, params))
    };
    path.iter().map(of).collect()
}

#[test]
fn every_frame_is_the_picture_of_its_view() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, SCENE);
    let cameras = path(&stage, 6);
    let mut compared = 0;
    for technique in registry() {
        for samples in [1, 4].into_iter().filter(|samples| technique.info().samples.contains(samples)) {
            let id = technique.info().id;
            let mut settings = stage.from(cameras[0].clone(), SIZE, LIGHTS);
            settings.samples = samples;
            let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
            let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
            let mut flight = renderer
                .fly(*technique, &Params::default(), &cameras[0], options())
                .unwrap_or_else(|e| panic!("{id}: {e}"));
            assert!(flight.moves_without_plans(), "{id} at {samples} samples");
            let (pictures, events) = flown(&mut flight, still(&cameras));
            assert!(!events.concat().contains(&Event::Planned), "{id} at {samples} samples");
            let alone = alone(&stage, *technique, &Params::default(), samples, &cameras);
            let off: Vec<_> =
                unlike(&pictures, &alone).into_iter().filter(|(_, db)| *db < UNORDERED_DB).collect();
            assert!(off.is_empty(), "{id} at {samples} samples: frames and dB {off:?}");
            // The mutant: every frame with the constants of the frame before.
            let mut late = pictures.clone();
            late.rotate_right(1);
            assert_eq!(unlike(&late, &alone).len(), cameras.len(), "{id}: the path shows too little");
            compared += 1;
        }
    }
    assert!(compared >= 24, "{compared}");
}

/// A view that needs a hundred times the room of the view before it: the frame is drawn again before it is handed on, or told to have fallen
/// short, as asked; and the flight goes on without a frame that lacks anything.
#[test]
fn a_view_that_needs_far_more_than_the_last_is_drawn_again_or_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, SCENE);
    let near = path(&stage, 3);
    // Away from everything: lists need nothing.
    let bounds = stage.scene.bounds_ws();
    let away = bounds.max + bounds.size();
    let nothing = Camera::look_at("away", away, away + Vec3::ONE, 1.0, 0.1);
    let cameras = [&nothing, &nothing, &near[0], &near[1], &near[2], &nothing, &near[0]].map(Clone::clone);
    for (id, sets, samples) in [
        ("gbuffer-list", &[][..], 4),
        ("dais", &[("fill", "cache")][..], 4),
        ("dais-list", &[][..], 4),
        ("clustered", &[][..], 1),
        ("light-list", &[][..], 1),
    ] {
        let technique = find(id).expect("known");
        let params = params(technique, sets);
        let mut settings = stage.from(nothing.clone(), SIZE, LIGHTS);
        settings.samples = samples;
        let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
        let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let mut flight =
            renderer.fly(technique, &params, &nothing, options()).unwrap_or_else(|e| panic!("{id}: {e}"));
        let pipelines = gpu.pipeline_count();
        let (pictures, events) = flown(&mut flight, still(&cameras));
        let made = gpu.pipeline_count() - pipelines;
        println!("{id}: growth made {made} pipelines");
        assert!(id != "dais" || made == 0, "a triangle buffer that grows makes {made} pipelines anew");
        let alone = alone(&stage, technique, &params, samples, &cameras);
        let off: Vec<_> =
            unlike(&pictures, &alone).into_iter().filter(|(_, db)| *db < UNORDERED_DB).collect();
        assert!(off.is_empty(), "{id}: frames and dB {off:?}");
        assert!(events[2].contains(&Event::DrawnAgain), "{id}: {events:?}");
        assert!(events[0].is_empty() && events[6].is_empty(), "{id}: {events:?}");

        let tell = FlightOptions { shortfall: Shortfall::Tell, ..options() };
        let mut flight =
            renderer.fly(technique, &params, &nothing, tell).unwrap_or_else(|e| panic!("{id}: {e}"));
        let mut short = Vec::new();
        let mut done = |frame: &Done<'_>| -> Result<(), TechniqueError> {
            assert!(!frame.events.contains(&Event::DrawnAgain), "{id}");
            short.push(frame.fell_short);
            Ok(())
        };
        for (index, camera) in (0..).zip(&cameras) {
            let context =
                FrameContext { index, time_s: 0.25, cut: false, camera: camera.clone(), pose: None };
            flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{id}: {e}"));
            // What a list needs shows only where those that it follows from have room, so it takes a frame each. Landing, not the device's
            // speed, says which frames know of which.
            flight.land(&mut done).unwrap_or_else(|e| panic!("{id}: {e}"));
            // The plan with room is made on another thread.
            flight.wait_for_plan().unwrap_or_else(|e| panic!("{id}: {e}"));
        }
        assert_eq!((short[0], short[2], short[6]), (false, true, false), "{id}: {short:?}");
    }
}

/// Where surfaces and lights are in a frame: instances turn and rise, lights go around.
fn pose_of(stage: &Stage, lights: &[Light], frame: u64) -> ScenePose {
    let t = frame as f32;
    let moved = |(i, instance): (usize, &scene::Instance)| {
        let turn = Affine3A::from_rotation_y(0.15 * t * (i % 3) as f32);
        let rise = Affine3A::from_translation(Vec3::Y * 0.2 * t * (i % 2) as f32);
        rise * instance.world_from_object * turn
    };
    let center = stage.scene.bounds_ws().center();
    let around = Affine3A::from_translation(center)
        * Affine3A::from_rotation_y(0.9 * t)
        * Affine3A::from_translation(-center);
    ScenePose {
        world_from_objects: stage.scene.instances.iter().enumerate().map(moved).collect(),
        lights: Some(
            lights
                .iter()
                .map(|light| Light { position_ws: around.transform_point3(light.position_ws), ..*light })
                .collect(),
        ),
        shapes: None,
    }
}

/// Frames of a scene that moves are what that scene is, uploaded as it stands: surfaces, panes, lights, the shadows of one of them and what it
/// lights indirectly.
#[test]
fn every_frame_of_a_scene_that_moves_is_the_picture_of_its_pose() {
    const FRAMES: u64 = 4;
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000&texture=64");
    let camera = stage.scene.cameras.first().expect("a camera").clone();
    let settings = stage.from(camera.clone(), SIZE, LIGHTS).with_effects(|effects| {
        (effects.shadows.method, effects.shadows.map_size_px) = (Shadows::Map, 256);
        (effects.indirect.method, effects.indirect.map_size_px) = (Indirect::Rsm, 64);
    });
    let poses: Vec<Arc<ScenePose>> =
        (0..FRAMES).map(|frame| Arc::new(pose_of(&stage, &settings.lights, frame))).collect();
    let posed: Vec<Stage> = poses
        .iter()
        .map(|pose| {
            let mut scene = stage.scene.clone();
            for (instance, world_from_object) in scene.instances.iter_mut().zip(&pose.world_from_objects) {
                instance.world_from_object = *world_from_object;
            }
            Stage::of(&gpu, scene)
        })
        .collect();
    let options = FlightOptions { scene_moves: true, ..options() };
    for technique in registry() {
        let samples = if technique.info().samples.contains(&4) { 4 } else { 1 };
        let id = technique.info().id;
        let settings = Settings { samples, ..settings.clone() };
        let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
        let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let mut flight = renderer
            .fly(*technique, &Params::default(), &camera, options)
            .unwrap_or_else(|e| panic!("{id}: {e}"));
        // The last frame is at rest again, as the first pose is.
        let moving = poses.iter().map(|pose| Some(pose.clone())).chain([None]);
        let contexts = (0..).zip(moving).map(|(index, pose)| FrameContext {
            index,
            time_s: 0.25,
            cut: false,
            camera: camera.clone(),
            pose,
        });
        let (mut pictures, _) = flown(&mut flight, contexts);
        let at_rest = pictures.pop().expect("a last frame");
        let of_pose = |(stage, pose): (&Stage, &Arc<ScenePose>)| {
            let lights = pose.lights.clone().expect("they move");
            let mut prepared = stage.prepare(*technique, &Settings { lights, ..settings.clone() });
            image_of(&mut prepared)
        };
        let alone: Vec<Rgba8Image> = posed.iter().zip(&poses).map(of_pose).collect();
        let off: Vec<_> =
            unlike(&pictures, &alone).into_iter().filter(|(_, db)| *db < UNORDERED_DB).collect();
        assert!(off.is_empty(), "{id} at {samples} samples: frames and dB {off:?}");
        let off: Vec<_> =
            unlike(&[at_rest], &alone[..1]).into_iter().filter(|(_, db)| *db < UNORDERED_DB).collect();
        assert!(off.is_empty(), "{id} at {samples} samples, at rest again: {off:?}");
        // The mutant: every frame in the pose of the frame before.
        let mut late = pictures.clone();
        late.rotate_right(1);
        assert_eq!(unlike(&late, &alone).len(), poses.len(), "{id}: the poses show too little");
    }
}

#[test]
fn poses_that_do_not_fit_a_flight_are_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let settings = stage.settings(SIZE, 3);
    let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
    let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    let told = |scene_moves: bool, pose: ScenePose| {
        let options = FlightOptions { scene_moves, ..FlightOptions::default() };
        let technique = find("visibility").expect("known");
        let mut flight = renderer
            .fly(technique, &Params::default(), &settings.camera, options)
            .unwrap_or_else(|e| panic!("{e}"));
        let context = FrameContext {
            index: 0,
            time_s: 0.25,
            cut: false,
            camera: settings.camera.clone(),
            pose: Some(Arc::new(pose)),
        };
        flight.frame(context, &mut |_| Ok(())).expect_err("is refused").to_string()
    };
    let good = pose_of(&stage, &settings.lights, 1);
    assert!(told(false, good.clone()).contains("scene_moves"));
    let fewer = ScenePose { lights: Some(settings.lights[1..].to_vec()), ..good.clone() };
    assert!(told(true, fewer).contains("than the 3"));
    let mut mirrored = good;
    mirrored.world_from_objects[0] *= Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    assert!(told(true, mirrored).contains("instance 0"));
}

/// Flights of other techniques, sizes and samples, one after another: the device holds as much after each round as after the round before.
#[test]
fn flights_give_back_what_they_held() {
    const ROUNDS: usize = 5;
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000&texture=64");
    let cameras = path(&stage, 20);
    let mut held_bytes = Vec::new();
    for _ in 0..ROUNDS {
        for (id, samples, size) in [
            ("visibility", 1, SIZE),
            ("clustered-forward", 4, (64, 36)),
            ("dais", 4, (97, 36)),
            ("deferred", 1, (33, 19)),
        ] {
            let mut settings = stage.from(cameras[0].clone(), size, LIGHTS);
            settings.samples = samples;
            let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
            let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
            let technique = find(id).expect("known");
            let mut flight = renderer
                .fly(technique, &Params::default(), &cameras[0], FlightOptions::default())
                .unwrap_or_else(|e| panic!("{id}: {e}"));
            for context in still(&cameras) {
                flight.frame(context, &mut |_| Ok(())).unwrap_or_else(|e| panic!("{id}: {e}"));
            }
            // Dropped with frames on their way.
        }
        held_bytes.push(gpu.held_bytes());
    }
    assert_eq!(held_bytes[1..], [held_bytes[1]; ROUNDS - 1], "{held_bytes:?}");
}

/// A scene from memory whose instance and light move by their handles shows what one that was made so shows.
#[test]
fn handles_move_instances_and_lights() {
    let gpu = afterlight_testkit::gpu();
    let make = |at: Vec3, shine: Vec3| {
        let mut scene = scene::SceneBuilder::new("two triangles");
        let material = scene.material(scene::Material::default()).expect("a material");
        let positions_os = [[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.5, 0.0]];
        let source = scene::MeshSource { positions_os: &positions_os, ..Default::default() };
        let mesh = scene.mesh("triangle", &source, material).expect("a mesh");
        scene.instance("still", mesh, Affine3A::IDENTITY).expect("an instance");
        let instance = scene.instance("moved", mesh, Affine3A::from_translation(at)).expect("an instance");
        let light = scene.light(Light {
            kind: scene::LightKind::Directional,
            position_ws: Vec3::ZERO,
            direction_ws: shine,
            intensity: Vec3::splat(3.0),
            range_m: f32::INFINITY,
        });
        scene.camera(Camera::look_at("front", Vec3::Z * 4.0, Vec3::ZERO, 0.7, 0.1));
        (scene.finish(), instance, light)
    };
    let (from, to) = ((Vec3::NEG_X, Vec3::NEG_Z), (Vec3::new(0.8, 0.3, 0.5), Vec3::new(0.0, -0.6, -0.8)));
    let (scene, instance, light) = make(from.0, from.1);
    let settings = Settings::for_scene(&scene, SIZE.0, SIZE.1);
    let renderer = Renderer::new(&gpu, &scene, &settings).expect("a renderer");
    let mut pose = ScenePose::at_rest(&scene);
    *pose.instance(instance).expect("its own") = Affine3A::from_translation(to.0);
    pose.light(light).expect("its own").direction_ws = to.1;
    let (wanted, ..) = make(to.0, to.1);
    let wanted_renderer = Renderer::new(&gpu, &wanted, &settings_of(&wanted)).expect("a renderer");
    for id in ["visibility", "forward"] {
        let technique = find(id).expect("a technique");
        let options = FlightOptions { scene_moves: true, ..options() };
        let mut flight =
            renderer.fly(technique, &Params::default(), &settings.camera, options).expect("prepared");
        let camera = settings.camera.clone();
        let pose = Some(Arc::new(pose.clone()));
        let (pictures, _) =
            flown(&mut flight, [FrameContext { index: 0, time_s: 0.25, cut: false, camera, pose }]);
        let mut alone = wanted_renderer.prepare(technique, &Params::default()).expect("prepared");
        alone.run().expect("drawn");
        let wanted = alone.final_rgba8().expect("read");
        assert!(wanted.chunks_exact(4).any(|pixel| pixel[0] > 0), "{id}: something shows");
        assert!(pictures[0].pixels == wanted, "{id}: a pose is not what it says");
    }
}

fn settings_of(scene: &scene::Scene) -> Settings {
    Settings::for_scene(scene, SIZE.0, SIZE.1)
}
