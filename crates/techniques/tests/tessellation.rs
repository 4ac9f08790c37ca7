//! Tessellated surfaces: subdivision changes nothing, triangles shrink with the edges asked for, no crack opens, passes that
//! share depths agree.

mod common;

use afterlight_frame::MAX_DISPLACEMENT_MM;
use afterlight_image::Rgba8Image;
use afterlight_techniques::{
    Exactness, Indirect, Params, Settings, Technique, TechniqueError, exactness_of, find,
    graph::gpu,
    registry,
    scene::{Camera, Scene},
    shader::Shader,
};
use common::{Stage, compiled, image_of, params, psnr, source};
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
    Settings { samples, ..settings.clone() }.with_effects(|effects| {
        effects.tessellation.edge_px = Some(edge_px);
        effects.tessellation.displacement_mm = 1e3 * displacement_m;
    })
}

/// Whether the device has what tessellation takes, besides what all need.
fn can(device: &gpu::Device) -> bool {
    afterlight_testkit::has_tessellation(device)
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
            let least = match exactness_of(*technique, &Params::default(), samples) {
                // Lights are left out.
                Exactness::Approximate { min_psnr_db, .. } if min_psnr_db < 40.0 => min_psnr_db,
                _ if samples == 1 => MIN_PSNR_DB,
                _ => 40.0,
            };
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
    let dais = find("dais").unwrap();
    for (key, value) in [("fill", "resolve"), ("visibility", "compute")] {
        let settings = tessellated(&settings, 1, 8.0, 0.0);
        let params = params(dais, &[(key, value)]);
        let error = stage.try_prepare(dais, &settings, &params).err().expect("refused");
        assert!(matches!(error, TechniqueError::Conflict { .. }), "{error}");
        println!("{error}");
    }
    let forward = find("forward").unwrap();
    for wrong in [
        settings.clone().with_effects(|effects| effects.tessellation.displacement_mm = 1e3 * 0.01),
        tessellated(&settings, 1, 8.0, 2e-3 * MAX_DISPLACEMENT_MM),
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
                [(64.0, 0.0), (7.0, 0.0), (13.0, 0.03), (3.0, 1e-3 * MAX_DISPLACEMENT_MM)]
            {
                for technique in
                    ["forward", "deferred-dedup", "dais", "dais-list"].map(|id| find(id).unwrap())
                {
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

/// A technique's image with one shader replaced.
fn image_with(
    stage: &Stage,
    technique: &dyn Technique,
    settings: &Settings,
    sets: &[(&str, &str)],
    shader: &Shader,
) -> Rgba8Image {
    let params = params(technique, sets);
    image_of(&mut stage.prepare_shaders(technique, settings, &params, [shader.clone()]))
}

/// A variant of the shader in a file with a part of its text replaced.
fn mutant(file: &str, tag: &str, defines: &[&str], from: &str, to: &str) -> Shader {
    let name = format!("{}{tag}", file.trim_end_matches(".glsl"));
    compiled(&name, &source(file), defines, &[(from, to)])
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
        "surfaces/geometry/surface.tese.glsl",
        "",
        &[],
        "world = displaced(world, DISPLACEMENT_M, columns);",
        "world -= DISPLACEMENT_M * normalize(AT_POINT(patch_normal_ws));",
    );
    let by_triangle = mutant(
        "surfaces/geometry/surface.tesc.glsl",
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
                let forward = find("forward").unwrap();
                white_pixels(&image_with(&stage, forward, &settings, &[], &shader).pixels)
            })
            .sum();
        println!("{}: {seen} pixels of background", shader.name);
        assert!(seen > 0, "{}: no crack is seen", shader.name);
    }
}

/// Triangles of the pass `forward/shade` that reached clipping.
fn triangles(stage: &Stage, settings: &Settings) -> u64 {
    let mut prepared = stage.prepare(find("forward").unwrap(), settings);
    let report = prepared.run_counted().unwrap_or_else(|e| panic!("{e}"));
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
    let none = params(forward, &[("cull", "none")]);
    let settings = tessellated(&stage.from(away, (64, 36), 0), 1, 1.0, 1e-3 * MAX_DISPLACEMENT_MM);
    let report =
        stage.prepare_with(forward, &settings, &none).run_counted().unwrap_or_else(|e| panic!("{e}"));
    let statistics = report.pass("forward/shade").and_then(|pass| pass.statistics).expect("statistics");
    assert!(statistics.input_primitives > 0, "{statistics:?}");
    assert_eq!(statistics.clipping_invocations, 0, "patches out of view are divided");
}

/// The colonnade, masked surfaces among others, with colours at its vertices and base colours read at second texture
/// coordinates.
fn colored() -> Scene {
    let source = "builtin:colonnade?triangles=30000&texture=64";
    let mut scene = afterlight_techniques::scene::load_source(source, &Default::default())
        .unwrap_or_else(|e| panic!("{e}"));
    // Smooth: at the pixel's centre, perhaps outside of the triangle, no colour leaves the range of a G-buffer.
    for (attributes, p) in scene.attributes.iter_mut().zip(&scene.positions_os) {
        let [r, g, b] = p.map(|x| (150.0 + 80.0 * (3.0 * x).sin()) as u8);
        attributes.color_rgba8 = u32::from_le_bytes([r, g, b, 255]);
        let [u, v] = attributes.uv0.map(f32::from_bits);
        attributes.uv1 = [(0.7 * v + 0.1).to_bits(), (1.3 * u - 0.2).to_bits()];
    }
    for texture in scene.materials.iter_mut().filter_map(|m| m.base_color_texture.as_mut()) {
        texture.uv_set = 1;
    }
    scene
}

/// Ways in which fragments store tessellated triangles: layouts of references, a cache of one lock, lists.
const WAYS: &[(&str, &[(&str, &str)])] = &[
    ("dais", &[]),
    ("dais", &[("lights", "clusters"), ("cache-buckets", "1"), ("reference-bits", "8")]),
    ("dais-list", &[]),
    ("dais-list", &[("lights", "clusters"), ("cache-buckets", "1")]),
];

/// Scenes and views in which tessellated triangles are stored: masked surfaces, attributes that few scenes have, surfaces that the
/// near plane cuts where they show.
fn stored_views(gpu: &gpu::Device) -> Vec<(&'static str, Stage, Settings)> {
    let colonnade = Stage::new(gpu, "builtin:colonnade?triangles=30000");
    let colonnade_view = colonnade.settings((160, 90), 20);
    let colored = Stage::of(gpu, colored());
    let colored_view = colored.settings((160, 90), 20);
    let mut ball = ball();
    ball.materials.iter_mut().for_each(|m| (m.unlit, m.base_color_factor) = (false, [0.8, 0.5, 0.3, 1.0]));
    let ball = Stage::of(gpu, ball);
    let eye = Vec3::new(0.11, -0.07, 0.05);
    let cut = Camera::look_at("cut", eye, Vec3::new(1.0, 0.9, 1.1), 1.9, 0.6);
    let ball_view = ball.from(cut, (160, 90), 20);
    vec![
        ("colonnade", colonnade, colonnade_view),
        ("colours", colored, colored_view),
        ("near plane", ball, ball_view),
    ]
}

/// Triangles that fragments store are the surfaces that `deferred-dedup` and `forward` see, however fragments race.
#[test]
fn stored_triangles_equal_the_deduplicated_samples() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    for (what, stage, view) in stored_views(&gpu) {
        for (samples, edge_px, displacement_m) in [(1, 4.0, 0.05), (4, 6.0, 0.0), (4, 32.0, 0.1)] {
            let settings = tessellated(&view, samples, edge_px, displacement_m);
            let forward = stage.image(find("forward").unwrap(), &settings);
            let dedup = (samples > 1).then(|| stage.image(find("deferred-dedup").unwrap(), &settings));
            for (id, sets) in WAYS {
                let technique = find(id).unwrap();
                if !technique.info().samples.contains(&samples) {
                    continue;
                }
                let mut prepared = stage.prepare_with(technique, &settings, &params(technique, sets));
                for run in 0..2 {
                    let image = image_of(&mut prepared);
                    let to_forward = psnr(&forward, &image);
                    let to_dedup = dedup.as_ref().map_or(f64::INFINITY, |dedup| psnr(dedup, &image));
                    let name = format!(
                        "{what}, {samples} samples, {edge_px} px, {displacement_m} m: {id} {sets:?} run {run}"
                    );
                    println!("{name}: {to_dedup:.2} dB to deferred-dedup, {to_forward:.2} to forward");
                    assert!(to_dedup >= MIN_PSNR_DB, "{name}: {to_dedup:.2} dB to deferred-dedup");
                    assert!(to_forward >= 40.0, "{name}: {to_forward:.2} dB to forward");
                }
            }
        }
    }
}

/// Tessellated triangles share indirect light as others do.
#[test]
fn tessellated_triangles_share_indirect_light() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    for samples in [1, 4] {
        let plain = tessellated(&stage.settings((97, 55), 0), samples, 12.0, 0.05);
        let settings = plain.clone().with_effects(|effects| {
            effects.shadows.map_size_px = 256;
            effects.indirect.method = Indirect::Rsm;
        });
        let [dais, multirate] = ["dais", "dais-multirate"].map(|id| find(id).unwrap());
        let full = stage.image(dais, &settings);
        let without = psnr(&full, &stage.image(dais, &plain));
        for bits in ["24", "8"] {
            let params = params(multirate, &[("reference-bits", bits)]);
            let db = psnr(&full, &image_of(&mut stage.prepare_with(multirate, &settings, &params)));
            println!(
                "{samples} samples, {bits} bits: {db:.2} dB to full rate; {without:.2} without indirect light"
            );
            assert!(db >= 40.0, "{samples} samples, {bits} bits: {db:.2} dB to full rate");
            assert!(without < 40.0, "indirect light is not to be seen: {without:.2} dB");
        }
    }
}

/// What is stored wrongly is seen: vertices in another order than their attributes, a vertex's normal in place of another's,
/// lengths of normals left out, sides mixed up, second coordinates and colours of one vertex for all.
#[test]
fn wrongly_stored_triangles_are_caught() {
    let gpu = afterlight_testkit::gpu();
    if !can(&gpu) {
        return;
    }
    let whole =
        |from, to| mutant("surfaces/geometry/number.geom.glsl", "#whole", &["WHOLE_TRIANGLE"], from, to);
    let read = |from, to| {
        let defines = ["LISTED", "WHOLE_TRIANGLE"];
        mutant("surfaces/triangles/derivatives.comp.glsl", "#vertices", &defines, from, to)
    };
    let mutants = [
        ("colonnade", "order", whole("= in_position_ws[k]", "= in_position_ws[(k + 1) % 3]")),
        (
            "colonnade",
            "normal",
            whole("packed_normals(in_normal_ws[0], ", "packed_normals(in_normal_ws[1], "),
        ),
        (
            "colonnade",
            "lengths",
            read(
                "triangle_buffer[record + NORMAL_LENGTHS_WORD] = triangle_buffer[record + 19u];",
                "triangle_buffer[record + NORMAL_LENGTHS_WORD] = 0x3fffffffu;",
            ),
        ),
        (
            "colonnade",
            "tangents",
            whole(
                "packed_tangent(in_tangent_ws[k], longest)",
                "packed_tangent(in_tangent_ws[(k + 1) % 3], 0.2)",
            ),
        ),
        ("colonnade", "side", read("& RECORD_FRONT) == 0u", "& RECORD_FRONT) != 0u")),
        ("colours", "second coordinates", read("stored_uv(record + UV1_WORD)", "stored_uv(record + 12u)")),
        ("colours", "colour", whole("= in_color[k]", "= in_color[0]")),
    ];
    let dais = find("dais").unwrap();
    for (what, stage, view) in stored_views(&gpu) {
        let settings = tessellated(&view, 4, 32.0, 0.1);
        let image = stage.image(dais, &settings);
        for (_, name, shader) in mutants.iter().filter(|(of, ..)| *of == what) {
            let db = psnr(&image, &image_with(&stage, dais, &settings, &[], shader));
            println!("{what}: {name}: {db:.2} dB");
            assert!(db < MIN_PSNR_DB, "{what}: {name}: a mutant within the bound: {db:.2} dB");
        }
    }
}

/// Where triangles need more bits than a sample that holds coverage has, samples of 32 bits of reference give the same image;
/// the frame is recorded again with them when its count asks for them.
#[test]
fn wide_references_give_the_same_image() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=60000");
    let dais = find("dais").unwrap();
    let is_wide = |prepared: &mut afterlight_renderer::Prepared| {
        let plan = prepared.executor().plan();
        let [narrow, wide] = ["dais/references", "dais/wide references"].map(|n| plan.resource(n).is_some());
        assert_ne!(narrow, wide, "one layout a frame");
        wide
    };
    for samples in [1, 4] {
        let settings = Settings { samples, ..stage.settings((320, 180), 20) };
        let image = |bits: &str, expected_wide: bool| {
            let sets = [("fill", "cache"), ("reference-bits", bits)];
            let mut prepared = stage.prepare_with(dais, &settings, &params(dais, &sets));
            let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
            let stored = counters.iter().find(|c| c.name == "triangles").expect("counted");
            println!("{samples} samples, {bits} bits: {} triangles", stored.needed);
            assert_eq!(is_wide(&mut prepared), expected_wide, "{samples} samples, {bits} bits: {stored:?}");
            assert_eq!(stored.dropped, 0);
            image_of(&mut prepared)
        };
        let narrow = image("24", false);
        // 8 bits are less than the first frame has room for, 13 are more, and less than the view needs room for.
        for bits in ["8", "13"] {
            let db = psnr(&narrow, &image(bits, true));
            println!("{samples} samples, {bits} bits: {db:.2} dB");
            assert_eq!(
                db,
                f64::INFINITY,
                "{samples} samples, {bits} bits: not the image of the narrow layout"
            );
        }
        // References cut to what fewer bits hold are caught.
        let defines = ["WIDE"];
        let cut = "memoized(fragment_triangle()) & 0x1ffu";
        let shader = mutant("dais/fill.frag.glsl", "#wide", &defines, "memoized(fragment_triangle())", cut);
        let sets = [("fill", "cache"), ("reference-bits", "8")];
        let db = psnr(&narrow, &image_with(&stage, dais, &settings, &sets, &shader));
        assert!(db < MIN_PSNR_DB, "references cut short within the bound: {db:.2} dB");
    }
}
