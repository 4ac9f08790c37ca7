//! Surfaces with alpha blending over every technique's image: known answers, order, and agreement with `forward`.

mod common;

use afterlight_frame::completed;
use afterlight_oracle::raster::{RayScene, pixel_ray};
use afterlight_techniques::{
    CullOn, DrawParams, Frame, Info, Params, SHADERS, Settings, Technique, TechniqueError, Transparency,
    cost::{Cost, Workload},
    find,
    graph::{BufferRole, Graph, ImageHandle, ImageInfo, Load, PassRole, gpu::vk},
    registry,
    scene::{
        Aabb, AlphaMode, Camera, Instance, Material, Mesh, Projection, Scene, VertexAttributes, load_source,
        rng::SplitMix64,
    },
    shader::Shader,
};
use common::{
    Stage, compiled, compiled_variant, image_of, least_db, lights_of_each_kind, psnr, radiance_of, source,
};
use glam::{Affine3A, DVec3, Quat, Vec3};

/// Squares that face +z of their own space, one mesh, placed in the world.
struct Pane {
    half_m: f32,
    /// Where each square stands along z.
    depths_m: Vec<f32>,
    place: Affine3A,
    material: Material,
}

fn pane(place: Affine3A, material: Material) -> Pane {
    Pane { half_m: 10.0, depths_m: vec![0.0], place, material }
}

/// Larger than the view, across it.
fn at_z(z_m: f32, material: Material) -> Pane {
    pane(Affine3A::from_translation(Vec3::Z * z_m), material)
}

/// Covers where the signs of x and y are those given; 0: both.
fn part_at_z(signs: [f32; 2], z_m: f32, material: Material) -> Pane {
    let middle = Vec3::new(10.0 * signs[0], 10.0 * signs[1], z_m);
    pane(Affine3A::from_translation(middle), material)
}

/// Unlit, from both sides: its radiance is its colour.
fn glow(color: [f32; 4]) -> Material {
    let alpha_mode = AlphaMode::Blend;
    Material { base_color_factor: color, alpha_mode, unlit: true, double_sided: true, ..Material::default() }
}

fn opaque([r, g, b]: [f32; 3]) -> Material {
    Material { alpha_mode: AlphaMode::Opaque, ..glow([r, g, b, 1.0]) }
}

/// A scene of panes before a background, seen along -z by an orthographic camera two metres high.
fn scene_of(panes: &[Pane], background: Vec3) -> Scene {
    let mut scene = Scene { cameras: vec![looking(Vec3::Z * 5.0)], ..Scene::default() };
    scene.environment.background_radiance = background;
    scene.environment.ambient_radiance = Vec3::ZERO;
    for (i, pane) in panes.iter().enumerate() {
        let [first_index, first_vertex] = [scene.indices.len() as u32, scene.positions_os.len() as u32];
        let mut bounds_os = Aabb::EMPTY;
        for (k, z) in (0..).zip(&pane.depths_m) {
            let h = pane.half_m;
            let corners = [[-h, -h, *z], [h, -h, *z], [h, h, *z], [-h, h, *z]];
            corners.iter().for_each(|p| bounds_os.extend(Vec3::from(*p)));
            // Octahedral (0, 0) is +z.
            let white = VertexAttributes { color_rgba8: u32::MAX, ..VertexAttributes::default() };
            scene.positions_os.extend(corners);
            scene.attributes.extend([white; 4]);
            scene.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| 4 * k + corner));
        }
        scene.meshes.push(Mesh {
            name: format!("pane {i}"),
            first_index,
            index_count: scene.indices.len() as u32 - first_index,
            first_vertex,
            vertex_count: scene.positions_os.len() as u32 - first_vertex,
            material: i as u32,
            bounds_os,
        });
        scene.materials.push(pane.material.clone());
        scene.instances.push(Instance { mesh: i as u32, node: 0, world_from_object: pane.place });
    }
    scene
}

/// From a place towards the origin.
fn looking(eye_ws: Vec3) -> Camera {
    let mut camera = Camera::look_at("view", eye_ws, Vec3::ZERO, 1.0, 0.1);
    camera.projection = Projection::Orthographic { half_height_m: 1.0, near_m: 0.1, far_m: 40.0 };
    camera
}

/// Layers, far to near, over a colour.
fn over(below: Vec3, layers: &[[f32; 4]]) -> Vec3 {
    layers.iter().fold(below, |below, [r, g, b, a]| Vec3::new(*r, *g, *b) * *a + below * (1.0 - a))
}

fn rgb(pixel: [f32; 4]) -> Vec3 {
    let [r, g, b, _] = pixel;
    Vec3::new(r, g, b)
}

/// The greatest difference of any pixel to a colour, of those where `counts` of x and y from the upper left holds.
fn worst(image: &[[f32; 4]], expected: Vec3, counts: impl Fn(usize, usize) -> bool) -> f32 {
    let counted = image.iter().enumerate().filter(|(i, _)| counts(i % SIZE.0 as usize, i / SIZE.0 as usize));
    let errors: Vec<f32> = counted.map(|(_, p)| (rgb(*p) - expected).abs().max_element()).collect();
    assert!(errors.len() > 20, "{} pixels compared", errors.len());
    errors.into_iter().fold(0.0, f32::max)
}

fn everywhere(_: usize, _: usize) -> bool {
    true
}

const SIZE: (u32, u32) = (32, 18);

/// 16-bit floats below 1 round by 2^-12 at most, once a layer.
const ROUNDING: f32 = 0.002;

const LAYERS: [[f32; 4]; 3] = [[0.9, 0.1, 0.2, 0.5], [0.1, 0.8, 0.3, 0.25], [0.2, 0.3, 0.7, 0.625]];

/// Sample counts that a technique renders here.
fn samples_of(technique: &dyn Technique) -> Vec<u32> {
    [1, 4].into_iter().filter(|samples| technique.info().samples.contains(samples)).collect()
}

/// Three layers over a background and over an opaque half, and an opaque quarter before them.
#[test]
fn layers_have_the_value_that_is_known() {
    let gpu = afterlight_testkit::gpu();
    // G-buffers keep zeros and ones as they are.
    let (background, wall, front) = ([0.3, 0.2, 0.6], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]);
    let [a, b, c] = LAYERS;
    // The scene's order is not the view's.
    let scene = scene_of(
        &[
            at_z(0.5, glow(c)),
            at_z(-0.5, glow(a)),
            at_z(0.0, glow(b)),
            part_at_z([-1.0, 0.0], -1.0, opaque(wall)),
            part_at_z([1.0, -1.0], 1.0, opaque(front)),
        ],
        background.into(),
    );
    let stage = Stage::of(&gpu, scene);
    let (x, y) = (SIZE.0 as usize / 2, SIZE.1 as usize / 2);
    for technique in registry() {
        for samples in samples_of(*technique) {
            let what = format!("{} at {samples} samples", technique.info().id);
            let settings = Settings { samples, ..stage.settings(SIZE, 0) };
            let image = stage.radiance(*technique, &settings);
            let mut error = worst(&image, over(background.into(), &LAYERS), |i, j| i >= x && j < y);
            error = error.max(worst(&image, over(wall.into(), &LAYERS), |i, _| i < x));
            error = error.max(worst(&image, front.into(), |i, j| i >= x && j >= y));
            println!("{what}: {error}");
            assert!(error < ROUNDING, "{what}: off by {error}");
            // Every wrong order is seen.
            for wrong in [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
                assert!(worst(&image, over(wall.into(), &wrong), |i, _| i < x) > 10.0 * ROUNDING);
            }
            // From behind the order turns, and so do left and right.
            let behind = Settings { camera: looking(Vec3::Z * -5.0), ..settings.clone() };
            let image = stage.radiance(*technique, &behind);
            let mut error = worst(&image, over(front.into(), &[c, b, a]), |i, j| i < x && j >= y);
            error = error.max(worst(&image, over(background.into(), &[c, b, a]), |i, j| i < x && j < y));
            error = error.max(worst(&image, wall.into(), |i, _| i >= x));
            assert!(error < ROUNDING, "{what}, from behind: off by {error}");

            let none = settings.with_effects(|effects| effects.transparency.order = Transparency::None);
            let error = worst(&stage.radiance(*technique, &none), wall.into(), |i, _| i < x);
            assert!(error < ROUNDING, "{what}: without layers off by {error}");
        }
    }
}

/// One radiance everywhere, and no depth of the frame: none at all, or one of another size.
struct Flat {
    radiance: [f32; 3],
    other_depth: bool,
}

impl Technique for Flat {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }

    fn info(&self) -> &Info {
        find("forward").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        if self.other_depth {
            let size = ImageInfo::new(vk::Format::D32_SFLOAT, frame.width_px, frame.height_px + 1);
            let depth = graph.image("flat/depth", BufferRole::Depth, size.samples(frame.samples));
            let mut pass = graph.raster("flat/depth", PassRole::DepthPrepass);
            // Nearer than everything.
            let depth = pass.depth(depth, Load::Clear(1.0));
            pass.finish();
            frame.board.put(afterlight_frame::OpaqueDepth(depth));
        }
        let image = graph.image(
            "flat/radiance",
            BufferRole::Targets,
            frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
        );
        let [r, g, b] = self.radiance;
        Ok(graph.clear_image("flat/clear", PassRole::Shading, image, [r, g, b, 1.0]))
    }
}

/// Depth is drawn where the technique has none that fits: an opaque quarter hides the layers behind it.
#[test]
fn depth_is_drawn_where_none_is_handed_over() {
    let gpu = afterlight_testkit::gpu();
    let front = part_at_z([1.0, -1.0], 1.0, opaque([0.0; 3]));
    let stage = Stage::of(&gpu, scene_of(&[at_z(0.0, glow(LAYERS[0])), front], Vec3::ONE));
    let (x, y) = (SIZE.0 as usize / 2, SIZE.1 as usize / 2);
    for (samples, other_depth) in [(1, false), (4, false), (1, true), (4, true)] {
        let technique = Flat { radiance: [0.3, 0.2, 0.6], other_depth };
        let settings = Settings { samples, keep_hdr: true, ..stage.settings(SIZE, 0) };
        let mut prepared = stage.prepare(&technique, &settings);
        let image = radiance_of(&mut prepared);
        let flat = Vec3::from(technique.radiance);
        let hidden = worst(&image, flat, |i, j| i >= x && j >= y);
        let seen = worst(&image, over(flat, &LAYERS[..1]), |i, j| i < x || j < y);
        assert!(
            hidden.max(seen) < ROUNDING,
            "{samples} samples, other depth {other_depth}: {hidden}, {seen}"
        );
        let report = prepared.run().unwrap_or_else(|e| panic!("{e}"));
        assert!(report.pass("shared/transparent depth").is_some());
    }
    let mut handed = stage.prepare(find("deferred").unwrap(), &stage.settings(SIZE, 0));
    let report = handed.run().unwrap_or_else(|e| panic!("{e}"));
    assert!(report.pass("shared/transparent depth").is_none(), "depth is drawn twice");
}

/// A wall beside the view: some techniques record no pass without a draw.
fn beside() -> Pane {
    Pane { half_m: 0.1, ..pane(Affine3A::from_translation(15.0 * Vec3::X), opaque([0.5; 3])) }
}

/// Layers whose bounds hold each other, and squares of one mesh before and behind another.
#[test]
fn triangles_are_sorted_where_draws_cannot_be() {
    let gpu = afterlight_testkit::gpu();
    let background = Vec3::new(0.3, 0.2, 0.6);
    let [a, b, c] = LAYERS;
    let tilt = Quat::from_rotation_y(0.6);
    let tilted =
        |z_m: f32, color| pane(Affine3A::from_rotation_translation(tilt, Vec3::Z * z_m), glow(color));
    let twice = Pane { depths_m: vec![0.6, -0.6], ..at_z(0.0, glow(c)) };
    for (what, panes, layers) in [
        ("tilted", vec![tilted(0.4, b), tilted(0.0, a), tilted(0.8, c)], vec![a, b, c]),
        ("between two of one mesh", vec![twice, at_z(0.0, glow(a))], vec![c, a, c]),
        (
            "opaque by alpha 1",
            vec![at_z(0.0, glow([0.4, 0.3, 0.2, 1.0])), at_z(0.2, glow(b))],
            vec![[0.4, 0.3, 0.2, 1.0], b],
        ),
        ("not there by alpha 0", vec![at_z(0.2, glow([1e4, 1e4, 1e4, 0.0])), at_z(0.0, glow(b))], vec![b]),
    ] {
        let stage = Stage::of(&gpu, scene_of(&panes, background));
        for samples in [1, 4] {
            let settings = Settings { samples, ..stage.settings(SIZE, 0) };
            let image = stage.radiance(find("forward").unwrap(), &settings);
            let error = worst(&image, over(background, &layers), everywhere);
            println!("{what} at {samples} samples: {error}");
            assert!(error < ROUNDING, "{what} at {samples} samples: off by {error}");
            let mut reversed = layers.clone();
            reversed.reverse();
            if layers.len() > 1 && reversed != layers {
                assert!(worst(&image, over(background, &reversed), everywhere) > 10.0 * ROUNDING, "{what}");
            }
        }
    }
}

/// What `compose/transparent/blend.frag` shades by.
const CALL: &str = "stepped_radiance(s, uvec2(gl_FragCoord.xy))";

/// `compose/transparent/blend.frag` with a part of its text replaced.
fn mutant(from: &str, to: &str) -> Shader {
    let path = source("compose/transparent/blend.frag.glsl");
    compiled("compose/transparent/blend.frag", &path, &[], &[(from, to)])
}

/// Radiance of `forward` with shaders in the place of its own.
fn radiance_with(stage: &Stage, settings: &Settings, shaders: Option<Shader>) -> Vec<[f32; 4]> {
    let settings = Settings { keep_hdr: true, ..settings.clone() };
    let technique = find("forward").unwrap();
    radiance_of(&mut stage.prepare_shaders(technique, &settings, &Params::default(), shaders))
}

/// One side shows of what is not double-sided: the front, of mirrored draws as well.
#[test]
fn back_faces_are_left_out_where_one_side_shows() {
    let gpu = afterlight_testkit::gpu();
    let background = Vec3::new(0.3, 0.2, 0.6);
    let color = LAYERS[0];
    let seen = over(background, &[color]);
    let one_sided = Material { double_sided: false, ..glow(color) };
    for (what, mirror) in [("plain", Vec3::ONE), ("mirrored", Vec3::new(-1.0, 1.0, 1.0))] {
        let stage =
            Stage::of(&gpu, scene_of(&[pane(Affine3A::from_scale(mirror), one_sided.clone())], background));
        let before = stage.settings(SIZE, 0);
        let behind = Settings { camera: looking(Vec3::Z * -5.0), ..before.clone() };
        for (settings, expected, other) in [(&before, seen, background), (&behind, background, seen)] {
            let image = radiance_with(&stage, settings, None);
            let error = worst(&image, expected, everywhere);
            assert!(error < ROUNDING, "{what}: off by {error}");
            let turned = radiance_with(
                &stage,
                settings,
                Some(mutant("gl_FrontFacing != mirrored", "gl_FrontFacing == mirrored")),
            );
            assert!(worst(&turned, other, everywhere) < ROUNDING, "{what}: a turned side is not seen");
        }
        if mirror.x < 0.0 {
            let ignored =
                radiance_with(&stage, &before, Some(mutant("gl_FrontFacing != mirrored", "gl_FrontFacing")));
            assert!(
                worst(&ignored, seen, everywhere) > 10.0 * ROUNDING,
                "mirroring without effect goes unseen"
            );
        }
    }
}

/// A lit pane of alpha a shows a times what it shows opaque, and 1 - a of what is behind it: under lights, emission and ambient
/// light, from both sides.
#[test]
fn layers_are_shaded_as_opaque_surfaces_are() {
    let gpu = afterlight_testkit::gpu();
    let background = Vec3::new(0.3, 0.2, 0.6);
    let alpha = 0.375;
    let lit = Material {
        base_color_factor: [0.7, 0.5, 0.3, alpha],
        metallic_factor: 0.2,
        roughness_factor: 0.4,
        emissive_factor: [0.02, 0.05, 0.01],
        unlit: false,
        ..glow([0.0; 4])
    };
    let of = |alpha_mode| {
        let mut scene = scene_of(&[at_z(0.0, Material { alpha_mode, ..lit.clone() }), beside()], background);
        scene.environment.ambient_radiance = Vec3::splat(0.1);
        Stage::of(&gpu, scene)
    };
    let (blended, shown) = (of(AlphaMode::Blend), of(AlphaMode::Opaque));
    for eye_z in [5.0, -5.0] {
        let mut settings = Settings { camera: looking(Vec3::Z * eye_z), ..shown.settings(SIZE, 0) };
        settings.lights = lights_of_each_kind(&shown, Vec3::new(0.4, 0.6, 0.4 * eye_z), 0.3).to_vec();
        let expected: Vec<Vec3> = shown
            .radiance(find("forward").unwrap(), &settings)
            .into_iter()
            .map(|l| alpha * rgb(l) + (1.0 - alpha) * background)
            .collect();
        let error = |image: Vec<[f32; 4]>| {
            let errors =
                image.iter().zip(&expected).map(|(p, e)| ((rgb(*p) - *e) / (*e + 0.05)).abs().max_element());
            errors.fold(0.0, f32::max)
        };
        for technique in registry() {
            for samples in samples_of(*technique) {
                let error = error(blended.radiance(*technique, &Settings { samples, ..settings.clone() }));
                println!("{} at {samples} samples, z {eye_z}: relative {error}", technique.info().id);
                assert!(error < 0.003, "{} at {samples} samples: off by {error}", technique.info().id);
            }
        }
        let no_light = mutant(CALL, "unlit_radiance(s)");
        assert!(error(radiance_with(&blended, &settings, Some(no_light))) > 0.02);
        let wrong_side = mutant(CALL, "(s.normal_ws = -s.normal_ws, surface_radiance(s))");
        assert!(error(radiance_with(&blended, &settings, Some(wrong_side))) > 0.02);
    }
}

/// At several samples an edge shows as much of a layer as it covers: before one radiance, compositing after the average is exact.
#[test]
fn edges_blend_by_their_coverage() {
    let gpu = afterlight_testkit::gpu();
    let background = Vec3::new(0.3, 0.2, 0.6);
    let turned = |material: Material| {
        let place =
            Affine3A::from_rotation_translation(Quat::from_rotation_z(0.3), Vec3::new(0.1, 0.07, 0.0));
        Stage::of(&gpu, scene_of(&[Pane { half_m: 0.6, ..pane(place, material) }], background))
    };
    let [r, g, b, alpha] = LAYERS[0];
    let (blended, solid) = (turned(glow(LAYERS[0])), turned(opaque([r, g, b])));
    let settings = Settings { samples: 4, ..solid.settings(SIZE, 0) };
    let forward = find("forward").unwrap();
    let [found, covered] = [&blended, &solid].map(|stage| stage.radiance(forward, &settings));
    let mut partly = 0;
    for (found, covered) in found.iter().zip(&covered) {
        let coverage = (covered[0] - background.x) / (r - background.x);
        partly += usize::from(coverage > 0.1 && coverage < 0.9);
        let expected = over(background, &[[r, g, b, alpha * coverage]]);
        let error = (rgb(*found) - expected).abs().max_element();
        assert!(error < ROUNDING, "coverage {coverage}: off by {error}");
    }
    assert!(partly > 20, "{partly} pixels at the edge");
}

/// A grid of spheres of both sides, seen along its rows, against rays that meet every layer at its own distance.
#[test]
fn layers_agree_with_rays() {
    let gpu = afterlight_testkit::gpu();
    let mut scene = load_source("builtin:spheres?rows=3&columns=5&segments=32", &Default::default())
        .unwrap_or_else(|e| panic!("{e}"));
    for (i, material) in scene.materials.iter_mut().enumerate() {
        if i % 4 != 0 {
            (material.alpha_mode, material.double_sided) = (AlphaMode::Blend, true);
            material.base_color_factor[3] = 0.3 + 0.1 * (i % 5) as f32;
        }
    }
    let stage = Stage::of(&gpu, scene);
    let bounds = stage.scene.bounds_ws();
    let eye_ws = bounds.center() + bounds.size() * Vec3::new(0.8, 0.15, 0.0) + 0.5 * Vec3::Z;
    let camera = Camera::look_at("along the rows", eye_ws, bounds.center(), 0.8, 0.1);
    let size = [160u32, 90];
    let settings = stage.from(camera, (size[0], size[1]), 20);
    let rays = RayScene::new(&stage.scene);
    let places: Vec<[u32; 2]> = (0..size[0] * size[1]).map(|i| [i % size[0], i / size[0]]).collect();
    let expected: Vec<DVec3> =
        places.iter().map(|at| rays.shade_pixel(&settings.lights, &settings.camera, *at, size)).collect();
    let depth = |at: &[u32; 2]| {
        let ray = pixel_ray(&settings.camera, *at, size);
        let first = rays.first_hit(&ray).map_or(f64::INFINITY, |hit| hit.distance_m);
        rays.layers(&ray, first).len()
    };
    let deep = places.iter().filter(|at| depth(at) >= 4).count();
    assert!(deep > 1000, "{deep} pixels with four layers or more");
    let wrong = |image: &[[f32; 4]]| {
        let differ = image.iter().zip(&expected).filter(|(found, expected)| {
            let error = (rgb(**found).as_dvec3() - **expected).abs().max_element();
            error > 0.01 * (expected.max_element() + 0.1)
        });
        differ.count() as f64 / image.len() as f64
    };
    let right = wrong(&radiance_with(&stage, &settings, None));
    println!("{deep} pixels of four layers or more; {right:.4} of the pixels differ");
    let thinner =
        wrong(&radiance_with(&stage, &settings, Some(mutant("0.0, base.a)", "0.0, 0.9 * base.a)"))));
    println!("{thinner:.4} with less alpha");
    // Silhouettes, where a pixel's centre meets another facet than the ray does, or two facets of one distance.
    assert!(right < 0.002, "{right} of the pixels differ");
    assert!(thinner > 0.1, "less alpha goes unseen: {thinner}");
}

/// The colonnade through the panes of its aisle: glass before glass before the rose window's wall.
fn aisle(stage: &Stage, size: (u32, u32)) -> Settings {
    let camera = Camera::look_at("panes", Vec3::new(-9.3, 1.5, -4.5), Vec3::new(-5.0, 1.3, -4.6), 1.0, 0.05);
    stage.from(camera, size, 100)
}

/// Share of pixels that differ.
fn differing(a: &afterlight_image::Rgba8Image, b: &afterlight_image::Rgba8Image) -> f64 {
    let differ = a.pixels.chunks_exact(4).zip(b.pixels.chunks_exact(4)).filter(|(a, b)| a != b).count();
    differ as f64 / f64::from(a.width * a.height)
}

#[test]
fn every_technique_agrees_with_forward_through_the_panes_of_the_colonnade() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000&texture=128");
    for samples in [1, 4] {
        let settings = Settings { samples, ..aisle(&stage, (160, 90)) };
        let none = settings.clone().with_effects(|effects| effects.transparency.order = Transparency::None);
        let forward = find("forward").unwrap();
        let (reference, without) = (stage.image(forward, &settings), stage.image(forward, &none));
        let shown = differing(&reference, &without);
        println!("panes on {shown:.2} of the pixels, {:.2} dB to none", psnr(&reference, &without));
        assert!(shown > 0.25, "panes on {shown} of the pixels");
        for technique in registry().iter().filter(|t| t.info().samples.contains(&samples)) {
            let info = technique.info();
            let mut prepared = stage.prepare(*technique, &settings);
            let db = psnr(&reference, &image_of(&mut prepared));
            println!("{} at {samples} samples: {db:.2} dB", info.id);
            let least = least_db(*technique, &Params::default(), samples);
            assert!(db >= least, "{} at {samples} samples: {db:.2} dB to forward", info.id);
            assert!(psnr(&without, &image_of(&mut prepared)) < 40.0, "{}: no panes go unseen", info.id);

            // What is shared is not the technique's.
            let bytes = |prepared: &mut afterlight_renderer::Prepared| {
                let report = prepared.run().unwrap_or_else(|e| panic!("{e}"));
                assert_eq!(
                    report.passes.iter().any(|pass| pass.name == "shared/transparent" && pass.shared),
                    report.passes.iter().any(|pass| pass.name.contains("transparent")),
                );
                report.technique_bytes
            };
            assert_eq!(bytes(&mut prepared), bytes(&mut stage.prepare(*technique, &none)), "{}", info.id);
        }
    }
}

/// Left out, they leave the image that the scene without them has.
#[test]
fn none_is_the_scene_without_them() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000&texture=64");
    let mut scene = stage.scene.clone();
    let blended = |i: &Instance| {
        let material = stage.scene.meshes[i.mesh as usize].material;
        stage.scene.materials[material as usize].alpha_mode == AlphaMode::Blend
    };
    scene.instances.retain(|instance| !blended(instance));
    assert!(scene.instances.len() < stage.scene.instances.len());
    let cleared = Stage::of(&gpu, scene);
    let sorted = aisle(&stage, (160, 90));
    let none = sorted.clone().with_effects(|effects| effects.transparency.order = Transparency::None);
    for id in ["forward", "deferred", "visibility"] {
        let technique = find(id).unwrap();
        let expected = cleared.image(technique, &sorted);
        assert_eq!(stage.image(technique, &none).pixels, expected.pixels, "{id}");
        assert!(stage.image(technique, &sorted).pixels != expected.pixels, "{id}: panes go unseen");
    }
    // Debug views are of what the technique does.
    let view = |settings: &Settings| {
        let settings = Settings { view: "invocations".to_owned(), ..settings.clone() };
        stage.image(find("forward").unwrap(), &settings)
    };
    assert_eq!(view(&sorted).pixels, view(&none).pixels);
}

/// Tessellated, panes stay where they are.
#[test]
fn tessellated_panes_are_those_that_are_not() {
    let gpu = afterlight_testkit::gpu();
    if !afterlight_testkit::has_tessellation(&gpu) {
        return;
    }
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000&texture=64");
    let plain = aisle(&stage, (160, 90));
    let tessellated = plain.clone().with_effects(|effects| effects.tessellation.edge_px = Some(8.0));
    let none = tessellated.clone().with_effects(|effects| effects.transparency.order = Transparency::None);
    for id in ["forward", "deferred"] {
        let technique = find(id).unwrap();
        let image = stage.image(technique, &tessellated);
        let db = psnr(&image, &stage.image(technique, &plain));
        println!("{id}: {db:.2} dB");
        assert!(db > 40.0, "{id}: {db:.2} dB between tessellated and not");
        assert!(differing(&image, &stage.image(technique, &none)) > 0.25, "{id}: panes go unseen");
    }
}

/// The scene with all of its surfaces blended, and cameras at random places in it.
fn all_blended(source: &str, instances: usize) -> (Scene, Vec<Camera>) {
    let mut scene = load_source(source, &Default::default()).unwrap_or_else(|e| panic!("{e}"));
    for material in &mut scene.materials {
        (material.alpha_mode, material.base_color_factor[3]) = (AlphaMode::Blend, 0.5);
    }
    let mut random = SplitMix64::new(6);
    let mut point = |size: f32| {
        Vec3::new(random.next_f32() - 0.5, random.next_f32() - 0.5, random.next_f32() - 0.5) * size
    };
    let one = scene.instances[0].clone();
    scene.instances.extend((1..instances).map(|_| {
        let world_from_object = Affine3A::from_translation(point(9.0)) * one.world_from_object;
        Instance { world_from_object, ..one.clone() }
    }));
    let camera = |i| {
        let camera = Camera::look_at("random", point(8.0), point(4.0), 1.2, 0.05);
        let projection = Projection::Orthographic { half_height_m: 3.0, near_m: 0.0, far_m: 30.0 };
        if i % 2 == 1 { Camera { projection, ..camera } } else { camera }
    };
    let cameras = (0..4).map(camera).collect();
    (scene, cameras)
}

/// A frame whose triangles the device or the host sorts, with shaders in place of the stage's own.
fn sorted_on(stage: &Stage, settings: &Settings, cull_on: CullOn, shaders: &[Shader]) -> Vec<[f32; 4]> {
    let technique = find("forward").unwrap();
    let mut params = completed(technique, &Params::default());
    params.typed_mut::<DrawParams>().cull_on = cull_on;
    let settings = Settings { keep_hdr: true, ..settings.clone() };
    radiance_of(&mut stage.prepare_shaders(technique, &settings, &params, shaders.iter().cloned()))
}

/// Device and host come to one order: the same bits, few triangles or many, in one run or each in its own.
#[test]
fn the_device_sorts_as_the_host() {
    let gpu = afterlight_testkit::gpu();
    let sphere = "builtin:sphere?segments";
    for (source, instances) in
        [(format!("{sphere}=6"), 1), (format!("{sphere}=16"), 40), (format!("{sphere}=336"), 1)]
    {
        let (scene, cameras) = all_blended(&source, instances);
        let stage = Stage::of(&gpu, scene);
        println!("{source}: {} triangles", stage.uploaded.blended_triangle_count());
        for (camera, samples) in cameras.into_iter().zip([1, 4, 1, 1]) {
            let settings = Settings { camera, samples, ..stage.settings((64, 36), 3) };
            let [device, host] = [CullOn::Gpu, CullOn::Cpu].map(|on| sorted_on(&stage, &settings, on, &[]));
            assert!(device == host, "{source}: {:?}", settings.camera);
            assert!(device == sorted_on(&stage, &settings, CullOn::Auto, &[]));
        }
    }
}

/// Mutants that pair the beginning of a run with the end of another one are not tried: their commands have billions of indices.
#[test]
fn wrong_orders_of_the_device_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let (scene, cameras) = all_blended("builtin:sphere?segments=16", 40);
    let stage = Stage::of(&gpu, scene);
    let views: Vec<Settings> =
        cameras.into_iter().map(|camera| Settings { camera, ..stage.settings((64, 36), 3) }).collect();
    let expected: Vec<_> = views.iter().map(|view| sorted_on(&stage, view, CullOn::Cpu, &[])).collect();
    let [keys, count, write] = ["keys", "count_runs", "write_runs"].map(|pass| {
        (format!("compose/transparent/{pass}.comp"), format!("compose/transparent/{pass}.comp.glsl"))
    });
    for ((shader, file), from, to) in [
        (&keys, "min(~sortable_bits(", "min(sortable_bits("),
        (&keys, "if (is_in_view(", "if (!is_in_view("),
        (&keys, "view_distance_m(draw, triangle.centroid_os)", "view_distance_m(draw, vec3(0.0))"),
        (&count, "draw_commands[place * 5u] = 0u;", "draw_commands[place * 5u] = 3u;"),
        (&write, "draw_commands[at + 2u] = place * 3u;", "draw_commands[at + 2u] = place * 3u + 3u;"),
        (&write, "(place + 1u) * 3u);", "place * 3u);"),
        (&write, "draw_count = all_runs;", "draw_count = all_runs - 1u;"),
    ] {
        let wrong = compiled_variant(shader, file, &[(from, to)]);
        let is_caught = views.iter().zip(&expected).any(|(view, expected)| {
            sorted_on(&stage, view, CullOn::Gpu, std::slice::from_ref(&wrong)) != *expected
        });
        assert!(is_caught, "{shader}: {to:?} goes unseen");
    }
}
