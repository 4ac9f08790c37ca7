//! Textures that do not decode: an upload ends, whatever their number and whichever are bad, and names the first of them.

mod common;

use std::{
    path::PathBuf,
    sync::{Mutex, mpsc},
    time::Duration,
};

use afterlight_image::{Rgba8Image, encode_png};
use afterlight_techniques::{
    SceneGpu,
    graph::gpu,
    scene::{Image, ImageData, LoadOptions, Material, Sampler, Scene, TextureRef, load_source},
};

/// Far longer than an upload of a few texels takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

const SIZE: u32 = 8;

fn png() -> Vec<u8> {
    let pixels = (0..4 * SIZE * SIZE).map(|i| (i * 37) as u8).collect();
    encode_png(&Rgba8Image { width: SIZE, height: SIZE, pixels }).unwrap_or_else(|e| panic!("{e}"))
}

fn encoded(bytes: &[u8]) -> ImageData {
    ImageData::Encoded(bytes.into())
}

/// Images whose header is right and whose rest is not: what a loader lets through.
fn damaged() -> Vec<(&'static str, ImageData)> {
    let png = png();
    let mut wrong_checksum = png.clone();
    let last = wrong_checksum.len() - 13;
    wrong_checksum[last] ^= 0xff;
    // Start of image, a frame of 8 × 8 pixels in one component, end.
    let jpeg = b"\xff\xd8\xff\xc0\0\x0b\x08\0\x08\0\x08\x01\x01\x11\0\xff\xd9";
    let rgba8 = |bytes: usize| ImageData::Rgba8 { width: SIZE, height: SIZE, pixels: vec![0; bytes].into() };
    vec![
        ("a PNG that ends after its header", encoded(&png[..33])),
        ("a PNG that ends in its pixels", encoded(&png[..png.len() / 2])),
        ("a PNG with a wrong checksum", encoded(&wrong_checksum)),
        ("a PNG of nothing", encoded(b"\x89PNG\r\n\x1a\n")),
        ("a JPEG without pixels", encoded(jpeg)),
        ("a JPEG that ends", encoded(&jpeg[..10])),
        ("no bytes", encoded(b"")),
        ("another format", encoded(b"GIF89a\x08\0\x08\0\0\0\0;")),
        ("a file that is gone", ImageData::File(PathBuf::from("gone.png"))),
        ("too few pixels", rgba8(4 * (SIZE * SIZE) as usize - 1)),
        ("no pixels", rgba8(0)),
    ]
}

/// A scene with so many textures in all four roles, those that `is_bad` says replaced by `bad`.
fn scene_of(count: usize, is_bad: impl Fn(usize) -> bool, bad: &ImageData) -> Scene {
    let mut scene = load_source("builtin:edge", &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.images.is_empty());
    let good = encoded(&png());
    for i in 0..count {
        let data = if is_bad(i) { bad } else { &good }.clone();
        scene.images.push(Image { name: format!("texture {i}."), data, width: SIZE, height: SIZE });
        let texture = TextureRef {
            image: i as u32,
            sampler: Sampler::default(),
            uv_set: 0,
            uv_transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        };
        let mut material = Material::default();
        let slot = match i % 4 {
            0 => &mut material.base_color_texture,
            1 => &mut material.metallic_roughness_texture,
            2 => &mut material.normal_texture,
            _ => &mut material.emissive_texture,
        };
        *slot = Some(texture);
        scene.materials.push(material);
    }
    scene
}

/// What an upload returns. It runs on a thread of its own, so that one that never ends is a failure and not a test that never ends.
fn uploaded(device: &gpu::Device, scene: Scene, what: &str) -> Result<(), String> {
    let (send, receive) = mpsc::channel();
    let device = device.clone();
    std::thread::spawn(move || {
        let result = SceneGpu::upload(&device, &scene, &|_, _| {});
        let _ = send.send(result.map(|_| ()).map_err(|e| e.to_string()));
    });
    receive.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("{what}: the upload does not end: {e}"))
}

fn fails_naming(device: &gpu::Device, scene: Scene, first_bad: usize, what: &str) {
    assert!(scene.images.len() > first_bad, "{what}");
    let error = uploaded(device, scene, what).expect_err(what);
    let is_file = error.starts_with("gone.png");
    assert!(is_file || error.starts_with(&format!("texture {first_bad}.: image: found ")), "{what}: {error}");
    assert!(error.contains("expected") && !error.contains('\n'), "{what}: {error}");
}

/// Which textures are bad, in words and by number, and the first of them.
type BadSet<'a> = (&'a str, &'a dyn Fn(usize) -> bool, usize);

#[test]
fn any_number_of_textures_of_which_any_are_bad_end_in_an_error() {
    let gpu = afterlight_testkit::gpu();
    let (name, bad) = &damaged()[1];
    // Fewer, as many, and more than are decoded ahead; more than any machine has cores.
    for count in [1, 2, 4, 5, 6, 24, 300] {
        let sets: [BadSet; 6] = [
            ("the first", &|i| i == 0, 0),
            ("the last", &|i| i == count - 1, count - 1),
            ("one in the middle", &|i| i == count / 2, count / 2),
            ("all but the first", &|i| i > 0, 1.min(count - 1)),
            ("every other", &|i| i % 2 == 1, 1.min(count - 1)),
            ("all", &|_| true, 0),
        ];
        for (which, is_bad, first) in sets {
            let scene = scene_of(count, is_bad, bad);
            if scene.images.iter().enumerate().any(|(i, _)| is_bad(i)) {
                fails_naming(&gpu, scene, first, &format!("{which} of {count} is {name}"));
            }
        }
    }
}

#[test]
fn every_kind_of_damage_ends_in_an_error() {
    let gpu = afterlight_testkit::gpu();
    for (name, bad) in damaged() {
        for role in 0..4 {
            let scene = scene_of(24, |i| i % 4 == role, &bad);
            fails_naming(&gpu, scene, role, &format!("{name} in role {role}"));
        }
    }
}

/// Callers may be all the threads of the pool that others share: decoding must not wait for one of them.
#[test]
fn uploads_from_all_threads_of_the_pool_end() {
    let gpu = afterlight_testkit::gpu();
    let device = gpu.clone();
    let (send, receive) = mpsc::channel();
    std::thread::spawn(move || {
        let turn = Mutex::new(());
        let results = rayon::broadcast(|_| {
            let _turn = turn.lock();
            let scene = scene_of(24, |_| false, &encoded(b""));
            SceneGpu::upload(&device, &scene, &|_, _| {}).map(|_| ()).map_err(|e| e.to_string())
        });
        let _ = send.send(results);
    });
    let results = receive.recv_timeout(PATIENCE).expect("the uploads do not end");
    assert!(results.iter().all(Result::is_ok), "{results:?}");
}
