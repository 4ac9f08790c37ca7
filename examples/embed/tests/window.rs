//! The program under a display of its own: it draws what Afterlight draws alone, whatever happens to its window, and validation is silent.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use afterlight_image::{Rgba8Image, read_png};
use afterlight_renderer::{Done, FlightOptions, FrameContext, Renderer, ScenePose};
use afterlight_techniques::{
    Params, Settings, find,
    graph::gpu::{Device, DeviceOptions},
    scene,
};

const HALF: [u32; 2] = [320, 240];

/// Runs the program under Xvfb with validation, which prints what it finds on standard output.
fn run(args: &[&str]) -> Output {
    let output = Command::new("xvfb-run")
        .args(["--auto-servernum", env!("CARGO_BIN_EXE_embed")])
        .args(args)
        .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
        .env("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the test needs xvfb-run (package xvfb)");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{:?}\n{text}\n{errors}", output.status);
    for word in ["Validation", "VUID", "SYNC-HAZARD", "UNASSIGNED"] {
        assert!(!text.contains(word) && !errors.contains(word), "validation says:\n{text}\n{errors}");
    }
    output
}

/// What Afterlight draws on a device of its own.
fn alone(technique: &str) -> Vec<u8> {
    let device = Device::open(&DeviceOptions::default()).expect("a device");
    let scene = scene::load_source("builtin:spheres", &scene::LoadOptions::default()).expect("a scene");
    let settings = Settings::for_scene(&scene, HALF[0], HALF[1]);
    let renderer = Renderer::new(&device, &scene, &settings).expect("a renderer");
    let technique = find(technique).expect("a technique");
    let mut frame = renderer.prepare(technique, &Params::default()).expect("prepared");
    frame.run().expect("drawn");
    frame.final_rgba8().expect("read")
}

/// A half of the canvas.
fn half(canvas: &Rgba8Image, which: usize) -> Vec<u8> {
    let row = 4 * HALF[0] as usize;
    canvas.pixels.chunks_exact(2 * row).flat_map(|both| both[which * row..][..row].to_vec()).collect()
}

fn draws_what_is_drawn_alone(technique: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("canvas.png");
    let save = file.to_str().expect("a name in UTF-8");
    run(&["--frames", "6", "--technique", technique, "--save", save]);
    let canvas = read_png(Path::new(save)).expect("a picture");
    assert_eq!([canvas.width, canvas.height], [2 * HALF[0], HALF[1]]);
    let triangle = half(&canvas, 0);
    let colored = triangle.chunks_exact(4).filter(|pixel| pixel[..3].iter().any(|&c| c > 0)).count();
    let expected = (HALF[0] * HALF[1]) as f64 * 0.8 * 0.8 / 2.0;
    assert!(
        (colored as f64 / expected - 1.0).abs() < 0.02,
        "{colored} pixels of the triangle, expected {expected}"
    );
    assert!(half(&canvas, 1) == alone(technique), "{technique}: another picture than on a device of its own");
}

#[test]
fn visibility_is_drawn_to_the_bit() {
    draws_what_is_drawn_alone("visibility");
}

#[test]
fn forward_is_drawn_to_the_bit() {
    draws_what_is_drawn_alone("forward");
}

#[test]
fn a_window_that_is_resized_every_frame_goes_on() {
    let output = run(&["--frames", "120", "--resize-every-frame"]);
    let text = String::from_utf8_lossy(&output.stdout);
    let shown: u32 = text.split(' ').next().and_then(|n| n.parse().ok()).expect("a count of frames");
    assert!(shown > 60, "{text}");
}

/// A triangle whose one corner a morph target moves, as a glTF file.
fn write_morphing(folder: &Path) -> std::path::PathBuf {
    let floats: [f32; 22] = [
        -1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0, // corners
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.4, 0.0, // how far the target moves them
        0.0, 1.0, // times
        0.0, 1.0, // weights
    ];
    let bytes: Vec<u8> = floats.iter().flat_map(|value| value.to_le_bytes()).collect();
    std::fs::write(folder.join("morphing.bin"), bytes).expect("a file");
    let json = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"weights": [0], "primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}]}],
        "animations": [{"samplers": [{"input": 2, "output": 3}], "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}],
        "buffers": [{"uri": "morphing.bin", "byteLength": 88}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 36},
            {"buffer": 0, "byteOffset": 72, "byteLength": 8}, {"buffer": 0, "byteOffset": 80, "byteLength": 8}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0.5, 0.4, 0]},
            {"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
            {"bufferView": 3, "componentType": 5126, "count": 2, "type": "SCALAR"}]}"#;
    let file = folder.join("morphing.gltf");
    std::fs::write(&file, json).expect("a file");
    file
}

/// What a frame keeps for the next one reaches it through another program's command buffers: velocities of a mesh that deforms, which follow
/// from the positions that the frame before left.
#[test]
fn frames_find_what_the_one_before_left() {
    const FRAMES: u64 = 6;
    let folder = tempfile::tempdir().expect("a folder");
    let file = write_morphing(folder.path());
    let (scene_file, canvas_file) = (file.to_str().expect("UTF-8"), folder.path().join("canvas.png"));
    let save = canvas_file.to_str().expect("UTF-8");
    let frames = FRAMES.to_string();
    let args = ["--frames", &frames, "--technique", "forward", "--scene", scene_file, "--view", "velocity"];
    run(&[&args[..], &["--save", save]].concat());
    let found = half(&read_png(Path::new(save)).expect("a picture"), 1);

    let device = Device::open(&DeviceOptions::default()).expect("a device");
    let scene = scene::load_source(scene_file, &scene::LoadOptions::default()).expect("a scene");
    let settings = Settings { view: "velocity".to_owned(), ..Settings::for_scene(&scene, HALF[0], HALF[1]) };
    let renderer = Renderer::new(&device, &scene, &settings).expect("a renderer");
    let options = FlightOptions { pictures: true, scene_moves: true, ..FlightOptions::default() };
    let technique = find("forward").expect("a technique");
    let mut flight =
        renderer.fly(technique, &Params::default(), &settings.camera, options).expect("prepared");
    let mut last = Vec::new();
    let mut done = |frame: &Done<'_>| {
        last = frame.rgba8.expect("asked for").to_vec();
        Ok(())
    };
    for index in 0..FRAMES {
        let time_s = index as f64 / 30.0;
        let pose = Some(Arc::new(ScenePose::of(&scene, &scene.pose_at(time_s), false)));
        let context = FrameContext { index, time_s, cut: false, camera: settings.camera.clone(), pose };
        flight.frame(context, &mut done).expect("a frame");
    }
    flight.land(&mut done).expect("landed");
    assert!(last.chunks_exact(4).any(|pixel| pixel[..3] != [0; 3]), "something moves");
    assert!(found == last, "other velocities than on a device of its own");
}
