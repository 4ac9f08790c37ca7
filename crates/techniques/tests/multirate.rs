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
    full: (&'static str, &'static [(&'static str, &'static str)]),
    /// Most that indirect light may differ, of all indirect light of the image.
    bound: f64,
}

const RASTER: &[(&str, &str)] = &[("visibility", "raster")];
const COMPUTE: &[(&str, &str)] = &[("visibility", "compute")];
const CACHE: &[(&str, &str)] = &[("fill", "cache")];

fn ways(samples: u32) -> Vec<Way> {
    let way = |sets, full, bound| Way { id: "dais-multirate", sets, full: ("dais", full), bound };
    let mut ways = vec![
        way(RASTER, RASTER, HALF_RATE_BOUND),
        way(&[("visibility", "compute"), ("lights", "tiled")], COMPUTE, HALF_RATE_BOUND),
        way(CACHE, CACHE, HALF_RATE_BOUND),
        way(&[("visibility", "raster"), ("share", "quads")], RASTER, HALF_RATE_BOUND),
        way(&[("visibility", "compute"), ("share", "quads")], COMPUTE, HALF_RATE_BOUND),
        way(&[("fill", "cache"), ("share", "quads"), ("lights", "tiled")], CACHE, HALF_RATE_BOUND),
        way(&[("visibility", "raster"), ("rate", "1/4")], RASTER, QUARTER_RATE_BOUND),
        way(&[("visibility", "raster"), ("rate", "1/8")], RASTER, EIGHTH_RATE_BOUND),
    ];
    if samples > 1 {
        let list = |sets| Way { id: "dais-list", sets, full: ("dais-list", &[]), bound: HALF_RATE_BOUND };
        ways.push(list(&[("rate", "1/2")]));
        ways.push(list(&[("rate", "1/2"), ("share", "quads")]));
    }
    ways
}

const HALF_RATE_BOUND: f64 = 0.05;
const QUARTER_RATE_BOUND: f64 = 0.08;
const EIGHTH_RATE_BOUND: f64 = 0.12;

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
        let of_pixel = |(a, b): (&[f32; 4], &[f32; 4])| -> f64 {
            (0..3).map(|c| f64::from((a[c] - b[c]).abs())).sum()
        };
        a.iter().zip(b).map(of_pixel).sum()
    };
    distance(image, full) / distance(full, without)
}

/// The image whose indirect light stands some pixels to the left: a mutant.
fn shifted(full: &Radiance, without: &Radiance, width: usize, by: usize) -> Radiance {
    let at = |i: usize| if i % width + by < width { i + by } else { i };
    let moved = |i: usize| {
        std::array::from_fn(|c| without[i][c] + full[at(i)][c] - without[at(i)][c])
    };
    (0..full.len()).map(moved).collect()
}

#[test]
fn low_rates_against_full_rate() {
    let gpu = afterlight_testkit::gpu();
    for source in ["builtin:colonnade?triangles=30000", "builtin:spheres?segments=24", "builtin:intersect"] {
        let stage = Stage::new(&gpu, source);
        for samples in counts(&gpu) {
            let plain = Settings { samples, shadow_map_size_px: 256, ..stage.settings((160, 90), 0) };
            let settings = Settings { indirect: Indirect::Rsm, ..plain.clone() };
            for way in ways(samples) {
                let (id, sets) = way.full;
                let full = radiance(&stage, &settings, id, sets, 1);
                let without = radiance(&stage, &plain, id, sets, 1);
                let low = radiance(&stage, &settings, way.id, way.sets, 3);
                let error = relative_error(&low, &full, &without);
                let mutant = relative_error(&shifted(&full, &without, 160, 2), &full, &without);
                println!(
                    "{source}, {samples} samples, {} {:?}: {error:.4}, mutant {mutant:.4}",
                    way.id, way.sets
                );
                //assert!(error <= way.bound, "{source}, {samples} samples, {} {:?}: {error:.4}", way.id, way.sets);
                //assert!(mutant > way.bound, "a mutant within the bound: {mutant:.4}");
            }
        }
    }
}
