//! Views of triangle records: counts of samples, errors against the rasteriser.

mod common;

use afterlight_renderer::Prepared;
use afterlight_stages::views::{ATTRIBUTE_ERRORS, RECORD_SAMPLES};
use afterlight_techniques::{
    Params, Settings, Technique, find,
    graph::gpu,
    scene::{Camera, Projection},
    shader::Shader,
    views,
};
use common::{Stage, compiled, params, source};

/// Techniques whose samples refer to triangle records, in every way that they fill them.
const WAYS: &[(&str, &[(&str, &str)])] = &[
    ("dais", &[("visibility", "raster")]),
    ("dais", &[("visibility", "compute")]),
    ("dais", &[("fill", "cache")]),
    ("dais", &[("fill", "cache"), ("reference-bits", "8")]),
    ("dais-list", &[]),
    ("dais-multirate", &[("visibility", "raster")]),
];

/// Largest and mean error of positions, the scene's longest side being 2, and mean difference of base colours: measured on
/// lavapipe 2.2e-6, 1.0e-7 and 8e-4.
const POSITION_MAX: f64 = 5e-6;
const POSITION_MEAN: f64 = 3e-7;
const TEXTURE_MEAN: f64 = 1e-3;

fn ways(samples: u32) -> impl Iterator<Item = (&'static dyn Technique, Params, String)> {
    let way = move |(id, sets): &(&'static str, &[(&str, &str)])| {
        let technique = find(id).unwrap();
        (technique, params(technique, sets), format!("{id} {sets:?}, {samples} samples"))
    };
    WAYS.iter().map(way).filter(move |(technique, ..)| technique.info().samples.contains(&samples))
}

/// Sample counts that the device has.
fn counts(device: &gpu::Device) -> Vec<u32> {
    afterlight_testkit::sample_counts(device, &[1, 4, 8])
}

fn prepared(
    stage: &Stage,
    settings: &Settings,
    way: &(&dyn Technique, Params, String),
    mutant: Option<Shader>,
) -> Prepared {
    let mut prepared = stage.prepare_shaders(way.0, settings, &way.1, mutant);
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    prepared
}

/// Words of a buffer that a view keeps.
fn words(prepared: &mut Prepared, technique: &dyn Technique, buffer: &str) -> Vec<u32> {
    let name = format!("{}/{buffer}", technique.info().id);
    let bytes = prepared.executor().read_buffer(name.as_str()).unwrap_or_else(|e| panic!("{e}"));
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// `heat` of heat.glsl.
fn heat(t: f32) -> [f32; 3] {
    const STOPS: [[f32; 3]; 6] =
        [[0.0; 3], [0.0, 0.0, 0.6], [0.0, 0.6, 0.1], [0.9, 0.8, 0.0], [0.8, 0.0, 0.0], [1.0; 3]];
    let t = t.clamp(0.0, 5.0);
    let i = (t as usize).min(4);
    [0, 1, 2].map(|c| STOPS[i][c] + (STOPS[i + 1][c] - STOPS[i][c]) * (t - i as f32))
}

/// On a white surface before black, the counts sum to the samples that `forward` shows white, and a pixel's colour is that of
/// its triangles' counts.
#[test]
fn samples_of_a_record_are_counted() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:edge");
    // From so far that both triangles show.
    let camera = Camera {
        projection: Projection::Orthographic { half_height_m: 8.0, near_m: 0.1, far_m: 10.0 },
        ..stage.scene.cameras[0].clone()
    };
    for samples in counts(&gpu) {
        let settings = Settings { samples, keep_hdr: true, ..stage.from(camera.clone(), (101, 57), 0) };
        let white = stage.radiance(find("forward").unwrap(), &settings);
        let covered: f64 = white.iter().map(|p| f64::from(p[0] * samples as f32)).sum();
        let settings = Settings { view: views::TRIANGLE_SHARING.to_owned(), ..settings };
        for way in ways(samples) {
            let mut prepared = prepared(&stage, &settings, &way, None);
            let counts = words(&mut prepared, way.0, RECORD_SAMPLES);
            let image = prepared.hdr_rgba().unwrap().expect("kept");
            let sum: f64 = counts.iter().map(|c| f64::from(*c)).sum();
            println!("{}: {sum} of {covered} samples in {:?}", way.2, &counts[..4]);
            assert_eq!(sum, covered, "{}", way.2);
            let used: Vec<u32> = counts.into_iter().filter(|count| *count > 0).collect();
            assert_eq!(used.len(), 2, "{}: {used:?}", way.2);
            let worst = |factor: f32| {
                let colors: Vec<_> =
                    used.iter().map(|c| heat(1.0 + (*c as f32 * factor).log2() / 4.0)).collect();
                let off = |p: &[f32], q: &[f32; 3]| (0..3).map(|c| (p[c] - q[c]).abs()).fold(0.0, f32::max);
                let nearest = |p: &[f32]| colors.iter().map(|q| off(p, q)).fold(f32::MAX, f32::min);
                let full = image.chunks_exact(4).zip(&white).filter(|(_, w)| w[0] == 1.0);
                // A pixel of two triangles has a colour between theirs.
                let mut all: Vec<f32> = full.map(|(p, _)| nearest(p)).collect();
                all.sort_by(f32::total_cmp);
                all[all.len() * 9 / 10]
            };
            assert!(worst(1.0) < 0.002, "{}: colours are off by {}", way.2, worst(1.0));
            assert!(worst(1.2) > 0.002, "{}: a fifth more samples go unseen", way.2);
            let beyond = image.chunks_exact(4).zip(&white).filter(|(_, w)| w[0] == 0.0);
            assert!(beyond.clone().count() > 1000);
            assert!(beyond.into_iter().all(|(p, _)| p[..3] == [0.0; 3]), "{}: a background of colour", way.2);
        }
    }
}

/// Of triangles that tessellation makes, too: every sample refers to one. What they should be there is no way to tell.
#[test]
fn tessellated_surfaces_share_and_are_not_compared() {
    let gpu = afterlight_testkit::gpu();
    if !afterlight_testkit::has_tessellation(&gpu) {
        return;
    }
    let stage = Stage::new(&gpu, "builtin:edge");
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.settings((101, 57), 0) }
            .with_effects(|effects| effects.tessellation.edge_px = Some(16.0));
        let white = stage.radiance(find("forward").unwrap(), &settings);
        let covered: f64 = white.iter().map(|p| f64::from(p[0] * samples as f32)).sum();
        for id in ["dais", "dais-list"] {
            let technique = find(id).unwrap();
            if !technique.info().samples.contains(&samples) {
                continue;
            }
            let way = (technique, Params::default(), format!("{id}, {samples} samples"));
            let sharing = Settings { view: views::TRIANGLE_SHARING.to_owned(), ..settings.clone() };
            let counts = words(&mut prepared(&stage, &sharing, &way, None), technique, RECORD_SAMPLES);
            let sum: f64 = counts.iter().map(|c| f64::from(*c)).sum();
            let used = counts.iter().filter(|count| **count > 0).count();
            println!("{}: {sum} of {covered} samples, {used} records", way.2);
            assert_eq!(sum, covered, "{}", way.2);
            assert!(used > 20, "{}: {used} records of triangles of 16 pixels", way.2);
            let error = Settings { view: views::ATTRIBUTE_ERROR.to_owned(), ..settings.clone() };
            let refused = stage.try_prepare(technique, &error, &way.1).err().expect("no ID to compare by");
            let told = refused.to_string();
            assert!(told.contains("attribute-error") && told.contains("tessellate"), "{told}");
        }
    }
}

struct Compared {
    pixels: usize,
    position_max: f64,
    position_mean: f64,
    texture_mean: f64,
}

fn compared(errors: &[u32]) -> Compared {
    let errors: Vec<[f64; 2]> = errors
        .chunks_exact(2)
        .map(|e| [f32::from_bits(e[0]).into(), f32::from_bits(e[1]).into()])
        .filter(|e: &[f64; 2]| e[0] != -1.0)
        .collect();
    let mean = |i: usize| errors.iter().map(|e| e[i]).sum::<f64>() / errors.len() as f64;
    Compared {
        pixels: errors.len(),
        position_max: errors.iter().map(|e| e[0]).fold(0.0, f64::max),
        position_mean: mean(0),
        texture_mean: mean(1),
    }
}

/// Records give what the rasteriser interpolates, and the same record whatever way it was filled.
#[test]
fn attributes_are_those_of_the_rasteriser() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000&texture=64");
    for samples in counts(&gpu) {
        let settings =
            Settings { samples, view: views::ATTRIBUTE_ERROR.to_owned(), ..stage.settings((160, 90), 2) };
        let mut first = None;
        for way in ways(samples) {
            let errors = words(&mut prepared(&stage, &settings, &way, None), way.0, ATTRIBUTE_ERRORS);
            let Compared { pixels, position_max, position_mean, texture_mean } = compared(&errors);
            println!(
                "{}: {pixels} pixels, positions {position_max:.2e} and {position_mean:.2e}, textures {texture_mean:.2e}",
                way.2
            );
            assert!(pixels > 160 * 90 * 6 / 10, "{}: {pixels} pixels are compared", way.2);
            assert!(position_max < POSITION_MAX, "{}: positions {position_max}", way.2);
            assert!(position_mean < POSITION_MEAN, "{}: positions {position_mean}", way.2);
            assert!(texture_mean < TEXTURE_MEAN, "{}: textures {texture_mean}", way.2);
            // A pixel where equal depths are settled otherwise may refer to another triangle.
            let first = first.get_or_insert_with(|| errors.clone());
            let others = errors.chunks_exact(2).zip(first.chunks_exact(2)).filter(|(a, b)| a != b).count();
            assert!(others < 20, "{}: {others} pixels differ from those of another way", way.2);
        }
    }
}

/// A derivative of the wrong sign and an anchor off by a pixel are seen.
#[test]
fn wrong_records_are_seen() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000&texture=64");
    let settings = Settings { view: views::ATTRIBUTE_ERROR.to_owned(), ..stage.settings((160, 90), 2) };
    let way = ways(1).next().expect("dais");
    for replaced in [
        ("by * (inverse_det * pixel_ndc.y)", "by * (inverse_det * -pixel_ndc.y)"),
        ("vec2 ndc = (anchor + 0.5)", "vec2 ndc = (anchor + 1.5)"),
    ] {
        let path = source("surfaces/triangles/derivatives.comp.glsl");
        let name = "surfaces/triangles/derivatives.comp#ids";
        let mutant = compiled(name, &path, &["RECORD_IDS"], &[replaced]);
        let mut prepared = prepared(&stage, &settings, &way, Some(mutant));
        let found = compared(&words(&mut prepared, way.0, ATTRIBUTE_ERRORS));
        println!("{}: {:.2e}, {:.2e}", replaced.1, found.position_mean, found.texture_mean);
        assert!(found.position_mean > POSITION_MEAN && found.texture_mean > TEXTURE_MEAN, "{}", replaced.1);
    }
}
