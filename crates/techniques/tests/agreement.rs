//! Every exact technique against `forward` on the same scene (ladder step d), several times, since races show as errors
//! that move between runs.

mod common;

use afterlight_techniques::{
    Params, TechniqueError, find, registry,
    scene::{Camera, Scene},
};
use afterlight_testkit::Need;
use common::{Stage, compiled_variant, covered, image_of, least_db, params, psnr, wider};
use glam::Vec3;

/// Bytes that lavapipe (Mesa 22.3) binds at most.
const SMALL_RANGE_BYTES: u64 = 1 << 27;

/// Whether a technique is to be tested: all are, or those that `AFTERLIGHT_TECHNIQUES` lists, such as `tiled,dais`.
fn is_asked_for(id: &str) -> bool {
    let asked = std::env::var("AFTERLIGHT_TECHNIQUES").unwrap_or_default();
    let asked: Vec<&str> = asked.split(',').filter(|id| !id.is_empty()).collect();
    for id in &asked {
        assert!(find(id).is_some(), "AFTERLIGHT_TECHNIQUES: found `{id}`, expected a technique's id");
    }
    asked.is_empty() || asked.contains(&id)
}

/// Compares all techniques to `forward`, whose own image is the same to the bit whenever it is drawn: nothing in it depends on an order
/// that the device chooses. What `forward` itself is worth is told by `known_answers` and by the reference renderer in f64. Every one runs.
fn all_agree(stage: &Stage, settings: &afterlight_techniques::Settings, what: &str, runs: usize) {
    all_agree_but(stage, settings, what, runs, &[]);
}

/// The same, where a device that binds no more than [`SMALL_RANGE_BYTES`] has no room for the techniques `too_large`: these are refused
/// with their bytes, and told as skipped. That another one is, or that one of them is not, fails.
fn all_agree_but(
    stage: &Stage,
    settings: &afterlight_techniques::Settings,
    what: &str,
    runs: usize,
    too_large: &[&str],
) {
    let is_small = stage.device.features().max_storage_buffer_range <= SMALL_RANGE_BYTES;
    let reference = stage.image(find("forward").unwrap(), settings);
    for technique in registry().iter().filter(|t| t.info().samples.contains(&1) && is_asked_for(t.info().id))
    {
        let info = technique.info();
        let refused = is_small && too_large.contains(&info.id);
        let mut prepared = match stage.try_prepare(*technique, settings, &Params::default()) {
            Ok(prepared) => {
                assert!(!refused, "{what}: {} has room, expected a refusal", info.id);
                prepared
            }
            Err(error @ TechniqueError::TooLarge { .. }) if refused => {
                assert!(error.to_string().contains("bytes"), "{error}");
                afterlight_testkit::skip(Need::LargeBindings, &format!("{what}: {error}"));
                continue;
            }
            Err(error) => panic!("{what}: {}: {error}", info.id),
        };
        for run in 0..runs {
            let image = image_of(&mut prepared);
            if info.id == "forward" {
                assert!(image == reference, "{what}: forward run {run}: found another image than the first");
                continue;
            }
            let db = psnr(&reference, &image);
            println!("{what}: {} run {run}: {db:.2} dB", info.id);
            assert!(
                db >= least_db(*technique, &Params::default(), 1),
                "{what}: {} run {run}: {db:.2} dB to forward",
                info.id
            );
        }
    }
}

#[test]
fn on_the_colonnade_with_100_lights() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    let reference = stage.image(find("forward").unwrap(), &settings);
    assert!(covered(&reference) > 0.5, "the view shows little: {}", covered(&reference));
    all_agree(&stage, &settings, "colonnade", 3);
}

#[test]
fn a_range_larger_by_two_percent_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    let mutant =
        afterlight_techniques::Settings { lights: wider(&settings.lights, 1.02), ..settings.clone() };
    let forward = find("forward").unwrap();
    let db = psnr(&stage.image(forward, &settings), &stage.image(forward, &mutant));
    assert!(db < 45.0, "a mutant within the bound: {db:.2} dB");
}

#[test]
fn a_dropped_light_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    let forward = find("forward").unwrap();
    let reference = stage.image(forward, &settings);
    // One light of those that reach the view most.
    let db = (0..settings.lights.len())
        .step_by(10)
        .map(|i| {
            let mut mutant = settings.clone();
            mutant.lights.remove(i);
            psnr(&reference, &stage.image(forward, &mutant))
        })
        .fold(f64::INFINITY, f64::min);
    assert!(db < 45.0, "a mutant within the bound: {db:.2} dB");
}

#[test]
fn on_sponza_with_100_lights() {
    let gpu = afterlight_testkit::gpu();
    let Some(scenes) = afterlight_testkit::shared_scenes() else { return };
    let stage = Stage::new(&gpu, &scenes.join("sponza/sponza.gltf").to_string_lossy());
    let camera =
        Camera::look_at("view", Vec3::new(-9.0, 2.5, 0.0), Vec3::new(5.0, 3.0, 0.0), 60f32.to_radians(), 0.1);
    let settings = stage.from(camera, (320, 180), 100);
    all_agree(&stage, &settings, "sponza", 2);
}

/// Sizes that are no multiple of a tile, down to one pixel. Where an image is a few pixels high, a pixel-quad's difference and
/// the derivative at a pixel choose different mip levels (42 dB on the colonnade's floor at 33×17), so sizes between have a
/// scene without textures.
#[test]
fn at_odd_sizes() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    for size in [(1, 1), (17, 3), (641, 363)] {
        all_agree(&stage, &stage.settings(size, 20), &format!("{size:?}"), 1);
    }
    let stage = Stage::new(&gpu, "builtin:spheres?segments=24");
    for size in [(3, 33), (33, 17), (16, 16), (15, 49)] {
        all_agree(&stage, &stage.settings(size, 20), &format!("untextured {size:?}"), 1);
    }
}

#[test]
fn at_2160p() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:sphere?segments=64");
    let settings = stage.settings((3840, 2160), 0);
    all_agree_but(&stage, &settings, "3840x2160", 1, &["gbuffer-list"]);
}

#[test]
fn with_0_1_and_10_000_lights() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    for count in [1, 10_000] {
        all_agree(&stage, &stage.settings((48, 27), count), &format!("{count} lights"), 1);
    }
    let mut none = stage.settings((48, 27), 1);
    none.lights.clear();
    all_agree(&stage, &none, "0 lights", 1);
}

#[test]
fn with_the_camera_in_a_wall_and_looking_away() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let bounds = stage.scene.bounds_ws();
    let views = [
        ("in a wall", bounds.min + bounds.size() * Vec3::new(0.5, 0.3, 0.002), bounds.center()),
        ("looking away", bounds.max + bounds.size(), bounds.max + bounds.size() * 2.0),
        ("straight down", bounds.center(), bounds.center() - Vec3::Y),
        ("far outside", bounds.center() + bounds.size() * 50.0, bounds.center()),
    ];
    for (what, eye, target) in views {
        let camera = Camera::look_at(what, eye, target, 1.0, 0.05);
        all_agree(&stage, &stage.from(camera, (96, 54), 50), what, 1);
    }
}

#[test]
fn inside_light_volumes_and_with_all_kinds_of_lights() {
    use afterlight_techniques::scene::{Light, LightKind};
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let mut settings = stage.settings((96, 54), 8);
    let eye = settings.camera.eye_ws();
    let light = |kind, range_m| Light {
        kind,
        position_ws: eye + Vec3::new(0.1, 0.3, 0.2),
        direction_ws: Vec3::new(0.3, -0.8, -0.5).normalize(),
        intensity: Vec3::new(3.0, 2.0, 1.0),
        range_m,
    };
    settings.lights.extend([
        light(LightKind::Point, 6.0),
        light(LightKind::Spot { inner_angle_rad: 0.3, outer_angle_rad: 0.9 }, 20.0),
        light(LightKind::Spot { inner_angle_rad: 0.0, outer_angle_rad: 0.5 }, f32::INFINITY),
        light(LightKind::Directional, f32::INFINITY),
    ]);
    all_agree(&stage, &settings, "all kinds", 1);
}

#[test]
fn on_an_empty_scene() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::of(&gpu, Scene::default());
    all_agree(&stage, &stage.settings((20, 20), 0), "empty", 1);
}

/// A level view whose rows are odd in number: pixel centres lie on the floor's horizon, and in the quads of the row below no difference of texture
/// coordinates is finite.
#[test]
fn mip_levels_beside_a_horizon_are_those_of_a_raster_pass() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let eye = Vec3::new(8.54382, 0.06336212, -5.3927307);
    let camera = Camera::look_at("level", eye, eye + 30.0 * Vec3::Z, 53.1f32.to_radians(), 0.003);
    let settings = stage.from(camera, (169, 73), 122);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let as_it_was =
        [("abs(change.x) < MOST ? change.x : MOST, abs(change.y) < MOST ? change.y : MOST", "change")];
    for (id, shader) in
        [("visibility", "visibility/shade.comp"), ("gbuffer-list", "gbuffer_list/fill.comp#one")]
    {
        let technique = find(id).unwrap();
        let raster = params(technique, &[("visibility", "raster")]);
        let db = |shaders: Vec<_>| {
            psnr(&reference, &image_of(&mut stage.prepare_shaders(technique, &settings, &raster, shaders)))
        };
        let mutant = compiled_variant(shader, "material.glsl", &as_it_was);
        let (here, mutant) = (db(Vec::new()), db(vec![mutant]));
        println!("{id}: {here:.2} dB, {mutant:.2} as it was");
        let least = least_db(technique, &raster, 1);
        assert!(here >= least, "{id}: {here:.2} dB");
        assert!(mutant < least, "{id}: {mutant:.2} dB as it was, a mutant within the bound");
    }
}

/// Techniques that read a triangle's vertices choose the mip levels of a raster pass on surfaces seen at a flat angle: by the differences within a
/// quad of pixels. Changes from each pixel to its neighbours are others.
#[test]
fn mip_levels_are_those_of_a_quad() {
    const LEAST_DB: f64 = 58.0;
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let camera = Camera::look_at(
        "along the floor",
        Vec3::new(-9.0, 0.12, 0.3),
        Vec3::new(9.0, 0.5, -1.0),
        80f32.to_radians(),
        0.01,
    );
    let settings = stage.from(camera, (161, 91), 30);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let own_corner = ("uvec2 corner = pixel & ~1u;", "uvec2 corner = pixel;");
    for (id, shader, header, mutation) in [
        ("visibility", "visibility/shade.comp", "triangle.glsl", own_corner),
        (
            "dais",
            "dais/shade.comp#one",
            "surfaces/triangles/interpolate.glsl",
            ("2.0 * floor(0.5 * pixel) - pixel", "vec2(0.0)"),
        ),
    ] {
        let technique = find(id).unwrap();
        let raster = params(technique, &[("visibility", "raster")]);
        let db = psnr(&reference, &image_of(&mut stage.prepare_with(technique, &settings, &raster)));
        let mutant = compiled_variant(shader, header, &[mutation]);
        let mutant = image_of(&mut stage.prepare_shaders(technique, &settings, &raster, [mutant]));
        let mutant_db = psnr(&reference, &mutant);
        println!("{id}: {db:.2} dB, changes of the pixel's own {mutant_db:.2} dB");
        assert!(db >= LEAST_DB, "{id}: {db:.2} dB");
        assert!(mutant_db < LEAST_DB, "{id}: a mutant within the bound: {mutant_db:.2} dB");
    }
}
