//! `hybrid`: whichever path draws take, the image is one.

mod common;

use afterlight_image::Rgba8Image;
use afterlight_techniques::{
    Indirect, Settings, Shadows, find, params_of,
    scene::{self, Scene},
    shader::Shader,
};
use common::{Stage, compiled, image_of, params, psnr, source};

/// Least PSNR to `forward`, dB.
const MIN_PSNR_DB: f64 = 50.0;

/// The technique's image, and the share of vertices that is drawn again.
fn rendered(
    stage: &Stage,
    settings: &Settings,
    sets: &[(&str, &str)],
    shader: Option<Shader>,
) -> (Rgba8Image, f64) {
    let technique = find("hybrid").expect("there");
    let mut prepared = stage.prepare_shaders(technique, settings, &params(technique, sets), shader);
    let report = prepared.run_counted().unwrap_or_else(|e| panic!("{e}"));
    let vertices = |pass: &str| {
        let pass = report.passes.iter().find(|p| p.name == pass).expect("a pass");
        pass.statistics.expect("statistics").vertex_invocations as f64
    };
    let share = vertices("hybrid/materials") / vertices("hybrid/gbuffer");
    (image_of(&mut prepared), share)
}

/// Both paths alone, and mixed by several weights, against `forward`.
#[test]
fn every_mixture_is_one_image() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    for lights in [1, 100] {
        let settings = stage.settings((160, 90), lights);
        let reference = stage.image(find("forward").unwrap(), &settings);
        let mut mixed = 0;
        for sets in [
            &[][..],
            &[("path", "deferred")],
            &[("path", "prepass")],
            &[("prepass-weight", "0.85")],
            &[("prepass-weight", "0.7")],
            &[("prepass-weight", "0.5")],
            &[("prepass-weight", "0")],
            &[("order", "scene")],
            &[("order", "scene"), ("prepass-weight", "0.7")],
        ] {
            let (image, share) = rendered(&stage, &settings, sets, None);
            let db = psnr(&reference, &image);
            println!("{lights} lights, {sets:?}: {db:.2} dB, {share:.2} of the vertices again");
            assert!(db >= MIN_PSNR_DB, "{lights} lights, {sets:?}: {db:.2} dB to forward");
            match sets {
                [("path", "deferred")] => assert!(share < 0.01, "{sets:?}: {share}"),
                [("path", "prepass") | ("prepass-weight", "0")] => assert!(share > 0.99, "{sets:?}: {share}"),
                _ => mixed += u32::from(share > 0.05 && share < 0.95),
            }
        }
        assert!(mixed >= 2, "{mixed} settings mix the paths: the test shows little");
    }
}

/// What is drawn before the technique's passes leaves its draws alone.
#[test]
fn under_shadows_and_indirect_light() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 0).with_effects(|effects| {
        effects.shadows.method = Shadows::Map;
        effects.indirect.method = Indirect::Rsm;
    });
    let reference = stage.image(find("forward").unwrap(), &settings);
    for weight in ["0.5", "1"] {
        let (image, share) = rendered(&stage, &settings, &[("prepass-weight", weight)], None);
        let db = psnr(&reference, &image);
        println!("weight {weight}: {db:.2} dB, {share:.2} of the vertices again");
        assert!(db >= MIN_PSNR_DB && share > 0.01, "weight {weight}: {db:.2} dB, {share:.2} again");
    }
}

/// Colours of either path that are not applied, or twice, are seen.
#[test]
fn colors_of_both_paths_are_needed() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 100);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let sets = [("prepass-weight", "0.7")];
    for (file, from, to) in [
        ("hybrid/compose.frag", "gathered_radiance(s)", "vec3(0.0)"),
        ("light_prepass/material.frag", "gathered_radiance(s)", "vec3(0.0)"),
        ("light_prepass/material.frag", "gathered_radiance(s)", "2.0 * gathered_radiance(s)"),
    ] {
        let shader = compiled(file, &source(&format!("{file}.glsl")), &[], &[(from, to)]);
        let db = psnr(&reference, &rendered(&stage, &settings, &sets, Some(shader)).0);
        println!("{file}: {to}: {db:.2} dB");
        assert!(db < 45.0, "{file}: {to}: a mutant within the bound, {db:.2} dB");
    }
}

/// Every mesh twice at one place, once in another colour and with fewer textures, so that another path may be predicted for it:
/// of equal depths the first drawn is seen, on both paths and where they meet.
fn doubled(other_color_first: bool) -> Scene {
    let mut scene = scene::load_source("builtin:colonnade?triangles=17000&texture=64", &Default::default())
        .unwrap_or_else(|e| panic!("{e}"));
    let (meshes, materials) = (scene.meshes.len() as u32, scene.materials.len() as u32);
    for mesh in scene.meshes.clone() {
        scene.meshes.push(scene::Mesh { material: mesh.material + materials, ..mesh });
    }
    for material in scene.materials.clone() {
        scene.materials.push(scene::Material {
            base_color_factor: [1.0, 0.1, 0.1, 1.0],
            normal_texture: None,
            ..material
        });
    }
    let once = scene.instances.clone();
    let others = once.iter().map(|i| scene::Instance { mesh: i.mesh + meshes, ..i.clone() });
    scene.instances = match other_color_first {
        true => others.chain(once.iter().cloned()).collect(),
        false => once.iter().cloned().chain(others).collect(),
    };
    scene
}

#[test]
fn of_equal_depths_the_first_drawn_is_seen() {
    let gpu = afterlight_testkit::gpu();
    let [stage, other] = [false, true].map(|other_first| Stage::of(&gpu, doubled(other_first)));
    let settings = stage.settings((160, 90), 20);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let db = psnr(&reference, &other.image(find("forward").unwrap(), &settings));
    assert!(db < 30.0, "the order of draws is not to be seen: {db:.2} dB");
    for stage in [&stage, &other] {
        let reference = stage.image(find("forward").unwrap(), &settings);
        for weight in ["0", "0.6", "0.7", "0.8", "1"] {
            let (image, share) = rendered(stage, &settings, &[("prepass-weight", weight)], None);
            let db = psnr(&reference, &image);
            println!("weight {weight}: {db:.2} dB, {share:.2} of the vertices again");
            assert!(db >= MIN_PSNR_DB, "weight {weight}: {db:.2} dB to forward");
        }
    }
}

#[test]
fn parameters_out_of_range_are_refused() {
    let hybrid = find("hybrid").unwrap();
    for (key, value) in [("path", "forward"), ("prepass-weight", "-1"), ("prepass-weight", "NaN")] {
        assert!(params_of(hybrid).set(key, value).is_err(), "{key}={value}");
    }
}
