//! `light-prepass`: the parts of light that it sums make up the BRDF of `forward`, and sums beyond their format stay numbers.

mod common;

use afterlight_image::Rgba8Image;
use afterlight_renderer::Prepared;
use afterlight_techniques::{
    Params, Settings, find,
    scene::{self, Light, LightKind, Scene},
    shader::Shader,
};
use common::{
    Stage, compiled, compiled_with_header, image_of, lights_of_each_kind, psnr, radiance_of, source,
};
use glam::Vec3;

/// Least PSNR to `forward` of what the sums make up, dB: more than the technique's, since grazing light is little of an image.
const MIN_PSNR_DB: f64 = 60.0;

/// `light_prepass/FILE` with a part of its text replaced.
fn mutant(file: &str, from: &str, to: &str) -> Shader {
    let path = source(&format!("light_prepass/{file}.glsl"));
    compiled(&format!("light_prepass/{file}"), &path, &[], &[(from, to)])
}

fn prepared_with(stage: &Stage, settings: &Settings, shaders: Option<Shader>) -> Prepared {
    stage.prepare_shaders(find("light-prepass").unwrap(), settings, &Params::default(), shaders)
}

/// The technique's image with shaders in the place of its own.
fn image_with(stage: &Stage, settings: &Settings, shaders: Option<Shader>) -> Rgba8Image {
    image_of(&mut prepared_with(stage, settings, shaders))
}

/// Lights before and behind the surfaces, so that all parts of light are to be seen.
fn lights_all_round(stage: &Stage, settings: &Settings) -> Vec<Light> {
    let bounds = stage.scene.bounds_ws();
    let to_scene = (bounds.center() - settings.camera.eye_ws()).normalize();
    let before = bounds.center() + bounds.size() * Vec3::new(0.5, 0.7, 0.6);
    let behind = Light {
        kind: LightKind::Directional,
        position_ws: Vec3::ZERO,
        // Towards the eye and down: it grazes what faces up.
        direction_ws: (-to_scene - 0.2 * Vec3::Y).normalize(),
        intensity: Vec3::splat(4.0),
        range_m: f32::INFINITY,
    };
    let mut lights = lights_of_each_kind(stage, before, 1.0).to_vec();
    lights.push(behind);
    lights
}

/// Metals and others of every roughness. Every part is needed, grazing light once.
#[test]
fn three_sums_make_up_the_brdf() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:spheres?segments=48");
    let mut settings = stage.settings((320, 180), 0);
    settings.lights = lights_all_round(&stage, &settings);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let right = psnr(&reference, &image_with(&stage, &settings, None));
    println!("{right:.2} dB");
    assert!(right >= MIN_PSNR_DB, "{right:.2} dB to forward");
    for (from, to) in [
        ("irradiance * part.x", "vec3(0.0)"),
        ("irradiance * part.y", "vec3(0.0)"),
        ("irradiance * part.z", "vec3(0.0)"),
        // The part at normal incidence counts grazing light twice.
        ("irradiance * part.y", "irradiance * (part.y + part.z)"),
    ] {
        let mutant = mutant("light.frag", from, to);
        let db = psnr(&reference, &image_with(&stage, &settings, Some(mutant)));
        println!("{to} for {from}: {db:.2} dB");
        assert!(db < MIN_PSNR_DB - 5.0, "{to} for {from}: a mutant within the bound, {db:.2} dB");
    }
}

/// A red metal reflects nothing of green: zero times a sum beyond 16-bit floats.
fn red_metal() -> Scene {
    let mut scene = scene::load_source("builtin:sphere?segments=32", &Default::default())
        .unwrap_or_else(|e| panic!("{e}"));
    for material in &mut scene.materials {
        material.base_color_factor = [1.0, 0.0, 0.0, 1.0];
        material.metallic_factor = 1.0;
        material.roughness_factor = 0.1;
        (material.base_color_texture, material.metallic_roughness_texture) = (None, None);
    }
    scene
}

#[test]
fn sums_beyond_their_format_stay_numbers() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::of(&gpu, red_metal());
    let mut settings = Settings { keep_hdr: true, ..stage.settings((96, 54), 0) };
    let above = stage.scene.bounds_ws().center() + stage.scene.bounds_ws().size() * Vec3::new(0.5, 1.0, 1.5);
    // Beyond 32-bit floats in highlights: whether finite sums beyond 16 bits become infinite is the device's.
    settings.lights = lights_of_each_kind(&stage, above, 1e37).to_vec();
    let not_numbers = |shaders: Option<Shader>| {
        let radiance = radiance_of(&mut prepared_with(&stage, &settings, shaders));
        radiance.iter().flatten().filter(|c| c.is_nan()).count()
    };
    assert_eq!(not_numbers(None), 0);
    let unbounded = compiled_with_header(
        "light_prepass/material.frag",
        "light_prepass/sums.glsl",
        &[(
            "min(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb, vec3(65504.0))",
            "texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb",
        )],
    );
    assert!(not_numbers(Some(unbounded)) > 0, "no sum is beyond its format: the test shows nothing");
}
