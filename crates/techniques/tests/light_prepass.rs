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
    Stage, compiled, compiled_variant, image_of, least_db, lights_of_each_kind, params, psnr, radiance_of,
    random_views, source,
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
    let unbounded = compiled_variant(
        "light_prepass/material.frag",
        "light_prepass/sums.glsl",
        &[(
            "min(texelFetch(light, sums_pixel, 0).rgb, vec3(65504.0))",
            "texelFetch(light, sums_pixel, 0).rgb",
        )],
    );
    assert!(not_numbers(Some(unbounded)) > 0, "no sum is beyond its format: the test shows nothing");
}

/// Writes an image for the eye where `AFTERLIGHT_PREPASS_IMAGES` names a folder.
fn show(name: &str, image: &Rgba8Image) {
    let Ok(folder) = std::env::var("AFTERLIGHT_PREPASS_IMAGES") else { return };
    let file = std::path::Path::new(&folder).join(format!("{name}.png"));
    afterlight_image::write_png(&file, image).unwrap_or_else(|e| panic!("{e}"));
}

/// `light-prepass` at four samples with parameters and shaders in the place of its own.
fn multisampled(
    stage: &Stage,
    settings: &Settings,
    sets: &[(&str, &str)],
    shaders: Vec<Shader>,
) -> Rgba8Image {
    let technique = find("light-prepass").unwrap();
    image_of(&mut stage.prepare_shaders(technique, settings, &params(technique, sets), shaders))
}

/// `light_prepass/material.frag#alike` with a part of `alike.glsl` replaced.
fn alike_mutant(from: &str, to: &str) -> Shader {
    compiled_variant("light_prepass/material.frag#alike", "light_prepass/alike.glsl", &[(from, to)])
}

/// Pixels that one fragment covers: `deferred-msaa` shades them once, and no background shows in them.
fn whole_pixels(stage: &Stage, settings: &Settings, reference: &Rgba8Image) -> Vec<bool> {
    let edges = Settings { view: "edges".to_owned(), ..settings.clone() };
    let edges = stage.image(find("deferred-msaa").unwrap(), &edges);
    let mut other = settings.clone();
    other.environment.background_radiance += Vec3::ONE;
    let other = stage.image(find("forward").unwrap(), &other);
    let pixels = |image: &Rgba8Image| image.pixels.chunks_exact(4).map(<[u8]>::to_vec).collect::<Vec<_>>();
    let all = pixels(&edges).into_iter().zip(pixels(&other)).zip(pixels(reference));
    all.map(|((edge, other), reference)| edge[..3] == [0; 3] && other == reference).collect()
}

/// PSNR over some pixels, dB; none where there are few.
fn psnr_of(a: &Rgba8Image, b: &Rgba8Image, pixels: &[bool]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    let all = a.pixels.chunks_exact(4).zip(b.pixels.chunks_exact(4)).zip(pixels);
    for ((a, b), _) in all.filter(|(_, counts)| **counts) {
        sum += (0..3).map(|i| (f64::from(a[i]) - f64::from(b[i])).powi(2)).sum::<f64>();
        count += 3;
    }
    (count > 300).then(|| 10.0 * (255.0 * 255.0 * f64::from(count) / sum).log10())
}

/// At several samples a pixel that one fragment covers is as at one sample; edges take light that was gathered for the surface most like them,
/// within the bounds that are told.
#[test]
fn edges_take_the_light_of_similar_surfaces() {
    let gpu = afterlight_testkit::gpu();
    let technique = find("light-prepass").unwrap();
    for (scene, size, lights) in [
        ("builtin:spheres?segments=24", (160, 90), 20),
        ("builtin:colonnade?triangles=30000", (160, 90), 100),
        ("builtin:colonnade?triangles=30000", (320, 180), 100),
        ("builtin:intersect", (161, 91), 20),
    ] {
        let stage = Stage::new(&gpu, scene);
        let settings = Settings { samples: 4, ..stage.settings(size, lights) };
        let reference = stage.image(find("forward").unwrap(), &settings);
        show("forward", &reference);
        let whole = whole_pixels(&stage, &settings, &reference);
        let mut found = Vec::new();
        for set in [[("edge-light", "alike")], [("edge-light", "pixel")]] {
            let image = multisampled(&stage, &settings, &set, Vec::new());
            show(set[0].1, &image);
            let (db, inside) = (psnr(&reference, &image), psnr_of(&reference, &image, &whole));
            println!("{scene} {size:?}: {set:?}: {db:.2} dB, {inside:.2?} where no edge is");
            let least = least_db(technique, &params(technique, &set), 4);
            assert!(db >= least, "{scene} {size:?}: {set:?}: {db:.2} dB, {least} promised");
            // Few pixels of the spheres hold one triangle alone. A triangle may cover a centre and no sample: its pixel's own light is another's.
            let asked = !scene.starts_with("builtin:spheres") && set[0].1 == "alike";
            assert!(
                !asked || inside.is_some_and(|db| db >= 50.0),
                "{scene} {size:?}: {set:?}: {inside:.2?} dB where no edge is"
            );
            found.push(db);
        }
        assert!(
            found[0] > found[1] + 2.0,
            "{scene} {size:?}: nothing is gained by similar surfaces: {found:?}"
        );
    }
}

/// Parts of what makes surfaces alike, each left out.
#[test]
fn what_makes_surfaces_alike_is_needed() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = Settings { samples: 4, ..stage.settings((160, 90), 100) };
    let reference = stage.image(find("forward").unwrap(), &settings);
    let right = psnr(&reference, &multisampled(&stage, &settings, &[], Vec::new()));
    for (from, to) in [
        ("off_m / plane.pixel_m +", ""),
        ("NORMAL_WEIGHT * (1.0 - dot(normal, s.normal_ws))", "0.0"),
        ("best = to_pixel", "best = -to_pixel"),
    ] {
        let db = psnr(&reference, &multisampled(&stage, &settings, &[], vec![alike_mutant(from, to)]));
        println!("{to:?} for {from:?}: {db:.2} dB, {right:.2} with it");
        assert!(db < right - 0.3, "{to:?} for {from:?}: {db:.2} dB, {right:.2} with it: not needed");
    }
}

/// Views that nobody chose.
#[test]
fn random_views_stay_within_what_is_promised() {
    let technique = find("light-prepass").unwrap();
    random_views(45, |stage, settings, reference, what| {
        for set in [[("edge-light", "alike")], [("edge-light", "pixel")]] {
            let db = psnr(reference, &multisampled(stage, settings, &set, Vec::new()));
            println!("{what}: {set:?}: {db:.2} dB");
            let least = least_db(technique, &params(technique, &set), 4);
            assert!(db >= least, "{what}: {set:?}: {db:.2} dB, {least} promised");
            // These views measure 29.4 and 25.0 at worst; what is promised holds from others as well.
            let (_, edge_light) = set[0];
            let floor = if edge_light == "alike" { 28.0 } else { 24.0 };
            assert!(db >= floor, "{what}: {set:?}: {db:.2} dB, {floor} measured before");
        }
    });
}
