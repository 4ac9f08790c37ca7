//! Tessellated surfaces: subdivision changes nothing, triangles shrink with the edges asked for, no crack opens, passes that
//! share depths agree.

mod common;

use afterlight_techniques::{
    Settings, Technique, TechniqueError, find,
    geometry::MAX_DISPLACEMENT_M,
    graph::gpu,
    registry,
    scene::{Camera, Scene},
    shader::{Shader, compile::Compiler, manifest},
};
use common::{Stage, image_of, psnr};
use glam::{Affine3A, Quat, Vec3};

/// Least PSNR of what must be one image, dB (contract: each full-rate variant to `deferred-dedup`).
const MIN_PSNR_DB: f64 = 45.0;

/// Techniques that draw tessellated surfaces, each with the least sample count that it has.
fn tessellating() -> impl Iterator<Item = (&'static dyn Technique, u32)> {
    let least = |t: &dyn Technique| if t.info().samples.contains(&1) { 1 } else { 4 };
    registry().iter().filter(|t| t.info().tessellation).map(move |t| (*t, least(*t)))
}

/// Settings at a technique's sample count, tessellated.
fn tessellated(settings: &Settings, samples: u32, edge_px: f32, displacement_m: f32) -> Settings {
    Settings { samples, tessellate_px: Some(edge_px), displacement_m, ..settings.clone() }
}

/// Whether the device has what tessellation takes, besides what all need.
fn can(device: &gpu::Device) -> bool {
    let f = device.features();
    let there = f.tessellation_shader && f.geometry_shader && f.vertex_stores_and_atomics;
    if !there {
        println!("skipped: {} has no tessellation", device.info().name);
    }
    there
}

/// Flat triangles in parts are the same triangles; displaced they are not.
#[test]
fn subdivision_changes_nothing() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    for source in ["builtin:colonnade?triangles=30000", "builtin:spheres?segments=32"] {
        let stage = Stage::new(&gpu, source);
        let settings = stage.settings((160, 90), 20);
        for (technique, samples) in tessellating() {
            let plain = stage.image(technique, &Settings { samples, ..settings.clone() });
            let flat = stage.image(technique, &tessellated(&settings, samples, 8.0, 0.0));
            let db = psnr(&plain, &flat);
            println!("{source}: {} at {samples}: {db:.2} dB", technique.info().id);
            assert!(db >= MIN_PSNR_DB, "{source}: {}: {db:.2} dB to no tessellation", technique.info().id);
        }
        let forward = find("forward").unwrap();
        let plain = stage.image(forward, &settings);
        let db = psnr(&plain, &stage.image(forward, &tessellated(&settings, 1, 8.0, 0.03)));
        assert!(db < MIN_PSNR_DB - 5.0, "{source}: displacement is not to be seen: {db:.2} dB");
    }
}

/// All techniques draw one displaced surface; a pass with an equal depth test meets the depths of the pass before exactly.
#[test]
fn techniques_agree_on_displaced_surfaces() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let settings = stage.settings((160, 90), 20);
    for samples in [1, 4] {
        let settings = tessellated(&settings, samples, 4.0, 0.05);
        let reference = stage.image(find("forward").unwrap(), &settings);
        for technique in registry().iter().filter(|t| t.info().tessellation) {
            let info = technique.info();
            if !info.samples.contains(&samples) {
                continue;
            }
            let image = stage.image(*technique, &settings);
            let db = psnr(&reference, &image);
            println!("{samples} samples: {}: {db:.2} dB", info.id);
            // At several samples the bound is the contract's for techniques that shade after rasterisation.
            let least = if samples == 1 { MIN_PSNR_DB } else { 40.0 };
            assert!(db >= least, "{samples} samples: {}: {db:.2} dB to forward", info.id);
            if info.id == "depth-prepass" {
                assert_eq!(reference.pixels, image.pixels, "{samples} samples: depths differ between passes");
            }
        }
    }
}

/// `deferred-dedup` shades each triangle of a pixel once, not each patch: more of them, more evaluations.
#[test]
fn triangles_are_told_apart_not_patches() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    let stage = Stage::new(&gpu, "builtin:sphere?segments=12");
    let dedup = find("deferred-dedup").unwrap();
    let plain = Settings { samples: 4, view: "invocations".to_owned(), ..stage.settings((160, 90), 0) };
    let before = stage.image(dedup, &plain);
    let [coarse, fine] = [64.0, 2.0].map(|px| {
        let image = stage.image(dedup, &tessellated(&plain, 4, px, 0.0));
        before.pixels.chunks_exact(4).zip(image.pixels.chunks_exact(4)).filter(|(a, b)| a != b).count()
    });
    println!("pixels with other counts: {coarse} where patches stay whole, {fine} at 2 px");
    assert!(coarse < 100 && fine > 2000, "{coarse} pixels where patches stay whole, {fine} at 2 px");
}

/// What cannot draw tessellated surfaces says so, and what asks for displacement alone, or too much, is told.
#[test]
fn what_cannot_says_so() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    let stage = Stage::new(&gpu, "builtin:edge");
    let settings = stage.settings((32, 18), 0);
    let refused = |technique: &dyn Technique, settings: &Settings| {
        stage.try_prepare(technique, settings, &Default::default()).err().expect("refused")
    };
    for technique in registry().iter().filter(|t| !t.info().tessellation) {
        let samples = if technique.info().samples.contains(&1) { 1 } else { 4 };
        let error = refused(*technique, &tessellated(&settings, samples, 8.0, 0.0));
        assert!(matches!(error, TechniqueError::Untessellated { .. }), "{error}");
    }
    let forward = find("forward").unwrap();
    for wrong in [
        Settings { displacement_m: 0.01, ..settings.clone() },
        tessellated(&settings, 1, 8.0, 2.0 * MAX_DISPLACEMENT_M),
        tessellated(&settings, 1, 8.0, f32::NAN),
        tessellated(&settings, 1, 0.0, 0.0),
        tessellated(&settings, 1, f32::NAN, 0.0),
    ] {
        let error = refused(forward, &wrong);
        assert!(matches!(error, TechniqueError::Conflict { .. }), "{error}");
    }
}

/// A closed box of two triangles a side that faces inward, its sides' normals apart at every edge; black, before a background that is not.
fn room(turn: Quat) -> Scene {
    let file = std::env::temp_dir().join(format!("afterlight-room-{}.obj", std::process::id()));
    let mut text = String::new();
    for i in 0..8 {
        let corner = |bit: i32| if i & bit == 0 { -1.0 } else { 1.0 };
        text += &format!("v {} {} {}\n", corner(1), corner(2), corner(4));
    }
    // Corners counter-clockwise as the middle of the room sees them.
    for side in [[1, 2, 4, 3], [5, 7, 8, 6], [1, 5, 6, 2], [3, 4, 8, 7], [1, 3, 7, 5], [2, 6, 8, 4]] {
        let [a, b, c, d] = side;
        text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    std::fs::write(&file, text).expect("a file in the temporary folder");
    let loaded = afterlight_techniques::scene::load_source(&file.to_string_lossy(), &Default::default());
    std::fs::remove_file(&file).expect("the file");
    let mut scene = loaded.unwrap_or_else(|e| panic!("{e}"));
    for instance in &mut scene.instances {
        instance.world_from_object = Affine3A::from_quat(turn) * instance.world_from_object;
    }
    before_white(scene)
}

/// A smooth closed surface seen from inside.
fn ball() -> Scene {
    let source = "builtin:sphere?segments=7";
    let scene = afterlight_techniques::scene::load_source(source, &Default::default());
    let mut scene = scene.unwrap_or_else(|e| panic!("{e}"));
    scene.materials.iter_mut().for_each(|material| material.double_sided = true);
    before_white(scene)
}

/// Black surfaces, white background.
fn before_white(mut scene: Scene) -> Scene {
    for material in &mut scene.materials {
        (material.unlit, material.base_color_factor) = (true, [0.0, 0.0, 0.0, 1.0]);
        material.base_color_texture = None;
    }
    scene.environment.background_radiance = Vec3::ONE;
    scene
}

/// A turn that leaves no coordinate a round number.
fn turn() -> Quat {
    Quat::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
}

/// Views from inside a closed surface, towards corners and sides.
fn inside_views(stage: &Stage) -> Vec<Settings> {
    let targets = [Vec3::new(1.0, 0.9, 1.1), Vec3::new(-1.0, 0.2, 0.3), Vec3::new(0.1, -1.0, -0.4)];
    let eye = Vec3::new(0.11, -0.07, 0.05);
    let view = |target| stage.from(Camera::look_at("inside", eye, target, 1.9, 0.01), (320, 180), 0);
    targets.map(view).to_vec()
}

fn white_pixels(pixels: &[u8]) -> usize {
    pixels.chunks_exact(4).filter(|p| p[..3] != [0, 0, 0]).count()
}

/// From inside a closed surface no background shows, hard edges or not, displaced or not, at one sample or four.
#[test]
fn no_crack_opens() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    for (what, scene) in [("room", room(turn())), ("ball", ball())] {
        let stage = Stage::of(&gpu, scene);
        for (view, settings) in inside_views(&stage).iter().enumerate() {
            for (edge_px, displacement_m) in
                [(64.0, 0.0), (7.0, 0.0), (13.0, 0.03), (3.0, MAX_DISPLACEMENT_M)]
            {
                for technique in ["forward", "deferred-dedup"].map(|id| find(id).unwrap()) {
                    let settings = tessellated(settings, 4, edge_px, displacement_m);
                    let image = stage.image(technique, &settings);
                    let found = white_pixels(&image.pixels);
                    assert_eq!(
                        found,
                        0,
                        "{what}, view {view}, {}: {edge_px} px, {displacement_m} m: background through cracks",
                        technique.info().id
                    );
                }
            }
        }
    }
}

/// A stage of tessellation with a part of its text replaced.
fn mutant(file: &str, tag: &str, defines: &[&str], from: &str, to: &str) -> Shader {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/geometry");
    let text = std::fs::read_to_string(folder.join(file)).expect("a shader");
    assert!(text.contains(from), "{file} has changed: found no {from:?}");
    let path = std::env::temp_dir().join(format!("afterlight-{}-{file}", std::process::id()));
    std::fs::write(&path, text.replace(from, to)).expect("a file in the temporary folder");
    let variant = manifest::Variant {
        name: format!("geometry/{}{tag}", file.trim_end_matches(".glsl")),
        stage: manifest::stage_of(file).expect("a stage"),
        path: path.clone(),
        folder,
        defines: defines.iter().map(|d| ((*d).to_owned(), None)).collect(),
    };
    let compiled = Compiler::new().compile(&variant).unwrap_or_else(|e| panic!("{e}"));
    std::fs::remove_file(&path).expect("the file");
    compiled.shader
}

/// Cracks are seen where there are some: displacement along normals parts the sides of the room, edges divided by what is
/// inside of them part neighbours of different size.
#[test]
fn cracks_are_caught() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    let along_normals = mutant(
        "surface.tese.glsl",
        "",
        &[],
        "world = displaced(world, DISPLACEMENT_M, columns);",
        "world -= DISPLACEMENT_M * normalize(AT_POINT(patch_normal_ws));",
    );
    let by_triangle = mutant(
        "surface.tesc.glsl",
        "",
        &[],
        "gl_TessLevelOuter[0] = edges.x;",
        "gl_TessLevelOuter[0] = ceil(0.4 * (edges.y + edges.z));",
    );
    for (shader, scene) in [(along_normals, room(turn())), (by_triangle, ball())] {
        let stage = Stage::of(&gpu, scene);
        let seen: usize = inside_views(&stage)
            .iter()
            .map(|settings| {
                let settings = tessellated(settings, 1, 7.0, 0.05);
                let renderer =
                    afterlight_techniques::Renderer::with_scene(&gpu, stage.uploaded.clone(), &settings);
                let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
                renderer.add_shaders([shader.clone()]);
                let prepared = renderer.prepare(find("forward").unwrap(), &Default::default());
                white_pixels(&image_of(&mut prepared.unwrap_or_else(|e| panic!("{e}"))).pixels)
            })
            .sum();
        println!("{}: {seen} pixels of background", shader.name);
        assert!(seen > 0, "{}: no crack is seen", shader.name);
    }
}

/// Triangles of the pass `forward/shade` that reached clipping.
fn triangles(stage: &Stage, settings: &Settings) -> u64 {
    let mut prepared = stage.prepare(find("forward").unwrap(), settings);
    let report = prepared.run().unwrap_or_else(|e| panic!("{e}"));
    report.pass("forward/shade").and_then(|pass| pass.statistics).expect("statistics").clipping_invocations
}

/// The shorter the edges, the more triangles, each of about the size asked for; what is not seen makes none.
#[test]
fn triangles_have_the_size_asked_for() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    // A side of the room face on: 2 m wide, 1 m away, 180 pixels high where 0.5 m are in view; the other sides are not.
    let stage = Stage::of(&gpu, room(Quat::IDENTITY));
    let camera = Camera::look_at("side", Vec3::ZERO, Vec3::NEG_Z, 2.0 * 0.25f32.atan(), 0.01);
    let settings = stage.from(camera, (320, 180), 0);
    let side_px = 2.0 * 180.0 / 0.5;
    let mut fewer = 0;
    for edge_px in [64.0, 32.0, 16.0] {
        let found = triangles(&stage, &tessellated(&settings, 1, edge_px, 0.0));
        // Two triangles a square of that edge would be n² a patch of n segments; the hardware's rings make 1.5 n², diagonals
        // are longer, segments whole: 1.5 × 1.14² and more.
        let expected = 2.0 * (side_px / f64::from(edge_px)).powi(2);
        let ratio = found as f64 / expected;
        println!("{edge_px} px: {found} triangles, {ratio:.2} of two a square");
        assert!((1.8..2.5).contains(&ratio), "{edge_px} px: {found} triangles, expected about {expected:.0}");
        assert!(found > 3 * fewer, "{edge_px} px: {found} triangles, {fewer} before");
        fewer = found;
    }

    let stage = Stage::new(&gpu, "builtin:sphere?segments=16");
    let away = Camera::look_at("away", Vec3::new(0.0, 0.0, 5.0), Vec3::new(0.0, 0.0, 10.0), 1.0, 0.1);
    let forward = find("forward").unwrap();
    let mut none = afterlight_techniques::Params::default();
    none.set(forward.info(), "cull", "none").unwrap_or_else(|e| panic!("{e}"));
    let settings = tessellated(&stage.from(away, (64, 36), 0), 1, 1.0, MAX_DISPLACEMENT_M);
    let report = stage.prepare_with(forward, &settings, &none).run().unwrap_or_else(|e| panic!("{e}"));
    let statistics = report.pass("forward/shade").and_then(|pass| pass.statistics).expect("statistics");
    assert!(statistics.input_primitives > 0, "{statistics:?}");
    assert_eq!(statistics.clipping_invocations, 0, "patches out of view are divided");
}
