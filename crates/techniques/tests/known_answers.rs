//! Scenes with a known answer (ladder step c), and stages against their CPU twins in f64 (step b).

mod common;

use afterlight_oracle::{
    brdf,
    raster::{RayScene, pixel_ray},
    tiles::{TileView, light_reaches},
};
use afterlight_techniques::{
    Frame, Info, Params, Technique, TechniqueError,
    cost::{Cost, Workload},
    device_order, find, gbuffer,
    graph::{BufferRole, Graph, ImageHandle, PassRole, gpu::vk},
    registry,
    scene::{Camera, Light, Projection, builtin::edge_coverage},
};
use common::{Stage, wider};
use glam::{DMat4, DVec3, DVec4, Vec3};

/// In a uniform surrounding, white surfaces of any roughness and metalness vanish: every pixel is 1.
#[test]
fn the_white_furnace_is_uniform_in_every_technique() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:furnace?segments=32");
    let settings = stage.settings((128, 72), 0);
    for technique in registry().iter().filter(|t| t.info().samples.contains(&1)) {
        for (i, pixel) in stage.radiance(*technique, &settings).iter().enumerate() {
            for channel in &pixel[..3] {
                assert!((channel - 1.0).abs() <= 0.01, "{}: pixel {i} is {pixel:?}", technique.info().id);
            }
        }
    }
    let mut mutant = settings.clone();
    mutant.environment.ambient_radiance *= 0.98;
    let darker = stage.radiance(find("forward").unwrap(), &mutant);
    assert!(darker.iter().any(|p| (p[0] - 1.0).abs() > 0.01), "two percent less light go unseen");
}

/// Radiance of the unit sphere at the origin where a ray meets it, by the closed form of its normal; `None` beside it and
/// near its rim, where a tessellated sphere differs.
fn closed_form(stage: &Stage, pixel: [u32; 2], size: [u32; 2], roughness: f64) -> Option<DVec3> {
    let camera = &stage.scene.cameras[0];
    let ray = pixel_ray(camera, pixel, size);
    let direction = ray.direction_ws.normalize();
    let b = ray.origin_ws.dot(direction);
    let root = b * b - ray.origin_ws.length_squared() + 1.0;
    let point = ray.origin_ws + direction * (-b - (root > 0.0).then(|| root.sqrt())?);
    let material = &stage.scene.materials[stage.scene.meshes[0].material as usize];
    let [r, g, b, _] = material.base_color_factor.map(f64::from);
    let surface = brdf::Surface {
        position_ws: point,
        normal_ws: point,
        base_color: DVec3::new(r, g, b),
        metallic: material.metallic_factor.into(),
        roughness,
        occlusion: 1.0,
        emission: DVec3::ZERO,
        unlit: false,
    };
    (point.dot(-direction) > 0.25)
        .then(|| brdf::shade(&surface, -direction, &stage.scene.lights, DVec3::ZERO))
}

#[test]
fn a_lit_sphere_matches_its_closed_form() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:sphere?segments=256");
    let size = [160u32, 90];
    let settings = stage.settings((size[0], size[1]), 0);
    for technique in registry().iter().filter(|t| t.info().samples.contains(&1)) {
        let image = stage.radiance(*technique, &settings);
        let worst = |roughness: f64| {
            let (mut worst, mut compared) = (0f64, 0);
            for (i, pixel) in image.iter().enumerate() {
                let at = [i as u32 % size[0], i as u32 / size[0]];
                let Some(expected) = closed_form(&stage, at, size, roughness) else { continue };
                let found = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into());
                worst = worst.max((found - expected).abs().max_element() / (expected.max_element() + 0.02));
                compared += 1;
            }
            assert!(compared > 1000, "the sphere covers {compared} pixels");
            worst
        };
        let error = worst(0.5);
        println!("{}: relative error {error:.5}", technique.info().id);
        // Measured on lavapipe: 0.0079; 0.0086 through the G-buffer's 8 bits of roughness and base colour.
        assert!(error < 0.010, "{}: relative error {error}", technique.info().id);
        assert!(worst(0.52) > 0.010, "a roughness larger by 0.02 goes unseen");
    }
}

/// At one sample a pixel is white where its centre is covered: for a straight edge, where more than half of it is.
#[test]
fn the_edge_covers_exactly_what_it_should() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:edge");
    for size in [(64u32, 36u32), (17, 3), (101, 57)] {
        let coverage = edge_coverage(size.0, size.1);
        for technique in registry().iter().filter(|t| t.info().samples.contains(&1)) {
            let image = stage.radiance(*technique, &stage.settings(size, 0));
            for (i, (pixel, covered)) in image.iter().zip(&coverage).enumerate() {
                // Vertices snap to 1/256 of a pixel.
                if (covered - 0.5).abs() > 1.0 / 128.0 {
                    let expected = if *covered > 0.5 { 1.0 } else { 0.0 };
                    assert_eq!(
                        pixel[0],
                        expected,
                        "{}: pixel {i} of {size:?}, covered {covered}",
                        technique.info().id
                    );
                }
            }
        }
    }
}

/// Pixels against position, normal and BRDF evaluated in f64 along the pixel's ray: interpolation by the raster part, from the
/// vertices and from the triangle buffer, of triangles that reach behind the eye as well.
#[test]
fn interpolation_agrees_with_f64() {
    let gpu = afterlight_testkit::gpu();
    let size = [160u32, 90];
    for (source, within) in
        [("builtin:spheres?segments=48", false), ("builtin:intersect", false), ("builtin:intersect", true)]
    {
        let stage = Stage::new(&gpu, source);
        let mut settings = stage.settings((size[0], size[1]), 30);
        if within {
            // Among the triangles: they cross the planes of the eye.
            let bounds = stage.scene.bounds_ws();
            let eye = bounds.center() + bounds.size() * Vec3::new(0.05, 0.03, 0.1);
            settings.camera =
                Camera::look_at("within", eye, bounds.center() - bounds.size() * 0.2, 1.2, 0.01);
        }
        let rays = RayScene::new(&stage.scene);
        let worst = |image: &[[f32; 4]], lights: &[Light]| {
            let (mut worst, mut compared) = (0f64, 0);
            for (i, pixel) in image.iter().enumerate() {
                let at = [i as u32 % size[0], i as u32 / size[0]];
                let ray = pixel_ray(&settings.camera, at, size);
                // Near an edge rounding may pick the neighbouring triangle.
                let Some(hit) = rays.first_hit(&ray).filter(|hit| hit.edge_distance > 0.02) else { continue };
                let surface = rays.surface(&hit);
                let to_eye = -ray.direction_ws.normalize();
                let ambient = settings.environment.ambient_radiance.as_dvec3();
                let expected = brdf::shade(&surface, to_eye, lights, ambient);
                let found = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into());
                worst = worst.max((found - expected).abs().max_element() / (expected.max_element() + 0.05));
                compared += 1;
            }
            assert!(compared > 2000, "{source}: {compared} pixels compared");
            worst
        };
        for id in ["forward", "visibility", "dais"] {
            let image = stage.radiance(find(id).unwrap(), &settings);
            let error = worst(&image, &settings.lights);
            println!("{source}, within {within}: {id}: relative error {error:.5}");
            // Measured on lavapipe: see the lines above; RGBA16F rounds to 0.0005.
            assert!(error < 0.002, "{source}, within {within}: {id}: relative error {error}");
            let mutant = worst(&image, &wider(&settings.lights, 1.02));
            assert!(mutant > 0.002, "{id}: ranges larger by two percent go unseen");
        }
    }
}

/// `tiled` with the bits of its tiles and its depth kept.
struct TiledWithBits;

impl Technique for TiledWithBits {
    fn info(&self) -> &Info {
        find("tiled").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, "tiled", vk::Format::D32_SFLOAT)?;
        graph.keep(&filled.depth);
        let tiles = frame.width_px.div_ceil(16) * frame.height_px.div_ceil(16);
        let bits =
            graph.buffer("bits", BufferRole::Lights, 4 * u64::from(tiles * frame.lights.count.div_ceil(32)));
        let bits = graph.clear_buffer("clear bits", PassRole::LightAssignment, bits, 0);
        let mut pass =
            frame.compute(graph, "tiled/shade", PassRole::Shading, &frame.shader("tiled/shade.comp#emit")?);
        gbuffer::bind(&mut pass, &filled);
        let radiance = pass.write("hdr", filled.accumulation);
        let bits = pass.write("TileLights", bits);
        pass.dispatch(frame.groups(16));
        pass.finish();
        graph.keep(&bits);
        Ok(radiance)
    }
}

#[test]
fn tiles_hold_the_lights_of_their_cpu_twin_and_miss_none() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    for (size, count) in [((160u32, 90u32), 100u32), ((113, 61), 1500)] {
        let mut settings = stage.settings(size, count);
        settings.lights = device_order(&settings.lights);
        let mut prepared = stage.prepare(&TiledWithBits, &settings);
        prepared.run().unwrap();
        let depth = prepared.executor().read_image("tiled/depth").unwrap();
        let bits = prepared.executor().read_buffer("bits").unwrap();
        let word = |i: usize| u32::from_le_bytes(bits[4 * i..4 * i + 4].try_into().unwrap());
        let Projection::Perspective { near_m, .. } = settings.camera.projection else {
            panic!("perspective")
        };
        let view = TileView::new(&settings.camera, size.0, size.1);

        let depths: Vec<f32> =
            depth.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let distances: Vec<Option<f64>> =
            depths.iter().map(|d| (*d > 0.0).then(|| f64::from(near_m) / f64::from(*d))).collect();
        let bounds = view.distance_bounds(&distances);
        let [across, _] = view.tile_counts();
        let words = count.div_ceil(32) as usize;
        let on_device = |tile: usize, light: usize| word(tile * words + light / 32) >> (light % 32) & 1 == 1;

        let differences = |lights: &[Light]| {
            let (mut different, mut borderline) = (0, 0);
            for (tile, bound) in bounds.iter().enumerate() {
                let at = [tile as u32 % across, tile as u32 / across];
                for (light, decision) in view.cull(at, *bound, lights).iter().enumerate() {
                    // 32-bit arithmetic on coordinates of tens of metres is right to about 1e-5 m.
                    if decision.slack_m.abs() < 1e-4 {
                        borderline += 1;
                    } else {
                        different += usize::from(decision.passes != on_device(tile, light));
                    }
                }
            }
            (different, borderline)
        };
        let (different, borderline) = differences(&settings.lights);
        println!("{size:?}, {count} lights: {different} decisions differ, {borderline} within rounding");
        assert_eq!(different, 0);
        assert!(differences(&wider(&settings.lights, 1.02)).0 > 0, "ranges larger by two percent go unseen");

        let world_from_clip: DMat4 = view.clip_from_world.inverse();
        for (i, depth) in depths.iter().enumerate().filter(|(_, d)| **d > 0.0) {
            let (x, y) = (i as u32 % size.0, i as u32 / size.0);
            let ndc = |v: u32, size: u32| (f64::from(v) + 0.5) * 2.0 / f64::from(size) - 1.0;
            let p = world_from_clip * DVec4::new(ndc(x, size.0), ndc(y, size.1), f64::from(*depth), 1.0);
            let point = p.truncate() / p.w;
            let tile = (y / 16 * across + x / 16) as usize;
            for (l, light) in settings.lights.iter().enumerate() {
                let d = point.distance(light.position_ws.as_dvec3());
                // within rounding of the range nothing arrives
                if d < f64::from(light.range_m) * 0.9999 && light_reaches(light, point) {
                    assert!(on_device(tile, l), "tile {tile} misses light {l} at pixel ({x}, {y})");
                }
            }
        }
    }
}
