//! The program under a display of its own: it draws what Afterlight draws alone, whatever happens to its window, and validation is silent.

use std::path::Path;
use std::process::{Command, Output};

use afterlight_image::{Rgba8Image, read_png};
use afterlight_renderer::Renderer;
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
