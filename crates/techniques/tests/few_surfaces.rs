//! Every technique where little or nothing is to be drawn: no scene at all, blended panes alone, one triangle.

mod common;

use afterlight_techniques::{
    Params, Settings, Technique, find,
    scene::{AlphaMode, Material, Scene},
};
use common::{
    Stage, covered,
    flat::{Draw, scene_of, unlit},
    image_of, least_db_of_four_lights, psnr,
    ways::every_way,
};
use glam::Vec3;

const SIZE: (u32, u32) = (37, 21);

fn triangle(z_m: f32, color: [u8; 3]) -> Draw {
    vec![([Vec3::new(-1.0, -0.8, z_m), Vec3::new(1.1, -0.6, z_m), Vec3::new(0.2, 0.9, z_m)], color)]
}

/// Asserts that every technique in every way shows what `forward` does, with so many lights, before a background of some colour.
fn all_agree(stage: &Stage, what: &str, least_covered: f64) {
    let mut wrong = Vec::new();
    for (samples, lights) in [(1, 0), (4, 0), (1, 20), (4, 20)] {
        let mut settings = Settings { samples, ..stage.settings(SIZE, lights) };
        if least_covered == 0.0 {
            settings.environment.background_radiance = Vec3::new(0.2, 0.4, 0.1);
        }
        let reference = stage.image(find("forward").unwrap(), &settings);
        assert!(covered(&reference) >= least_covered, "{what}: the view shows {}", covered(&reference));
        for (technique, params, name) in every_way() {
            if technique.info().samples.contains(&samples) {
                let found = outcome(stage, technique, &settings, &params, &reference);
                println!("{what}, {samples} samples, {lights} lights: {name}: {found:?}");
                if let Err(found) = found {
                    wrong.push(format!("{what}, {samples} samples, {lights} lights: {name}: {found}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// PSNR to the reference, in two frames, or why it is wrong.
fn outcome(
    stage: &Stage,
    technique: &dyn Technique,
    settings: &Settings,
    params: &Params,
    reference: &afterlight_image::Rgba8Image,
) -> Result<f64, String> {
    let mut prepared = stage.try_prepare(technique, settings, params).map_err(|e| e.to_string())?;
    let db = psnr(reference, &image_of(&mut prepared)).min(psnr(reference, &image_of(&mut prepared)));
    // Nothing that shows takes light.
    let least = least_db_of_four_lights(technique, params, settings.samples);
    if db >= least { Ok(db) } else { Err(format!("{db:.2} dB to forward")) }
}

#[test]
fn nothing() {
    let gpu = afterlight_testkit::gpu();
    all_agree(&Stage::of(&gpu, Scene::default()), "nothing", 0.0);
}

/// Surfaces that the techniques themselves do not draw.
#[test]
fn panes_alone() {
    let gpu = afterlight_testkit::gpu();
    let glass = || Material { base_color_factor: [1.0, 1.0, 1.0, 0.5], ..unlit(AlphaMode::Blend) };
    let panes = [(glass(), triangle(0.0, [255, 120, 30])), (glass(), triangle(0.5, [20, 90, 250]))];
    all_agree(&Stage::of(&gpu, scene_of(&panes, Vec3::Z * 3.0)), "panes", 0.05);
}

#[test]
fn one_triangle() {
    let gpu = afterlight_testkit::gpu();
    for alpha_mode in [AlphaMode::Opaque, AlphaMode::Mask { cutoff: 0.5 }] {
        let draws = [(unlit(alpha_mode), triangle(0.0, [250, 120, 30]))];
        let what = format!("one triangle, {alpha_mode:?}");
        all_agree(&Stage::of(&gpu, scene_of(&draws, Vec3::Z * 3.0)), &what, 0.05);
    }
}

/// One whose view none of the surfaces is in: draws there are, none is drawn.
#[test]
fn surfaces_out_of_view() {
    let gpu = afterlight_testkit::gpu();
    let scene = scene_of(&[(unlit(AlphaMode::Opaque), triangle(0.0, [250, 120, 30]))], Vec3::Z * 3.0);
    let away = afterlight_techniques::scene::Camera::look_at("away", Vec3::Z * 3.0, Vec3::Z * 9.0, 0.9, 0.1);
    let stage = Stage::of(&gpu, scene);
    let mut settings = stage.from(away, SIZE, 0);
    settings.environment.background_radiance = Vec3::new(0.2, 0.4, 0.1);
    for samples in [1, 4] {
        let settings = Settings { samples, ..settings.clone() };
        let reference = stage.image(find("forward").unwrap(), &settings);
        for (technique, params, name) in every_way() {
            if technique.info().samples.contains(&samples) {
                let found = outcome(&stage, technique, &settings, &params, &reference);
                assert!(found.is_ok(), "{samples} samples: {name}: {found:?}");
            }
        }
    }
}

/// A triangle that is not drawn is seen.
#[test]
fn a_missing_triangle_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::of(
        &gpu,
        scene_of(&[(unlit(AlphaMode::Opaque), triangle(0.0, [250, 120, 30]))], Vec3::Z * 3.0),
    );
    let empty = Stage::of(&gpu, Scene::default());
    let settings = stage.settings(SIZE, 0);
    let forward = find("forward").unwrap();
    let db = psnr(&stage.image(forward, &settings), &empty.image(forward, &settings));
    assert!(db < 40.0, "a mutant within the bound: {db:.2} dB");
}
