//! Frames in flight are, to the bit, the pictures that a view prepared alone gives, for every technique along a path.

mod common;

use afterlight_image::Rgba8Image;
use afterlight_renderer::{Done, Event, Flight, FlightOptions, FrameContext, Renderer, Shortfall};
use afterlight_techniques::{
    Params, Technique, TechniqueError, find, registry,
    scene::{Camera, Projection},
};
use common::{Stage, image_of, params, psnr};
use glam::Vec3;

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

/// Flies along cameras and returns pictures and events.
fn flown(flight: &mut Flight<'_>, cameras: &[Camera]) -> (Vec<Rgba8Image>, Vec<Vec<Event>>) {
    let (mut pictures, mut events) = (Vec::new(), Vec::new());
    let mut done = |frame: &Done<'_>| -> Result<(), TechniqueError> {
        assert_eq!(frame.index, pictures.len() as u64, "frames come in their order");
        assert!(!frame.fell_short);
        let pixels = frame.rgba8.expect("asked for").to_vec();
        pictures.push(Rgba8Image { width: SIZE.0, height: SIZE.1, pixels });
        events.push(frame.events.to_vec());
        Ok(())
    };
    for (index, camera) in (0..).zip(cameras) {
        let context = FrameContext { index, time_s: 0.0, camera: camera.clone(), world_from_objects: None };
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
            let (pictures, events) = flown(&mut flight, &cameras);
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
        let (pictures, events) = flown(&mut flight, &cameras);
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
                FrameContext { index, time_s: 0.0, camera: camera.clone(), world_from_objects: None };
            flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{id}: {e}"));
        }
        flight.land(&mut done).unwrap_or_else(|e| panic!("{id}: {e}"));
        assert_eq!((short[0], short[2], short[6]), (false, true, false), "{id}: {short:?}");
    }
}
