//! Lists of lights, one a pixel: against `forward`, against rays in f64, and bounded.

mod common;

use afterlight_image::Rgba8Image;
use afterlight_oracle::raster::{RayScene, pixel_ray};
use afterlight_techniques::{
    Counter, Settings, Technique, find,
    scene::{Camera, Light, LightKind},
    shader::Shader,
};
use common::{Stage, compiled_variant, image_of, params, psnr};
use glam::Vec3;

const TECHNIQUES: [&str; 2] = ["light-list", "light-list-forward"];
/// Least PSNR to `forward`, dB.
const MIN_PSNR_DB: f64 = 50.0;

/// A technique's image and what it counted, with parameters and with shaders in place of its own.
fn rendered(
    stage: &Stage,
    technique: &dyn Technique,
    settings: &Settings,
    sets: &[(&str, &str)],
    shader: Option<&Shader>,
) -> (Rgba8Image, Vec<Counter>) {
    let params = params(technique, sets);
    let mut prepared = stage.prepare_shaders(technique, settings, &params, shader.cloned());
    let image = image_of(&mut prepared);
    (image, prepared.counters().unwrap_or_else(|e| panic!("{e}")))
}

/// `append.frag` with parts of its text replaced.
fn mutant(replaced: &[(&str, &str)]) -> Shader {
    compiled_variant("lights/pixel_lists/append.frag#one", "lights/pixel_lists/append.frag.glsl", replaced)
}

/// Both techniques against `forward`; nothing is dropped.
fn both_agree(stage: &Stage, settings: &Settings, what: &str) {
    let reference = stage.image(find("forward").unwrap(), settings);
    for id in TECHNIQUES {
        let (image, counters) = rendered(stage, find(id).unwrap(), settings, &[], None);
        let db = psnr(&reference, &image);
        println!("{what}: {id} {db:.2} dB, {:?}", counters[0]);
        assert!(db >= MIN_PSNR_DB, "{what}: {id}: {db:.2} dB to forward");
        assert_eq!(counters[0].dropped, 0, "{what}: {id}: {:?}", counters[0]);
        assert!(counters[0].needed <= counters[0].capacity, "{what}: {id}: {:?}", counters[0]);
    }
}

#[test]
fn with_1_100_and_10_000_lights_on_the_colonnade() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    for lights in [1, 100, 10_000] {
        both_agree(&stage, &stage.settings((96, 54), lights), &format!("colonnade, {lights} lights"));
    }
}

#[test]
fn with_1_100_and_10_000_lights_on_sponza() {
    let gpu = afterlight_testkit::gpu();
    let Some(scenes) = afterlight_testkit::shared_scenes() else { return };
    let stage = Stage::new(&gpu, &scenes.join("sponza/sponza.gltf").to_string_lossy());
    let camera =
        Camera::look_at("view", Vec3::new(-9.0, 2.5, 0.0), Vec3::new(5.0, 3.0, 0.0), 60f32.to_radians(), 0.1);
    for lights in [1, 100, 10_000] {
        let settings = stage.from(camera.clone(), (96, 54), lights);
        both_agree(&stage, &settings, &format!("sponza, {lights} lights"));
    }
}

/// The lists hold a light for every pixel whose surface lies within its range, and no other: their nodes are as many as rays find.
#[test]
fn lists_hold_what_is_within_range() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let size = [160, 90];
    let mut settings = stage.settings((size[0], size[1]), 60);
    // The eye inside of a volume, and a light without an end, which is in no list.
    let eye = settings.camera.eye_ws();
    settings.lights.push(Light { position_ws: eye, range_m: 4.0, ..settings.lights[0] });
    settings.lights.push(Light {
        kind: LightKind::Directional,
        range_m: f32::INFINITY,
        ..settings.lights[0]
    });
    let expected = pairs_by_rays(&stage, &settings, size);
    let off = |needed: u32| (f64::from(needed) / expected - 1.0).abs();
    for id in TECHNIQUES {
        let technique = find(id).unwrap();
        let (image, counters) = rendered(&stage, technique, &settings, &[], None);
        println!("{id}: {} nodes, {expected} by rays", counters[0].needed);
        assert!(off(counters[0].needed) < 0.002, "{id}: {} nodes, {expected} by rays", counters[0].needed);

        // Lights whose volume lies behind the surface.
        let loose = mutant(&[("float reach_m = sphere.w + slack_m;", "float reach_m = 1e9;")]);
        let (_, more) = rendered(&stage, technique, &settings, &[], Some(&loose));
        assert!(off(more[0].needed) > 0.02, "{id}: a mutant within the bound: {} nodes", more[0].needed);

        let dropped = mutant(&[("!gl_HelperInvocation &&", "light_index != frame.light_count - 1u &&")]);
        let (fewer_lit, fewer) = rendered(&stage, technique, &settings, &[], Some(&dropped));
        let db = psnr(&image, &fewer_lit);
        assert!(off(fewer[0].needed) > 0.002 && db < MIN_PSNR_DB, "{id}: a dropped light: {db:.2} dB");
    }
}

/// Pairs of a pixel's surface and a light that reaches as far.
fn pairs_by_rays(stage: &Stage, settings: &Settings, size: [u32; 2]) -> f64 {
    let rays = RayScene::new(&stage.scene);
    let hits = (0..size[0] * size[1]).filter_map(|i| {
        let hit = rays.first_hit(&pixel_ray(&settings.camera, [i % size[0], i / size[0]], size))?;
        Some(rays.attributes(&hit).position_ws)
    });
    let reaches = |light: &&Light, p: glam::DVec3| {
        light.range_m.is_finite() && light.position_ws.as_dvec3().distance(p) <= f64::from(light.range_m)
    };
    hits.map(|p| settings.lights.iter().filter(|light| reaches(light, p)).count() as f64).sum()
}

/// A bound that is too small drops lights and says how many; room for all drops none.
#[test]
fn a_bound_on_nodes_is_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    for id in TECHNIQUES {
        let technique = find(id).unwrap();
        let (all, counters) = rendered(&stage, technique, &settings, &[], None);
        let needed = counters[0].needed;
        for nodes in [0, needed / 2, needed - 1, needed] {
            let sets = [("light-nodes", &*nodes.to_string())];
            let (image, counters) = rendered(&stage, technique, &settings, &sets, None);
            let counter = &counters[0];
            let db = psnr(&all, &image);
            println!("{id}: {nodes} nodes: {db:.2} dB to all, {counter:?}");
            assert_eq!((counter.needed, counter.dropped), (needed, needed - nodes), "{id}");
            assert!(counter.fixed && counter.capacity == nodes, "{id}: {counter:?}");
            if nodes <= needed / 2 {
                assert!(db < 40.0, "{id}: {nodes} nodes change nothing: {db:.2} dB");
            }
        }
    }
}

/// Counters are held far below 2³², here at 100: whoever finds more takes back what it added.
#[test]
fn counters_of_nodes_are_held_below_2_to_the_32() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    let low = ("MOST_NEEDED = 0xf0000000u", "MOST_NEEDED = 100u");
    let (held, kept) = (mutant(&[low]), mutant(&[low, ("0xffffffffu", "0u")]));
    for id in TECHNIQUES {
        let technique = find(id).unwrap();
        let sets = [("light-nodes", "16")];
        let needed = rendered(&stage, technique, &settings, &sets, None).1[0].needed;
        assert!(needed > 1000, "{id}: the view has {needed} pairs");
        let counter = rendered(&stage, technique, &settings, &sets, Some(&held)).1.remove(0);
        assert_eq!((counter.needed, counter.dropped), (100, 100), "{id}: of {needed}");
        // The mutant: nobody takes back.
        let counter = rendered(&stage, technique, &settings, &sets, Some(&kept)).1.remove(0);
        assert_eq!(counter.needed, needed, "{id}: a counter that runs on goes unseen: {counter:?}");
    }
}

/// The order of a list is the order in which the device ran; the sum hardly knows.
#[test]
fn frames_differ_by_rounding_alone() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    for id in TECHNIQUES {
        let mut prepared = stage.prepare(find(id).unwrap(), &settings);
        let first = image_of(&mut prepared);
        for _ in 0..4 {
            let again = image_of(&mut prepared);
            let most = first.pixels.iter().zip(&again.pixels).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(most <= Some(1), "{id}: {most:?} of 255 between two frames");
        }
    }
}
