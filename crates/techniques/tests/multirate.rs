//! Indirect light at a low rate: against full rate, run after run.

mod common;

use afterlight_techniques::{Indirect, Settings, find, graph::gpu, shader::Shader};
use common::{Stage, compiled_variant, found_by, image_of, params, psnr, radiance_of, subgroup_sizes};

fn counts(device: &gpu::Device) -> Vec<u32> {
    afterlight_testkit::sample_counts(device, &[1, 4, 8])
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
        way(&[("visibility", "compute"), ("share", "grid"), ("lights", "tiles25")], COMPUTE, HALF_RATE_BOUND),
        way(&[("fill", "cache"), ("share", "grid")], CACHE, HALF_RATE_BOUND),
        way(&[("visibility", "raster"), ("share", "quads")], RASTER, QUADS_BOUND),
        way(&[("visibility", "compute"), ("share", "quads")], COMPUTE, QUADS_BOUND),
        way(&[("fill", "cache"), ("share", "quads"), ("lights", "tiles25")], CACHE, QUADS_BOUND),
        way(&[("fill", "cache"), ("share", "grid"), ("reference-bits", "8")], CACHE, HALF_RATE_BOUND),
        way(&[("fill", "cache"), ("share", "quads"), ("reference-bits", "8")], CACHE, QUADS_BOUND),
        way(&[("visibility", "raster"), ("rate", "1/4")], RASTER, QUARTER_RATE_BOUND),
        way(&[("visibility", "raster"), ("rate", "1/8")], RASTER, EIGHTH_RATE_BOUND),
    ];
    if samples > 1 {
        let list = |sets, bound| Way { id: "dais-list", sets, full: ("dais-list", &[]), bound };
        ways.push(list(&[("rate", "1/2"), ("share", "grid")], HALF_RATE_BOUND));
        ways.push(list(&[("rate", "1/2"), ("share", "quads")], QUADS_BOUND));
    }
    ways
}

const QUADS_BOUND: f64 = 0.12;
const HALF_RATE_BOUND: f64 = 0.16;
const QUARTER_RATE_BOUND: f64 = 0.2;
const EIGHTH_RATE_BOUND: f64 = 0.26;

type Radiance = Vec<[f32; 4]>;

/// Runs a technique so often, and has every run give the same radiance.
fn radiance(stage: &Stage, settings: &Settings, id: &str, sets: &[(&str, &str)], runs: usize) -> Radiance {
    let technique = find(id).unwrap();
    let params = params(technique, sets);
    let settings = Settings { keep_hdr: true, ..settings.clone() };
    let mut prepared = stage.prepare_with(technique, &settings, &params);
    let mut images = (0..runs).map(|_| radiance_of(&mut prepared));
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
            let plain = Settings { samples, ..stage.settings((97, 55), 0) }
                .with_effects(|effects| effects.shadows.map_size_px = 256);
            let settings = plain.clone().with_effects(|effects| effects.indirect.method = Indirect::Rsm);
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

/// Radiance of `dais-multirate` by quads whose shading pass runs in subgroups of a size.
fn quads_in_subgroups(stage: &Stage, settings: &Settings, shaders: &[Shader], size: Option<u32>) -> Radiance {
    let technique = find("dais-multirate").unwrap();
    let params = params(technique, &[("visibility", "raster"), ("share", "quads")]);
    let pass = ("dais-multirate/shade", size);
    radiance_of(&mut stage.prepare_in_subgroups((technique, &params), settings, shaders, pass))
}

/// Quads share the same samples whatever the size of subgroups. The mutants: the number that a thread was taken for, on a driver that
/// varies the size up to 32; and quads that nobody finds, where every pixel gathers for itself.
#[test]
fn quads_do_not_depend_on_the_size_of_subgroups() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let settings = Settings { keep_hdr: true, ..stage.settings((97, 55), 0) }.with_effects(|effects| {
        effects.shadows.map_size_px = 256;
        effects.indirect.method = Indirect::Rsm;
    });
    let expected = quads_in_subgroups(&stage, &settings, &[], None);
    let sizes = subgroup_sizes(&gpu);
    for size in &sizes {
        let found = quads_in_subgroups(&stage, &settings, &[], Some(*size));
        assert!(found == expected, "subgroups of {size}: another image");
    }
    let mutant = |from: &str, to: &str| {
        compiled_variant("dais/shade.comp#one-quads", "surfaces/low_rate/low_rate.glsl", &[(from, to)])
    };
    let smallest = sizes.first().copied();
    if smallest.unwrap_or(gpu.features().subgroup_size) < 32 {
        let stride = mutant(
            "uint quad = gl_LocalInvocationIndex / 4u",
            "uint quad = (gl_SubgroupID * 32u + gl_SubgroupInvocationID) / 4u",
        );
        let found = quads_in_subgroups(&stage, &settings, &[stride], smallest);
        assert!(found != expected, "a wrong stride of subgroups goes unseen");
    }
    let alone = mutant("bool in_order =", "bool in_order = false &&");
    let found = quads_in_subgroups(&stage, &settings, &[alone], None);
    assert!(found != expected, "quads that are never found go unseen");
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

/// The shading pass alone shares indirect light; the pass of the light volumes, of the same surfaces, has no grid.
#[test]
fn a_shared_grid_goes_with_light_volumes() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let settings =
        stage.settings((64, 36), 3).with_effects(|effects| effects.indirect.method = Indirect::Rsm);
    let technique = find("dais-multirate").unwrap();
    let image = |lights: &str| {
        let params = params(technique, &[("share", "grid"), ("lights", lights), ("visibility", "raster")]);
        image_of(&mut stage.prepare_with(technique, &settings, &params))
    };
    let db = psnr(&image("all"), &image("volumes"));
    assert!(db >= 50.0, "{db:.2} dB between light volumes and all lights");
}

#[test]
fn quads_have_one_rate() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let settings =
        stage.settings((64, 36), 3).with_effects(|effects| effects.indirect.method = Indirect::Rsm);
    let technique = find("dais-multirate").unwrap();
    let params = params(technique, &[("share", "quads"), ("rate", "1/4")]);
    let error =
        stage.try_prepare(technique, &settings, &params).err().map(|e| e.to_string()).expect("refused");
    assert!(error.contains("rate=1/4") && error.contains("rate=1/2"), "{error}");
}

/// CIE XYZ of linear Rec. 709.
fn xyz(rgb: [f64; 3]) -> [f64; 3] {
    const ROWS: [[f64; 3]; 3] = [
        [0.412_390_8, 0.357_584_3, 0.180_480_8],
        [0.212_639_0, 0.715_168_7, 0.072_192_3],
        [0.019_330_8, 0.119_194_8, 0.950_532_2],
    ];
    ROWS.map(|row| (0..3).map(|c| row[c] * rgb[c]).sum())
}

/// u' and v' (CIE 1976).
fn chroma([x, y, z]: [f64; 3]) -> [f64; 2] {
    [4.0 * x, 9.0 * y].map(|n| n / (x + 15.0 * y + 3.0 * z))
}

/// Greatest errors of 32,768 colours after LogLuv, in halves of its steps: luminance, chroma.
fn logluv_errors(stage: &Stage, decode: &[(&str, &str)]) -> [f64; 2] {
    let floats = found_by(stage, "logluv.comp", ("logluv.glsl", decode), (8 << 15, 512));
    let mut errors = [0.0f64; 2];
    for pair in floats.chunks_exact(8) {
        let [before, after] = [&pair[..3], &pair[4..7]].map(|c| xyz([c[0], c[1], c[2]]));
        let octaves = (after[1] / before[1]).log2().abs();
        let [a, b] = [before, after].map(chroma);
        let away = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        assert!(pair[7] == 0.0, "black is {}", pair[7]);
        errors = [errors[0].max(octaves * 512.0), errors[1].max(away * 820.0)];
    }
    errors
}

/// Results of the grid keep luminance to half of 1/256 of an octave and chroma to half of 1/410, from 2^-32 to 2^31.
#[test]
fn logluv_is_off_by_half_a_step() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let [luminance, chroma] = logluv_errors(&stage, &[]);
    println!("{luminance:.3}, {chroma:.3} half steps");
    // Logarithms of floats beside 2^5 octaves are off by some 2^-18.
    assert!(luminance < 1.05 && chroma < 1.05, "{luminance}, {chroma} half steps");
    let cut = |from: &str, to: &str| logluv_errors(&stage, &[(from, to)]);
    assert!(cut("(float(bits >> 16) + 0.5)", "float(bits >> 16)")[0] > 1.5, "luminance cut down goes unseen");
    assert!(cut("bits & 0xffu) + 0.5", "bits & 0xffu)")[1] > 1.5, "chroma cut down goes unseen");
}
