//! Indirect light at a low rate: against full rate, run after run.

mod common;

use afterlight_techniques::{Indirect, Params, Settings, find, graph::gpu};
use common::Stage;

fn counts(device: &gpu::Device) -> Vec<u32> {
    [1, 4, 8].into_iter().filter(|n| *n == 1 || device.features().supports_samples(*n, false)).collect()
}

/// A way to a low rate: a technique, its parameters, and those of the technique at full rate that it is held against.
struct Way {
    id: &'static str,
    sets: &'static [(&'static str, &'static str)],
    full: Full,
    /// Most that indirect light may differ, of all indirect light of the image.
    bound: f64,
}

type Full = (&'static str, &'static [(&'static str, &'static str)]);

const RASTER: &[(&str, &str)] = &[("visibility", "raster")];
const COMPUTE: &[(&str, &str)] = &[("visibility", "compute")];
const CACHE: &[(&str, &str)] = &[("fill", "cache")];

fn ways(samples: u32) -> Vec<Way> {
    let way = |sets, full, bound| Way { id: "dais-multirate", sets, full: ("dais", full), bound };
    let mut ways = vec![
        way(&[("visibility", "raster"), ("share", "grid")], RASTER, HALF_RATE_BOUND),
        way(&[("visibility", "compute"), ("share", "grid"), ("lights", "tiled")], COMPUTE, HALF_RATE_BOUND),
        way(&[("fill", "cache"), ("share", "grid")], CACHE, HALF_RATE_BOUND),
        way(&[("visibility", "raster"), ("share", "quads")], RASTER, HALF_RATE_BOUND),
        way(&[("visibility", "compute"), ("share", "quads")], COMPUTE, HALF_RATE_BOUND),
        way(&[("fill", "cache"), ("share", "quads"), ("lights", "tiled")], CACHE, HALF_RATE_BOUND),
        way(&[("fill", "cache"), ("share", "grid"), ("reference-bits", "8")], CACHE, HALF_RATE_BOUND),
        way(&[("fill", "cache"), ("share", "quads"), ("reference-bits", "8")], CACHE, HALF_RATE_BOUND),
        way(&[("visibility", "raster"), ("rate", "1/4")], RASTER, QUARTER_RATE_BOUND),
        way(&[("visibility", "raster"), ("rate", "1/8")], RASTER, EIGHTH_RATE_BOUND),
    ];
    if samples > 1 {
        let list = |sets| Way { id: "dais-list", sets, full: ("dais-list", &[]), bound: HALF_RATE_BOUND };
        ways.push(list(&[("rate", "1/2"), ("share", "grid")]));
        ways.push(list(&[("rate", "1/2"), ("share", "quads")]));
    }
    ways
}

const HALF_RATE_BOUND: f64 = 0.16;
const QUARTER_RATE_BOUND: f64 = 0.2;
const EIGHTH_RATE_BOUND: f64 = 0.26;

type Radiance = Vec<[f32; 4]>;

/// Runs a technique so often, and has every run give the same radiance.
fn radiance(stage: &Stage, settings: &Settings, id: &str, sets: &[(&str, &str)], runs: usize) -> Radiance {
    let technique = find(id).unwrap();
    let mut params = Params::default();
    for (key, value) in sets {
        params.set(technique.info(), key, value).unwrap_or_else(|e| panic!("{e}"));
    }
    let settings = Settings { keep_hdr: true, ..settings.clone() };
    let mut prepared = stage.prepare_with(technique, &settings, &params);
    let mut images = (0..runs).map(|_| {
        prepared.run().unwrap_or_else(|e| panic!("{e}"));
        let rgba = prepared.hdr_rgba().unwrap_or_else(|e| panic!("{e}")).expect("kept");
        rgba.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect::<Radiance>()
    });
    let first = images.next().expect("a run");
    for (run, image) in images.enumerate() {
        assert!(first == image, "{id} {sets:?}: run {} gives another image", run + 1);
    }
    first
}

/// Sum of absolute differences of two images by what indirect light adds to one of them.
fn relative_error(image: &Radiance, full: &Radiance, without: &Radiance) -> f64 {
    let distance = |a: &Radiance, b: &Radiance| -> f64 {
        let of_pixel =
            |(a, b): (&[f32; 4], &[f32; 4])| -> f64 { (0..3).map(|c| f64::from((a[c] - b[c]).abs())).sum() };
        a.iter().zip(b).map(of_pixel).sum()
    };
    distance(image, full) / distance(full, without)
}

/// The image whose indirect light stands some pixels to the left: a mutant.
fn shifted(full: &Radiance, without: &Radiance, width: usize, by: usize) -> Radiance {
    let at = |i: usize| if i % width + by < width { i + by } else { i };
    let moved = |i: usize| std::array::from_fn(|c| without[i][c] + full[at(i)][c] - without[at(i)][c]);
    (0..full.len()).map(moved).collect()
}

#[test]
fn low_rates_against_full_rate() {
    let gpu = afterlight_testkit::gpu();
    for source in ["builtin:colonnade?triangles=17000&texture=64", "builtin:intersect"] {
        let stage = Stage::new(&gpu, source);
        for samples in counts(&gpu) {
            let plain = Settings { samples, shadow_map_size_px: 256, ..stage.settings((97, 55), 0) };
            let settings = Settings { indirect: Indirect::Rsm, ..plain.clone() };
            let reference =
                |(id, sets)| [&settings, &plain].map(|settings| radiance(&stage, settings, id, sets, 1));
            let mut known: Vec<(Full, [Radiance; 2])> = Vec::new();
            for way in ways(samples) {
                if !known.iter().any(|(full, _)| *full == way.full) {
                    known.push((way.full, reference(way.full)));
                }
                let [full, without] = &known.iter().find(|(full, _)| *full == way.full).expect("pushed").1;
                let low = radiance(&stage, &settings, way.id, way.sets, 2);
                let error = relative_error(&low, full, without);
                let mutant = relative_error(&shifted(full, without, 97, 2), full, without);
                let what = format!("{source}, {samples} samples, {} {:?}", way.id, way.sets);
                println!("{what}: {error:.4}, mutant {mutant:.4}");
                assert!(error <= way.bound, "{what}: {error:.4} of indirect light is elsewhere");
                assert!(mutant > way.bound, "{what}: a mutant within the bound: {mutant:.4}");
            }
        }
    }
}

/// Without indirect light there is nothing to share: the image of `dais`.
#[test]
fn without_indirect_light_it_is_dais() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let settings = Settings { samples: 4, ..stage.settings((64, 36), 3) };
    let [low, full] = ["dais-multirate", "dais"].map(|id| radiance(&stage, &settings, id, RASTER, 1));
    assert!(low == full);
}

#[test]
fn quads_have_one_rate() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let settings = Settings { indirect: Indirect::Rsm, ..stage.settings((64, 36), 3) };
    let technique = find("dais-multirate").unwrap();
    let mut params = Params::default();
    for (key, value) in [("share", "quads"), ("rate", "1/4")] {
        params.set(technique.info(), key, value).unwrap_or_else(|e| panic!("{e}"));
    }
    let error =
        stage.try_prepare(technique, &settings, &params).err().map(|e| e.to_string()).expect("refused");
    assert!(error.contains("rate=1/4") && error.contains("rate=1/2"), "{error}");
}
