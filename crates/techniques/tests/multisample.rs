//! Techniques of several samples a pixel against `forward` at as many (ladder step d).

mod common;

use afterlight_techniques::{
    Params, Settings, Technique, find,
    graph::gpu,
    registry,
    scene::Camera,
};
use common::{Stage, image_of, psnr};
use glam::Vec3;

/// Least PSNR to `forward` at as many samples, dB (contract).
const MIN_PSNR_DB: f64 = 40.0;

/// Sample counts beyond one that the device has, of those that techniques are tested at.
fn counts(device: &gpu::Device) -> Vec<u32> {
    [4, 8].into_iter().filter(|count| device.features().supports_samples(*count, false)).collect()
}

/// Every technique that renders several samples, with every value of its `lights` parameter.
fn variants() -> Vec<(&'static dyn Technique, Params, String)> {
    let mut all = Vec::new();
    for technique in registry().iter().copied().filter(|t| t.info().samples.contains(&4)) {
        let info = technique.info();
        let values: &[&str] =
            if info.params.iter().any(|p| p.key == "lights") { &["all", "tiled"] } else { &[""] };
        for value in values {
            let mut params = Params::default();
            if !value.is_empty() {
                params.set(info, "lights", value).unwrap_or_else(|e| panic!("{e}"));
            }
            all.push((technique, params, format!("{} {value}", info.id)));
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
                assert!(db >= MIN_PSNR_DB, "{what}, {samples} samples: {name} run {run}: {db:.2} dB to forward");
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

#[test]
fn on_sponza() {
    let gpu = afterlight_testkit::gpu();
    let Some(scenes) = afterlight_testkit::shared_scenes() else { return };
    let stage = Stage::new(&gpu, &scenes.join("sponza/sponza.gltf").to_string_lossy());
    let camera =
        Camera::look_at("view", Vec3::new(-9.0, 2.5, 0.0), Vec3::new(5.0, 3.0, 0.0), 60f32.to_radians(), 0.1);
    all_agree(&stage, &stage.from(camera, (320, 180), 100), "sponza", 1);
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
