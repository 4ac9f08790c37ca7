//! Pairs of lights and surfaces, tested and lit: against a ray caster, between techniques, at the bounds of their format.

mod common;

use afterlight_oracle::raster::{RayScene, pixel_ray};
use afterlight_techniques::{
    Exactness, Frame, Info, LightPairs, Params, SHADERS, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    exactness_of, find,
    graph::{Graph, ImageHandle},
    registry,
    scene::{Light, LightKind},
    shader::Shader,
    views,
};
use common::{Stage, compiled_variant, image_of, radiance_of, wider};
use glam::{DVec3, Vec3};

/// By how much the lit pairs of two exact techniques differ at one sample: surfaces stand where depth or attributes say, so that
/// those at the very end of a light's range may be on either side of it.
const LIT_DIFFERENCE: f64 = 1e-3;

/// The same at several samples, where surfaces stand at the pixel's centre or at the samples.
const LIT_DIFFERENCE_MULTISAMPLED: f64 = 0.02;

const SIZE: (u32, u32) = (160, 90);

fn counting(settings: &Settings, view: &str) -> Settings {
    Settings { view: view.to_owned(), keep_hdr: true, ..settings.clone() }
}

/// Tested and lit pairs of every pixel, and their sums; `shaders` stand in place of the technique's own.
fn counted(
    stage: &Stage,
    technique: &str,
    settings: &Settings,
    shaders: Option<Shader>,
) -> (Vec<[f64; 2]>, LightPairs) {
    let settings = counting(settings, views::LIGHT_COUNT);
    let technique = find(technique).unwrap();
    let mut prepared = stage.prepare_shaders(technique, &settings, &Params::default(), shaders);
    let pixels = radiance_of(&mut prepared).iter().map(|p| [p[0], p[1]].map(f64::from)).collect();
    let sums = prepared.light_pairs().unwrap_or_else(|e| panic!("{e}")).expect("a view of pairs");
    (pixels, sums)
}

fn sum(pixels: &[[f64; 2]], which: usize) -> f64 {
    pixels.iter().map(|pixel| pixel[which]).sum()
}

/// A pixel as a ray caster sees it.
#[derive(Clone, Copy)]
struct Seen {
    /// Lights whose range holds the surface for sure, and those that rounding may add.
    lit: [usize; 2],
    /// Whether rounding may show another surface.
    near_edge: bool,
}

/// What each pixel shows by its ray; none without a surface.
fn cast(stage: &Stage, settings: &Settings) -> Vec<Option<Seen>> {
    // Of (distance / range)^2: vertices are snapped to 1/256 of a pixel before they are rasterised.
    const ROUNDING: f64 = 4e-3;
    let rays = RayScene::new(&stage.scene);
    let of_pixel = |i: u32| {
        let ray = pixel_ray(&settings.camera, [i % SIZE.0, i / SIZE.0], [SIZE.0, SIZE.1]);
        let hit = rays.first_hit(&ray)?;
        let position_ws = ray.origin_ws + ray.direction_ws * hit.distance_m;
        let within = |light: &Light, most: f64| {
            let range_m = f64::from(light.range_m);
            let place: DVec3 = light.position_ws.as_dvec3();
            place.distance_squared(position_ws) < most * range_m * range_m
        };
        let lit = [1.0 - ROUNDING, 1.0 + ROUNDING]
            .map(|most| settings.lights.iter().filter(|light| within(light, most)).count());
        Some(Seen { lit, near_edge: hit.edge_distance < 0.02 })
    };
    (0..SIZE.0 * SIZE.1).map(of_pixel).collect()
}

/// Pixels away from edges whose lit pairs are not what their rays see, and how many were compared.
fn off(found: &[[f64; 2]], seen: &[Option<Seen>]) -> (usize, usize) {
    let inside = found.iter().zip(seen).filter_map(|(f, seen)| Some((f, seen.filter(|s| !s.near_edge)?)));
    inside.fold((0, 0), |(off, all), (pixel, seen)| {
        let [least, most] = seen.lit.map(|count| count as f64);
        (off + usize::from(pixel[1] < least || pixel[1] > most), all + 1)
    })
}

/// `forward/forward.frag` with a part of a header of all shaders replaced.
fn mutant(header: &str, from: &str, to: &str) -> Shader {
    compiled_variant("surfaces/depth_first/forward.frag", header, &[(from, to)])
}

#[test]
fn forward_tests_all_and_lights_what_a_ray_caster_sees() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:spheres?segments=24");
    let settings = stage.settings(SIZE, 40);
    let seen = cast(&stage, &settings);
    let (found, sums) = counted(&stage, "forward", &settings, None);

    let covered = found.iter().filter(|pixel| pixel[0] > 0.0).count();
    assert!(found.iter().all(|pixel| pixel[0] == 0.0 || pixel[0] == 40.0), "not all or none");
    assert_eq!(sums.tested, 40.0 * covered as f64);
    let at_edges = seen.iter().flatten().filter(|s| s.near_edge).count();
    assert!(covered.abs_diff(seen.iter().flatten().count()) <= at_edges, "{covered} pixels covered");

    let (wrong, compared) = off(&found, &seen);
    println!("{wrong} of {compared} pixels off, {covered} covered; {sums:?}");
    assert_eq!(wrong, 0);
    assert!(compared * 2 > covered, "{compared} of {covered} pixels compared");
    assert_eq!((sums.lit, sums.rounded_pixels), (sum(&found, 1), 0));
    assert!(sums.lit > 0.5 * covered as f64 && sums.lit < 0.9 * sums.tested, "{sums:?} shows little");

    for (header, from, to) in [
        ("shading.glsl", "t >= 1.0", "t >= 1.04"),
        ("light_pairs.glsl", "lit ? LIGHT_PAIR : 0.0", "LIGHT_PAIR"),
        ("light_pairs.glsl", "1.0 / 1024.0", "1.0 / 1000.0"),
    ] {
        let (found, _) = counted(&stage, "forward", &settings, Some(mutant(header, from, to)));
        assert!(off(&found, &seen).0 > 10, "{to} for {from}: a mutant that no pixel shows");
    }
}

#[test]
fn tiles_test_what_is_lit_and_not_all() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:spheres?segments=24");
    let settings = stage.settings(SIZE, 40);
    let (all, _) = counted(&stage, "forward", &settings, None);
    let (tiled, sums) = counted(&stage, "tiled", &settings, None);
    for (tiled, all) in tiled.iter().zip(&all) {
        assert!(all[1] <= tiled[0] + 1.0 && tiled[1] <= tiled[0] && tiled[0] <= all[0], "{tiled:?} {all:?}");
    }
    assert!(sums.tested < 0.8 * sum(&all, 0), "{sums:?}");
}

/// Techniques that render so many samples here and list the views, with what they count.
fn all_counted(stage: &Stage, settings: &Settings) -> Vec<(&'static dyn Technique, LightPairs)> {
    let counts = |technique: &&dyn Technique| {
        technique.info().samples.contains(&settings.samples) && technique.counts_light_pairs()
    };
    let run = |technique: &'static dyn Technique| {
        let settings = counting(settings, views::LIGHT_COUNT);
        let mut prepared = match stage.try_prepare(technique, &settings, &Params::default()) {
            Err(TechniqueError::Unavailable { .. }) => return None,
            prepared => prepared.unwrap_or_else(|e| panic!("{}: {e}", technique.info().id)),
        };
        prepared.run().unwrap_or_else(|e| panic!("{e}"));
        let pairs = prepared.light_pairs().unwrap_or_else(|e| panic!("{e}")).expect("a view of pairs");
        println!("{}: {pairs:?}", technique.info().id);
        Some((technique, pairs))
    };
    registry().iter().copied().filter(counts).filter_map(run).collect()
}

/// Asserts that exact techniques light the same pairs, within a share of them, and test no fewer.
fn all_light_the_same(stage: &Stage, settings: &Settings, within: f64) {
    let found = all_counted(stage, settings);
    let (_, forward) = found.iter().find(|(t, _)| t.info().id == "forward").expect("forward runs");
    for (technique, pairs) in &found {
        let id = technique.info().id;
        assert!(pairs.tested >= pairs.lit && pairs.lit > 0.0, "{id}: {pairs:?}");
        let exactness = exactness_of(*technique, &Params::default(), settings.samples);
        if matches!(exactness, Exactness::Exact { .. }) {
            let difference = (pairs.lit - forward.lit).abs() / forward.lit;
            assert!(difference <= within, "{id}: {pairs:?} against {forward:?}, {difference:.5} off");
        }
    }
    // What the bound must catch.
    let mutant = Settings { lights: wider(&settings.lights, 1.02), ..settings.clone() };
    let (_, wider) = counted(stage, "forward", &mutant, None);
    assert!((wider.lit - forward.lit) / forward.lit > within, "a mutant within the bound: {wider:?}");
}

#[test]
fn every_exact_technique_lights_the_same_pairs() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    all_light_the_same(&stage, &stage.settings(SIZE, 100), LIT_DIFFERENCE);
}

#[test]
fn samples_are_averaged() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:spheres?segments=24");
    let settings = Settings { samples: 4, ..stage.settings(SIZE, 40) };
    all_light_the_same(&stage, &settings, LIT_DIFFERENCE_MULTISAMPLED);
}

/// `count` lights at one place whose range holds the whole scene, or none of it.
fn lights_of_range(stage: &Stage, count: usize, range_m: f32) -> Vec<Light> {
    let bounds = stage.scene.bounds_ws();
    let light = Light {
        kind: LightKind::Point,
        position_ws: bounds.max + bounds.size(),
        direction_ws: -Vec3::Y,
        intensity: Vec3::ONE,
        range_m,
    };
    vec![light; count]
}

/// Loops count as many lights as there may be, rounded by 2^-10; blending ends at 2,048, and says so. No more lights than this, since
/// lavapipe ends the loops of a shader after 65,535 passes.
#[test]
fn counts_at_the_bounds_of_their_format() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:sphere?segments=16");
    let mut settings = stage.settings((8, 8), 1);
    settings.lights = lights_of_range(&stage, 65_000, 1e3);
    let (found, sums) = counted(&stage, "forward", &settings, None);
    let covered = found.iter().filter(|pixel| pixel[0] > 0.0).count();
    assert!(covered > 8, "{covered} pixels");
    let expected = 65e3 * covered as f64;
    assert!((sums.tested - expected).abs() <= expected / 1024.0, "{sums:?} of {expected}");
    assert_eq!((sums.rounded_pixels, sums.lit), (covered as u64, sums.tested));

    settings.lights = lights_of_range(&stage, 3000, 1e3);
    let (found, sums) = counted(&stage, "deferred", &settings, None);
    assert!(found.iter().all(|pixel| pixel[0] == 0.0 || pixel[0] == 2048.0), "{found:?}");
    assert!(sums.rounded_pixels > 8, "{sums:?}");
}

/// Eight lights are green; those of them that are not lit are what the other view shows.
#[test]
fn colours_are_those_of_the_legend() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:sphere?segments=16");
    let forward = find("forward").unwrap();
    let mut settings = stage.settings((32, 32), 1);
    let mut middle = |range_m: f32, view: &str| {
        settings.lights = lights_of_range(&stage, 8, range_m);
        let image = image_of(&mut stage.prepare(forward, &counting(&settings, view)));
        let at = (16 * 32 + 16) * 4;
        [image.pixels[at], image.pixels[at + 1], image.pixels[at + 2]]
    };
    let is_green = |color: [u8; 3]| {
        // 0, 0.6 and 0.1 in sRGB.
        color.iter().zip([0, 203, 89]).all(|(found, expected)| found.abs_diff(expected) <= 1)
    };
    for (range_m, view, green) in [
        (1e3, views::LIGHT_COUNT, true),
        (1e3, views::LIGHT_ERROR, false),
        (1e-3, views::LIGHT_COUNT, true),
        (1e-3, views::LIGHT_ERROR, true),
    ] {
        let color = middle(range_m, view);
        assert_eq!(is_green(color), green, "{view} at range {range_m}: {color:?}");
        assert!(green || color == [0; 3], "{view} at range {range_m}: {color:?}");
    }
}

#[test]
fn unlit_surfaces_and_the_background_have_no_pairs() {
    let gpu = afterlight_testkit::gpu();
    let mut scene = Stage::new(&gpu, "builtin:spheres?segments=12").scene;
    for material in &mut scene.materials {
        material.unlit = true;
    }
    scene.environment.background_radiance = Vec3::ONE;
    let stage = Stage::of(&gpu, scene);
    for technique in ["forward", "tiled", "light-prepass", "visibility"] {
        let (_, sums) = counted(&stage, technique, &stage.settings((48, 27), 20), None);
        assert_eq!(sums, LightPairs::default(), "{technique}");
    }
}

/// A technique whose radiance is no sum.
struct NoSum;

impl Technique for NoSum {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }

    fn info(&self) -> &Info {
        find("forward").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        find("forward").unwrap().record(graph, frame)
    }
    fn counts_light_pairs(&self) -> bool {
        false
    }
}

#[test]
fn a_technique_that_cannot_count_does_not_list_the_views() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:sphere?segments=8");
    let settings = counting(&stage.settings((8, 8), 1), views::LIGHT_ERROR);
    let error = stage.try_prepare(&NoSum, &settings, &Params::default()).err().expect("is refused");
    assert!(!error.to_string().contains(views::LIGHT_COUNT), "{error}");
    assert!(afterlight_stages::views::of(find("forward").unwrap()).contains(&views::LIGHT_COUNT));
    // Without a view of pairs there are none.
    let mut prepared = stage.prepare(find("forward").unwrap(), &stage.settings((8, 8), 1));
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(prepared.light_pairs().unwrap_or_else(|e| panic!("{e}")), None);
}
