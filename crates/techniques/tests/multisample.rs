//! Techniques of several samples a pixel against `forward` at as many (ladder step d).

mod common;

use afterlight_stages::lights::step::asked;
use afterlight_techniques::{
    Params, Settings, Shadows, Technique, Transparency, find,
    graph::gpu,
    registry,
    scene::{AlphaMode, Camera, LoadOptions, Scene, load_source},
    shader::Shader,
};
use common::{
    Stage, compiled_variant, covered,
    flat::{scene_of, unlit},
    image_of, least_db, params, psnr, radiance_of,
    ways::{every_way, ways_of_surfaces},
};
use glam::Vec3;

/// Least PSNR to `forward` at as many samples, dB (contract).
const MIN_PSNR_DB: f64 = 40.0;

/// Sample counts beyond one that the device has, of those that techniques are tested at.
fn counts(device: &gpu::Device) -> Vec<u32> {
    afterlight_testkit::sample_counts(device, &[4, 8])
}

/// Ways in which a technique works, by its parameters, besides its lights.
fn ways(id: &str) -> &'static [&'static [(&'static str, &'static str)]] {
    match id {
        "deferred-ssaa" => &[&[], &[("position", "sample")]],
        "deferred-msaa" => &[&[], &[("position", "sample")], &[("edges", "centroid")]],
        "light-prepass" => &[&[], &[("edge-light", "pixel")]],
        // As `dais`, whose image it gives without indirect light.
        "dais-multirate" => &[&[]],
        _ => ways_of_surfaces(id),
    }
}

/// Every technique that renders several samples, with every value of the compared parameters.
fn variants() -> Vec<(&'static dyn Technique, Params, String)> {
    let mut all = Vec::new();
    for technique in registry().iter().copied().filter(|t| t.info().samples.contains(&4)) {
        let info = technique.info();
        let lights: &[&[(&str, &str)]] = match asked(&technique.params()).is_some() {
            true => &[&[("lights", "all")], &[("lights", "clusters")]],
            false => &[&[]],
        };
        let sets = lights.iter().flat_map(|one| ways(info.id).iter().map(|way| [*one, *way].concat()));
        for set in sets {
            let words: Vec<String> = set.iter().map(|(key, value)| format!("{key}={value}")).collect();
            all.push((technique, params(technique, &set), format!("{} {}", info.id, words.join(" "))));
        }
    }
    all
}

fn all_agree(stage: &Stage, settings: &Settings, what: &str, runs: usize) {
    for samples in counts(&stage.device) {
        let settings = Settings { samples, ..settings.clone() };
        let reference = stage.image(find("forward").unwrap(), &settings);
        for (technique, params, name) in variants() {
            let mut prepared = stage.prepare_with(technique, &settings, &params);
            for run in 0..runs {
                let db = psnr(&reference, &image_of(&mut prepared));
                println!("{what}, {samples} samples: {name} run {run}: {db:.2} dB");
                let least_db = least_db(technique, &params, samples);
                assert!(
                    db >= least_db,
                    "{what}, {samples} samples: {name} run {run}: {db:.2} dB to forward, {least_db} promised"
                );
            }
        }
    }
}

#[test]
fn on_the_colonnade() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    all_agree(&stage, &stage.settings((160, 90), 100), "colonnade", 2);
}

#[test]
fn on_intersecting_triangles() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    all_agree(&stage, &stage.settings((161, 91), 20), "intersect", 2);
}

/// Through one bucket for all triangles, whose look-ups and replacements meet all the time, frame after frame.
#[test]
fn through_one_bucket() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let technique = find("dais").unwrap();
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.settings((161, 91), 0) };
        let reference = stage.image(find("forward").unwrap(), &settings);
        let sets = [("fill", "cache"), ("cache-buckets", "1")];
        let mut prepared = stage.prepare_with(technique, &settings, &params(technique, &sets));
        for frame in 0..100 {
            let db = psnr(&reference, &image_of(&mut prepared));
            let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
            assert!(
                db >= MIN_PSNR_DB && counters.iter().all(|counter| counter.dropped == 0),
                "{samples} samples, frame {frame}: {db:.2} dB to forward, {counters:?}"
            );
        }
    }
}

#[test]
fn on_sponza() {
    let gpu = afterlight_testkit::gpu();
    let Some(scenes) = afterlight_testkit::shared_scenes() else { return };
    let stage = Stage::new(&gpu, &scenes.join("sponza/sponza.gltf").to_string_lossy());
    let camera =
        Camera::look_at("view", Vec3::new(-9.0, 2.5, 0.0), Vec3::new(5.0, 3.0, 0.0), 60f32.to_radians(), 0.1);
    all_agree(&stage, &stage.from(camera, (320, 180), 100), "sponza", 1);
}

/// Eyes so near a floor that between a sample that it covers and the pixel's centre the floor ends, at the horizon: what is interpolated at
/// the centre lies behind the viewer (28 dB where distances have no sign or facing is told by the sum of edge functions), and mip levels
/// by analytic derivatives are others than those of a quad of fragments (37.9 dB on the colonnade's floor).
#[test]
fn with_an_eye_on_the_ground() {
    let gpu = afterlight_testkit::gpu();
    let views = [
        (
            "builtin:intersect",
            Vec3::new(-0.800_865_8, 0.000_618_366_8, -2.290_116_5),
            Vec3::new(-4.533_236, -0.242_336_78, 2.401_406),
            84.190_74_f32,
            0.000_3,
        ),
        (
            "builtin:intersect",
            Vec3::new(-0.053_332_124, 0.339_189_35, 0.452_470_72),
            Vec3::new(1.442_376_5, 5.704_005_2, 2.684_423_4),
            126.991_07,
            0.000_746_227_9,
        ),
        (
            "builtin:colonnade",
            Vec3::new(-13.563_133, 0.006_549_231, -2.187_165_5),
            Vec3::new(-41.624_992, -6.517_202_4, 7.132_227),
            55.558_6,
            0.237_743_88,
        ),
    ];
    for (source, eye, target, fov_deg, near_m) in views {
        let stage = Stage::new(&gpu, source);
        let camera = Camera::look_at("on the ground", eye, target, fov_deg.to_radians(), near_m);
        all_agree(&stage, &stage.from(camera, (101, 67), 12), &format!("on the ground of {source}"), 1);
    }
}

/// Views whose light changes within pixels: few of them, scenes small in them, sharp shadows. `deferred-ssaa` and
/// `deferred-msaa` were at 34.7 and 37.9 dB when they lit surfaces at their samples.
fn views_of_few_pixels(gpu: &gpu::Device) -> Vec<(Stage, Settings, &'static str)> {
    let mut views = Vec::new();
    let stage = Stage::new(gpu, "builtin:spheres");
    let settings = stage.settings((96, 54), 10);
    views.push((stage, settings, "spheres of 96x54"));
    let stage = Stage::new(gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 5).with_effects(|effects| {
        effects.shadows.method = Shadows::Map;
        effects.shadows.map_size_px = 4096;
    });
    views.push((stage, settings, "sharp shadows"));
    views
}

#[test]
fn where_light_changes_within_pixels() {
    let gpu = afterlight_testkit::gpu();
    for (stage, settings, what) in views_of_few_pixels(&gpu) {
        all_agree(&stage, &settings, what, 1);
    }
}

/// One sample is not several: a comparison that cannot tell would prove nothing.
#[test]
fn one_sample_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    let forward = find("forward").unwrap();
    for samples in counts(&gpu) {
        let several = stage.image(forward, &Settings { samples, ..settings.clone() });
        let db = psnr(&stage.image(forward, &settings), &several);
        assert!(db < MIN_PSNR_DB - 5.0, "a mutant within the bound: {db:.2} dB");
    }
}

/// `gbuffer-list` with parameters, and the pixels of an image that are not black.
fn list_image(stage: &Stage, settings: &Settings, sets: &[(&str, &str)]) -> afterlight_image::Rgba8Image {
    let list = find("gbuffer-list").unwrap();
    image_of(&mut stage.prepare_with(list, settings, &params(list, sets)))
}

fn pixels_not_black(image: &afterlight_image::Rgba8Image) -> usize {
    image.pixels.chunks_exact(4).filter(|p| p[..3] != [0, 0, 0]).count()
}

/// The weights of every pixel sum to the samples, on intersecting triangles as well.
#[test]
fn weights_sum_to_the_samples() {
    let gpu = afterlight_testkit::gpu();
    for source in [
        "builtin:intersect",
        "builtin:colonnade?triangles=30000&texture=64",
        "builtin:edge",
        "builtin:spheres",
    ] {
        let stage = Stage::new(&gpu, source);
        for samples in counts(&gpu) {
            let settings = Settings { samples, view: "weights".to_owned(), ..stage.settings((161, 91), 2) };
            for (technique, params, name) in variants() {
                if !technique.info().views.contains(&"weights") {
                    continue;
                }
                let off = pixels_not_black(&image_of(&mut stage.prepare_with(technique, &settings, &params)));
                println!("{source}, {samples} samples: {name}: {off} pixels");
                assert_eq!(off, 0, "{source}, {samples} samples: {name}: pixels whose weights are off");
            }
        }
    }
}

/// Blades of two-sided unlit triangles that pass through each other, their colours of full and no red, green and blue: what a
/// channel shows of a pixel is a number of samples.
fn colored_blades(gpu: &gpu::Device) -> Stage {
    let mut scene =
        load_source("builtin:intersect", &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    scene.environment.background_radiance = Vec3::ZERO;
    for (number, material) in scene.materials.iter_mut().enumerate() {
        let channel = |bit: usize| if (number + 1) >> bit & 1 != 0 { 1.0 } else { 0.0 };
        material.base_color_factor = [channel(0), channel(1), channel(2), 1.0];
        material.unlit = true;
    }
    Stage::of(gpu, scene)
}

/// Pixels in which a channel shows another number of samples.
fn weights_off(found: &[[f32; 4]], expected: &[[f32; 4]], samples: u32) -> usize {
    let most = 0.25 / samples as f32;
    let is_off = |(a, b): &(&[f32; 4], &[f32; 4])| (0..3).any(|c| (a[c] - b[c]).abs() > most);
    found.iter().zip(expected).filter(is_off).count()
}

/// A surface's weight is the number of samples that show it, as `forward` finds them: a technique that gives a sample to another
/// surface still sums to all samples, and its view of weights is black.
#[test]
fn weights_are_the_samples_that_show() {
    let gpu = afterlight_testkit::gpu();
    let stage = colored_blades(&gpu);
    for samples in counts(&gpu) {
        let settings = Settings { samples, keep_hdr: true, ..stage.settings((161, 91), 0) };
        let expected = stage.radiance(find("forward").unwrap(), &settings);
        let weights = |technique: &dyn Technique, params: &Params, mutant: Option<Shader>| {
            let mut prepared = stage.prepare_shaders(technique, &settings, params, mutant);
            weights_off(&radiance_of(&mut prepared), &expected, samples)
        };
        for (technique, params, name) in every_way() {
            if technique.info().samples.contains(&samples) {
                let off = weights(technique, &params, None);
                println!("{samples} samples: {name}: {off} pixels");
                let most = if name.contains("visibility=compute") { COMPUTE_OFF } else { 0 };
                assert!(off <= most, "{samples} samples: {name}: {off} pixels of other weights");
            }
        }
        for (id, sets, variant, header, from, to) in MUTANTS {
            let technique = find(id).unwrap();
            let mutant = compiled_variant(variant, header, &[(from, to)]);
            let off = weights(technique, &params(technique, sets), Some(mutant));
            println!("{samples} samples: {id} {sets:?}, {to:?}: {off} pixels");
            assert!(
                off > 2 * COMPUTE_OFF + 20,
                "{samples} samples: {id} {sets:?}: {to:?} lives: {off} pixels"
            );
        }
    }
}

/// Pixels of 161 × 91 in which depths that are computed otherwise may decide between triangles that pass through each other.
const COMPUTE_OFF: usize = 10;

/// Ways to weigh surfaces wrongly, one for each way in which techniques hold them: technique and parameters, variant, and what is
/// replaced in which of its headers.
type Mutant = (
    &'static str,
    &'static [(&'static str, &'static str)],
    &'static str,
    &'static str,
    &'static str,
    &'static str,
);
const SAME_TRIANGLE: (&str, &str, &str) =
    ("surfaces/visible/triangles.glsl", " && sample_triangle(pixel, i) == v.id", "");
const MUTANTS: &[Mutant] = &[
    (
        "dais",
        &[("visibility", "raster")],
        "dais/shade.comp",
        SAME_TRIANGLE.0,
        SAME_TRIANGLE.1,
        SAME_TRIANGLE.2,
    ),
    (
        "dais",
        &[("visibility", "compute")],
        "dais/shade.comp#keys",
        SAME_TRIANGLE.0,
        SAME_TRIANGLE.1,
        SAME_TRIANGLE.2,
    ),
    (
        "dais",
        &[("fill", "cache")],
        "dais/shade.comp#refs",
        "dais/source_dais.glsl",
        "(name >> 24 | first) & source_mask",
        "source_mask",
    ),
    (
        "dais-multirate",
        &[("visibility", "raster")],
        "dais/shade.comp",
        SAME_TRIANGLE.0,
        SAME_TRIANGLE.1,
        SAME_TRIANGLE.2,
    ),
    ("deferred-dedup", &[], "deferred_dedup/shade.comp", SAME_TRIANGLE.0, SAME_TRIANGLE.1, SAME_TRIANGLE.2),
    (
        "gbuffer-list",
        &[("visibility", "raster")],
        "gbuffer_list/fill.comp",
        SAME_TRIANGLE.0,
        SAME_TRIANGLE.1,
        SAME_TRIANGLE.2,
    ),
    (
        "gbuffer-list",
        &[("fill", "raster")],
        "gbuffer_list/fill.frag",
        "gbuffer_list/fill.frag.glsl",
        "uint mask = uint(gl_SampleMaskIn[0]);",
        "uint mask = uint(gl_SampleMaskIn[0]) | 1u;",
    ),
    (
        "dais-list",
        &[],
        "dais_list/fill.frag",
        "dais_list/fill.frag.glsl",
        "uint mask = uint(gl_SampleMaskIn[0]);",
        "uint mask = uint(gl_SampleMaskIn[0]) | 1u;",
    ),
    (
        "deferred-ssaa",
        &[],
        "deferred_ssaa/shade.comp",
        "surfaces/samples/source_samples.glsl",
        "texelFetch(gbuffer_base_color, source_pixel, int(i))",
        "texelFetch(gbuffer_base_color, source_pixel, 0)",
    ),
];

/// Lists with room for all equal what holds every sample, whatever the layout of their blocks.
#[test]
fn lists_equal_the_deduplicated_samples() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.settings((320, 180), 100) };
        let dedup = stage.image(find("deferred-dedup").unwrap(), &settings);
        for id in ["dais", "dais-list"] {
            for way in ways(id) {
                let technique = find(id).unwrap();
                let db = psnr(
                    &dedup,
                    &image_of(&mut stage.prepare_with(technique, &settings, &params(technique, way))),
                );
                println!("{samples} samples: {id} {way:?}: {db:.2} dB to deferred-dedup");
                assert!(db >= 45.0, "{samples} samples: {id} {way:?}: {db:.2} dB to deferred-dedup");
            }
        }
        for sets in [
            &[("visibility", "raster")][..],
            &[("fill", "compute"), ("pointer", "wide")],
            &[("fill", "compute"), ("position", "depth")],
            &[("visibility", "compute")],
            &[("visibility", "compute"), ("pointer", "wide")],
            &[("fill", "raster"), ("position", "depth")],
            &[("fill", "raster"), ("pointer", "wide")],
            &[("fill", "raster")],
        ] {
            let db = psnr(&dedup, &list_image(&stage, &settings, sets));
            println!("{samples} samples: {sets:?}: {db:.2} dB to deferred-dedup");
            assert!(db >= 45.0, "{samples} samples: {sets:?}: {db:.2} dB to deferred-dedup");
        }
    }
}

/// With blocks for one sample alone the image is that of one sample.
#[test]
fn without_dynamic_blocks_it_is_the_image_of_one_sample() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    // Blended surfaces are drawn over it at all samples.
    let settings = stage
        .settings((320, 180), 100)
        .with_effects(|effects| effects.transparency.order = Transparency::None);
    let one = stage.image(find("forward").unwrap(), &settings);
    for samples in std::iter::once(1).chain(counts(&gpu)) {
        let db =
            psnr(&one, &list_image(&stage, &Settings { samples, ..settings.clone() }, &[("blocks", "0")]));
        println!("{samples} samples, no dynamic blocks: {db:.2} dB to one sample");
        assert!(db >= 50.0, "{samples} samples: {db:.2} dB to one sample");
    }
}

/// A bound on blocks that is too small drops samples, says how many, and leaves an image between one sample and all.
#[test]
fn a_bound_on_blocks_is_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let list = find("gbuffer-list").unwrap();
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.settings((320, 180), 100) };
        let all = list_image(&stage, &settings, &[]);
        for fill in ["compute", "raster"] {
            let mut last_db = 0.0;
            for blocks in ["100", "10000", "100000"] {
                let sets = [("fill", fill), ("blocks", blocks)];
                let mut prepared = stage.prepare_with(list, &settings, &params(list, &sets));
                let db = psnr(&all, &image_of(&mut prepared)).min(99.0);
                let counter = prepared.counters().unwrap_or_else(|e| panic!("{e}")).remove(0);
                println!("{samples} samples: {sets:?}: {db:.2} dB to all, {counter:?}");
                assert_eq!(counter.dropped > 0, counter.needed > counter.capacity, "{counter:?}");
                assert!(
                    db > last_db,
                    "{samples} samples: {sets:?}: {db:.2} dB with more blocks, {last_db:.2} before"
                );
                last_db = db;
            }
            assert!(last_db > 50.0, "{samples} samples, {fill}: {last_db:.2} dB with room for all");
        }
    }
}

/// The triangle buffer and the lists begin with room for 16: where a view needs a hundred times as much and more, it gets it, and the
/// image is right.
#[test]
fn lists_a_hundred_times_too_small_get_room() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=100000&texture=64");
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.settings((320, 180), 20) };
        let dedup = stage.image(find("deferred-dedup").unwrap(), &settings);
        for (id, way) in
            [("dais", &[("fill", "resolve")][..]), ("dais", &[("fill", "cache")]), ("dais-list", &[])]
        {
            let technique = find(id).unwrap();
            let mut prepared = stage.prepare_with(technique, &settings, &params(technique, way));
            let db = psnr(&dedup, &image_of(&mut prepared));
            let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
            println!("{samples} samples: {id} {way:?}: {db:.2} dB, {counters:?}");
            assert!(db >= 45.0, "{samples} samples: {id} {way:?}: {db:.2} dB to deferred-dedup");
            for counter in counters.iter().filter(|c| !c.name.starts_with("cluster")) {
                assert!(counter.dropped == 0 && counter.needed > 1600, "{id} {way:?}: {counter:?}");
            }
        }
    }
}

/// A bound on nodes that is too small drops samples, says how many, and what remains takes their weight: the background does not
/// show through.
#[test]
fn a_bound_on_nodes_is_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let list = find("dais-list").unwrap();
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.settings((320, 180), 100) };
        let all = image_of(&mut stage.prepare(list, &settings));
        let mut last_db = 0.0;
        for nodes in ["0", "1000", "100000"] {
            let mut prepared = stage.prepare_with(list, &settings, &params(list, &[("nodes", nodes)]));
            let db = psnr(&all, &image_of(&mut prepared)).min(99.0);
            let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
            let counter = counters.iter().find(|c| c.name == "nodes").expect("nodes are counted");
            println!("{samples} samples: {nodes} nodes: {db:.2} dB to all, {counter:?}");
            assert_eq!(counter.dropped > 0, counter.needed > counter.capacity, "{counter:?}");
            assert!(db > last_db, "{samples} samples: {nodes} nodes: {db:.2} dB, {last_db:.2} with fewer");
            last_db = db;
        }
        assert!(last_db > 50.0, "{samples} samples: {last_db:.2} dB with room for all");
        // A white background makes what shows through bright.
        let mut white = settings.clone();
        white.environment.background_radiance = Vec3::splat(100.0);
        let bright = |nodes: &str| {
            let image = image_of(&mut stage.prepare_with(list, &white, &params(list, &[("nodes", nodes)])));
            image.pixels.chunks_exact(4).filter(|p| p[..3] == [255; 3]).count()
        };
        assert!(bright("0") <= bright("auto"), "the background shows through dropped samples");
    }
}

/// Bars side by side, a triangle and a colour each, that share no pixel, before a bright background.
fn bars() -> Scene {
    let bar = |i: u8| {
        let x = -2.5 + 0.21 * f32::from(i);
        let corners =
            [Vec3::new(x, -2.0, 0.0), Vec3::new(x + 0.14, -2.0, 0.0), Vec3::new(x + 0.07, 9.0, 0.0)];
        (corners, [40 + 8 * i, 20 + 90 * (i % 3), 250 - 8 * i])
    };
    let mut scene = scene_of(&[(unlit(AlphaMode::Opaque), (0..24).map(bar).collect())], Vec3::Z * 3.0);
    scene.environment.background_radiance = Vec3::new(0.1, 1.0, 0.1);
    scene
}

/// Triangles that find no room in the triangle buffer are told, and no other triangle shows in their place: what shows is the
/// triangle itself, or the background.
#[test]
fn triangles_without_room_are_told_and_no_other_shows() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::of(&gpu, bars());
    let mut nothing = stage.settings((8, 8), 0);
    nothing.camera = Camera::look_at("away", Vec3::Z * 3.0, Vec3::Z * 9.0, 0.9, 0.1);
    let empty = stage.image(find("forward").unwrap(), &nothing);
    // There is room for eight, and what is needed grows with what is given: the last recording is short as well.
    let shortage = (
        "uint place = atomicAdd(triangles_needed, 1u);",
        "uint place = atomicAdd(triangles_needed, 1u);
    if (place >= 8u) {
        place = max(place, record_room(triangle_buffer.length()));
        atomicMax(triangles_needed, record_room(triangle_buffer.length()) + 8u);
    }",
    );
    let tessellated = afterlight_testkit::has_tessellation(&gpu);
    for (id, sets, shader, samples, tessellate) in [
        ("dais", &[("fill", "cache")][..], "dais/fill.frag", 1, false),
        ("dais", &[("fill", "cache"), ("reference-bits", "8")], "dais/fill.frag#wide", 1, false),
        // Of tessellated bars several triangles share a pixel, some of them with room.
        ("dais", &[], "dais/fill.frag#whole", 4, true),
        ("dais", &[("reference-bits", "8")], "dais/fill.frag#whole-wide", 4, true),
        ("dais-list", &[], "dais_list/fill.frag#whole", 4, true),
    ] {
        if tessellate && !tessellated {
            continue;
        }
        let mut settings = Settings { samples, ..stage.settings((161, 91), 0) };
        if tessellate {
            settings = settings.with_effects(|effects| effects.tessellation.edge_px = Some(64.0));
        }
        let technique = find(id).unwrap();
        let right = image_of(&mut stage.prepare_with(technique, &settings, &params(technique, sets)));
        let mutant = compiled_variant(shader, "dais/memoize.glsl", &[shortage]);
        let mut prepared = stage.prepare_shaders(technique, &settings, &params(technique, sets), [mutant]);
        let short = image_of(&mut prepared);
        let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
        let counter = counters.iter().find(|c| c.name == "triangles").expect("triangles are counted");
        assert!(counter.dropped > 0, "{id} {sets:?}: {counter:?}");
        let alike = |a: &[u8], b: &[u8]| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 2);
        let background = &empty.pixels[..4];
        let pairs = short.pixels.chunks_exact(4).zip(right.pixels.chunks_exact(4));
        let bars: Vec<_> = pairs.filter(|(_, right)| !alike(right, background)).collect();
        let (shown, hidden): (Vec<_>, Vec<_>) =
            bars.into_iter().partition(|(short, right)| alike(short, right));
        let others = hidden.iter().filter(|(short, _)| !alike(short, background)).count();
        println!(
            "{id} {sets:?}, {samples} samples: {} shown, {} hidden, {others} others",
            shown.len(),
            hidden.len()
        );
        assert!(!shown.is_empty() && hidden.len() > 500, "{id} {sets:?}: the shortage shows too little");
        assert_eq!(others, 0, "{id} {sets:?}, {samples} samples: pixels show another triangle");
    }
}

/// Each filter stores fewer samples, and none turns the image into another.
#[test]
fn filters_store_fewer_samples() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let list = find("gbuffer-list").unwrap();
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.settings((320, 180), 100) };
        let one =
            psnr(&list_image(&stage, &settings, &[]), &list_image(&stage, &settings, &[("blocks", "0")]));
        let all = list_image(&stage, &settings, &[]);
        let needed = |sets: &[(&str, &str)]| {
            let mut prepared = stage.prepare_with(list, &settings, &params(list, sets));
            let db = psnr(&all, &image_of(&mut prepared));
            let counter = prepared.counters().unwrap_or_else(|e| panic!("{e}")).remove(0);
            println!("{samples} samples: {sets:?}: {} blocks, {db:.2} dB to all", counter.needed);
            assert!(db > one - 1.0, "{sets:?}: {db:.2} dB to all, one sample {one:.2}");
            assert_eq!(counter.dropped, 0, "{counter:?}");
            counter.needed
        };
        let without = needed(&[]);
        for fill in ["compute", "raster"] {
            for filter in ["ellipse", "rectangle", "depth", "objects", "depth-edges", "ellipse+depth"] {
                let sets = [("fill", fill), ("filter", filter), ("depth-threshold", "12"), ("objects", "*")];
                assert!(needed(&sets) < without, "{sets:?} stores as much as no filter");
            }
        }
        let inside = needed(&[("filter", "ellipse")]);
        let outside = needed(&[("filter", "ellipse"), ("region", "outside")]);
        assert_eq!(inside + outside, without, "the two sides of a region are the whole");
        assert!(needed(&[("filter", "edges")]) < without);
    }
}

/// The paper's detector has a known answer before a plane that faces the eye: depth is the near distance over the view distance, and that of
/// the background 0. A threshold below the difference finds its edge, one above does not; by distances the background is always an edge.
#[test]
fn depth_edges_by_range_are_the_papers() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:edge");
    let (near_m, distance_m) = (0.1, 2.0);
    let camera = Camera::look_at("front", Vec3::Z * distance_m, Vec3::ZERO, 0.8, near_m);
    let depth = near_m / distance_m;
    for samples in counts(&gpu) {
        let settings = Settings { samples, ..stage.from(camera.clone(), (96, 54), 0) };
        for fill in ["compute", "raster"] {
            let greys = |measure: &str, threshold: f32| {
                let threshold = threshold.to_string();
                let sets = [
                    ("fill", fill),
                    ("filter", "depth-edges"),
                    ("depth-edges", measure),
                    ("edge-threshold", &threshold),
                ];
                let image = list_image(&stage, &settings, &sets);
                let white = image.pixels.chunks_exact(4).map(|p| p[0]).max().unwrap_or(0);
                image.pixels.chunks_exact(4).filter(|p| p[0] > 0 && p[0] < white).count()
            };
            let below = greys("range", 0.95 * depth);
            assert!(
                below > 20,
                "{samples} samples, {fill}: {below} grey pixels at a threshold below the range"
            );
            assert_eq!(greys("range", 1.05 * depth), 0, "{samples} samples, {fill}: above the range");
            assert_eq!(greys("relative", 1.05 * depth), below, "{samples} samples, {fill}: by distances");
        }
    }
}
/// Masked surfaces of one depth: where early tests gave the stencil bit to fragments without alpha, 125 of 2 M pixels of this
/// view at 1920×1080 lacked samples, so the view is large.
#[test]
fn masked_surfaces_of_one_depth_lose_no_sample() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=100000&texture=64");
    for samples in counts(&gpu) {
        let settings = Settings { samples, view: "weights".to_owned(), ..stage.settings((960, 540), 1) };
        let off = pixels_not_black(&list_image(&stage, &settings, &[("fill", "raster")]));
        assert_eq!(off, 0, "{samples} samples: pixels whose weights are off");
    }
}

/// The view of weights shows pixels whose weights do not sum to the samples: without blocks, those of every edge.
#[test]
fn weights_that_do_not_sum_are_seen() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    for samples in counts(&gpu) {
        let settings = Settings { samples, view: "weights".to_owned(), ..stage.settings((161, 91), 2) };
        let off = pixels_not_black(&list_image(&stage, &settings, &[("fill", "raster"), ("blocks", "0")]));
        assert!(off > 20, "{off} pixels are seen to lack samples");
    }
}

/// Bands that masked surfaces, or any, do not reach: the passes over them write the same buffers, and the image is that of one band.
#[test]
fn bands_that_nothing_reaches_are_drawn_too() {
    let gpu = afterlight_testkit::gpu();
    let technique = find("dais-list").unwrap();
    let loaded = Stage::new(&gpu, "builtin:intersect").scene;
    for masked in 0..loaded.materials.len() {
        let mut scene = loaded.clone();
        scene.materials[masked].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        let stage = Stage::of(&gpu, scene);
        // Low over the floor and upwards: the sky alone in the upper band, the floor alone in the lowest.
        let bounds = stage.scene.bounds_ws();
        let eye = bounds.center() + bounds.size() * Vec3::new(0.9, 0.4, 0.9);
        let camera = Camera::look_at("up", eye, bounds.center() + bounds.size() * Vec3::Y * 0.8, 1.2, 0.1);
        let settings = Settings { samples: 4, ..stage.from(camera, (96, 96), 4) };
        let [one, six] = ["1", "6"].map(|bands| {
            let params = params(technique, &[("bands", bands)]);
            image_of(&mut stage.prepare_with(technique, &settings, &params))
        });
        assert!(covered(&one) > 0.05, "the view shows {:.3}", covered(&one));
        let db = psnr(&one, &six);
        println!("material {masked}: {db:.2} dB");
        assert!(db > 60.0, "material {masked} masked: {db:.2} dB to one band");
    }
}
