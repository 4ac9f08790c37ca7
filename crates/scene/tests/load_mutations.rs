//! Sample files with seeded damage: whatever comes in, the loader returns. The fuzz target in
//! `fuzz/` does the same without an end; what it finds is kept in `fuzz/corpus`.

mod load_common;

use std::{io::Cursor, path::Path};

use afterlight_scene::{
    Image, ImageData, LoadOptions, Moment, Scene, load_bytes,
    texture::{TextureRole, decode},
};
use image::{DynamicImage, ImageFormat, ImageReader};
use load_common::{check_scene, files_under, scenes_dir};
use rayon::prelude::*;

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

/// Numbers and words that change what a file means.
const WORDS: &[&str] = &[
    "0",
    "1",
    "-1",
    "65535",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "1e39",
    "-0.0",
    "0.5",
    "null",
    "[]",
    "{}",
    "\"\"",
    "5120",
    "5121",
    "5123",
    "5125",
    "5126",
    "\"VEC3\"",
    "\"SCALAR\"",
    "\"MAT4\"",
    "true",
    "[0]",
    "6",
];

/// One change: of a byte, of a number in the JSON, of the length, of a piece of the file.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    if bytes.is_empty() {
        return;
    }
    let at = random.below(bytes.len());
    match random.below(6) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 => bytes.truncate(at),
        3 => {
            let from = random.below(bytes.len());
            let count = random.below(16).min(bytes.len() - at.max(from));
            bytes.copy_within(from..from + count, at);
        }
        _ => {
            // the next number is replaced
            let digit = |b: &u8| b.is_ascii_digit();
            let Some(start) = bytes[at..].iter().position(digit).map(|p| at + p) else { return };
            let end = bytes[start..]
                .iter()
                .position(|b| !digit(b) && *b != b'.')
                .map_or(bytes.len(), |p| start + p);
            let word = WORDS[random.below(WORDS.len())];
            let before = end - start;
            bytes.splice(start..end, word.bytes());
            // GLB states the length of its JSON: keep it where spaces can
            if word.len() < before {
                let fill = std::iter::repeat_n(b' ', before - word.len());
                bytes.splice(start + word.len()..start + word.len(), fill);
            }
        }
    }
}

/// Poses a scene at several times: whatever its animations hold, nothing panics, and boxes hold what is drawn.
fn play(file: &Path, scene: &mut Scene) {
    if scene.deformations.is_empty() && scene.animations.is_empty() {
        return;
    }
    let mut pose = scene.pose_at(0.0);
    for (animation, time_s) in [(0, 0.7), (0, 1e9), (1, 0.3)] {
        scene.pose_into(Moment::Playing { animation, time_s }, &mut pose);
        scene.take_pose(&pose);
        scene.moving_instances(animation);
        for (k, instance) in scene.instances.iter().enumerate().take(64) {
            let bounds = scene.bounds_in_pose(&pose, k);
            let mesh = &scene.meshes[instance.mesh as usize];
            let range = mesh.first_vertex as usize..(mesh.first_vertex + mesh.vertex_count) as usize;
            let slack = 1e-4 * (bounds.size().max_element() + bounds.center().abs().max_element());
            for p in scene.positions_os[range].iter().take(1024) {
                let p = instance.world_from_object.transform_point3((*p).into());
                let is_held = p.cmpge(bounds.min - slack).all() && p.cmple(bounds.max + slack).all();
                // Numbers near the end of what 32 bits hold overflow in the box before they do in a vertex.
                assert!(
                    is_held || !(p.is_finite() && slack.is_finite()),
                    "{}: {p} {bounds:?}",
                    file.display()
                );
            }
        }
    }
}

fn try_load(file: &Path, bytes: &[u8]) {
    let options = LoadOptions { time_s: Some(0.25) };
    match load_bytes(file, bytes, &options) {
        Ok(mut scene) => {
            check_scene(&scene).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
            play(file, &mut scene);
            for image in scene.images.iter().filter(|i| i.width * i.height <= 1 << 16) {
                let _ = decode(image, TextureRole::Normal, Some((5, 3)));
            }
        }
        Err(e) => assert!(!e.to_string().contains('\n'), "{e:?}"),
    }
}

#[test]
fn damaged_files_end_in_a_scene_or_an_error() {
    /// Larger files take longer and show no more.
    const FILE_BYTES_MAX: u64 = 64 << 10;
    const TRIES: u64 = 60;
    let Some(dir) = scenes_dir() else { return };
    let files = files_under(&dir.join("samples"), &["gltf", "glb"]);
    let files: Vec<_> = files.into_iter().filter(|f| f.metadata().unwrap().len() <= FILE_BYTES_MAX).collect();
    assert!(files.len() > 200);
    files.par_iter().enumerate().for_each(|(i, file)| {
        let original = std::fs::read(file).unwrap();
        for k in 0..TRIES {
            let mut random = Random(i as u64 * TRIES + k);
            let mut bytes = original.clone();
            for _ in 0..=random.below(4) {
                mutate(&mut bytes, &mut random);
            }
            try_load(file, &bytes);
        }
    });
}

#[test]
fn damaged_obj_files_end_in_a_scene_or_an_error() {
    // Materials and indices of every kind: tests in `src/obj.rs`, which need no files.
    let original = "mtllib a.mtl\no one\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl m\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf 1 2 3\nl 1 2\n";
    (0..20_000u64).into_par_iter().for_each(|seed| {
        let mut random = Random(seed);
        let mut bytes = original.as_bytes().to_vec();
        for _ in 0..=random.below(4) {
            mutate(&mut bytes, &mut random);
        }
        try_load(Path::new("damaged.obj"), &bytes);
    });
}

/// Small images in every format, and every kind of pixels, that a scene may bring.
fn encoded_images() -> Vec<(String, Vec<u8>)> {
    let (width, height) = (11, 7);
    let colors = DynamicImage::ImageRgba8(image::RgbaImage::from_fn(width, height, |x, y| {
        image::Rgba([x * 23, y * 31, x * y, 255 - x].map(|v| v as u8))
    }));
    let (luma8, luma16) = (colors.to_luma8(), colors.to_luma16());
    let pngs: [DynamicImage; 8] = [
        luma8.clone().into(),
        colors.to_luma_alpha8().into(),
        colors.to_rgb8().into(),
        colors.to_rgba8().into(),
        luma16.into(),
        colors.to_luma_alpha16().into(),
        colors.to_rgb16().into(),
        colors.to_rgba16().into(),
    ];
    let jpegs: [DynamicImage; 2] = [luma8.into(), colors.to_rgb8().into()];
    let pngs = pngs.map(|image| (ImageFormat::Png, image));
    let images = pngs.into_iter().chain(jpegs.map(|image| (ImageFormat::Jpeg, image)));
    images
        .map(|(format, image)| {
            let mut bytes = Cursor::new(Vec::new());
            image.write_to(&mut bytes, format).unwrap();
            (format!("{format:?} {:?}", image.color()), bytes.into_inner())
        })
        .collect()
}

#[test]
fn damaged_images_end_in_texels_or_an_error() {
    /// Larger ones are refused or take memory and time, and show no more.
    const PIXELS_MAX: u64 = 1 << 20;
    const TRIES: u64 = 2000;
    let roles = [TextureRole::BaseColor, TextureRole::Emissive, TextureRole::Normal, TextureRole::Data];
    for (name, original) in encoded_images() {
        let (refused, accepted) = (0..TRIES)
            .into_par_iter()
            .map(|seed| {
                let mut random = Random(seed);
                let mut bytes = original.clone();
                for _ in 0..random.below(4) {
                    mutate(&mut bytes, &mut random);
                }
                let size =
                    ImageReader::new(Cursor::new(&bytes)).with_guessed_format().unwrap().into_dimensions();
                if size.is_ok_and(|(width, height)| u64::from(width) * u64::from(height) > PIXELS_MAX) {
                    return (0, 0);
                }
                let data = ImageData::Encoded(bytes.into());
                let image = Image { name: name.clone(), data, width: 11, height: 7 };
                match decode(&image, roles[random.below(4)], Some((5, 3))) {
                    Ok(chain) => {
                        assert_eq!((chain.width, chain.height, chain.levels.len()), (5, 3, 3), "{name}");
                        (0, 1)
                    }
                    Err(e) => {
                        let error = e.to_string();
                        assert!(error.starts_with(&name) && error.contains("expected"), "{error}");
                        assert!(!error.contains('\n'), "{error:?}");
                        (1, 0)
                    }
                }
            })
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        println!("{name}: {refused} refused, {accepted} accepted");
        assert!(refused > 100 && accepted > 100, "{name}: {refused} refused, {accepted} accepted");
    }
}

#[test]
fn cases_that_the_fuzzer_kept_return() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/load");
    let mut count = 0;
    for entry in std::fs::read_dir(&dir).unwrap_or_else(|e| panic!("{}: {e}", dir.display())) {
        let bytes = std::fs::read(entry.unwrap().path()).unwrap();
        let Some((format, bytes)) = bytes.split_first() else { continue };
        let name = ["fuzz.gltf", "fuzz.glb", "fuzz.obj"][usize::from(*format) % 3];
        try_load(Path::new(name), bytes);
        count += 1;
    }
    assert!(count > 0, "no cases in {}", dir.display());
}
