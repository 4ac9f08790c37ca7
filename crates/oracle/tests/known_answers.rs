//! The twins against what is known without them.

use std::f64::consts::PI;

use afterlight_oracle::{
    brdf::{self, Surface},
    clusters::{Cell, ClusterView, slice_begins_m},
    furnace, packing,
    raster::{RayScene, pixel_ray},
    tiles::{TileView, light_reaches},
    tonemap,
};
use afterlight_scene::{
    Camera, Light, LightKind, VertexAttributes,
    builtin::{build, edge_coverage},
    lights::seeded_lights,
};
use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;

fn surface(base: f64, metallic: f64, roughness: f64) -> Surface {
    Surface {
        position_ws: DVec3::ZERO,
        normal_ws: DVec3::Z,
        base_color: DVec3::splat(base),
        metallic,
        roughness,
        occlusion: 1.0,
        emission: DVec3::ZERO,
        unlit: false,
    }
}

const ROUGHNESSES: [f64; 5] = [0.0, 0.2, 0.4, 0.7, 1.0];
const COSINES: [f64; 5] = [0.05, 0.2, 0.5, 0.8, 1.0];

#[test]
fn weak_white_furnace_is_one() {
    for roughness in ROUGHNESSES {
        for n_dot_v in COSINES {
            let found = furnace::weak_white_furnace(n_dot_v, roughness);
            assert!((found - 1.0).abs() < 0.01, "roughness {roughness}, cosine {n_dot_v}: {found}");
        }
    }
}

#[test]
fn distribution_is_normalised() {
    for roughness in [0.2, 0.4, 0.7, 1.0] {
        let found = furnace::distribution_norm(roughness);
        assert!((found - 1.0).abs() < 1e-3, "{roughness}: {found}");
    }
}

#[test]
fn no_lobe_reflects_more_than_it_gets() {
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in ROUGHNESSES {
            for n_dot_v in COSINES {
                let case = format!("metal {metallic}, roughness {roughness}, cosine {n_dot_v}");
                let lobes = furnace::directional_albedo(&surface(1.0, metallic, roughness), n_dot_v);
                let [specular, diffuse] = lobes.map(|lobe| lobe.max_element());
                assert!(specular <= 1.0 + 1e-3 && diffuse <= 1.0, "{case}: {specular} {diffuse}");
                // a smooth white metal loses nothing: single scattering is all there is
                let whole = metallic == 1.0 && roughness == 0.0 && n_dot_v > 0.1;
                assert!(!whole || specular > 0.99, "{case}: {specular}");
                // the model's own excess, see directional_albedo
                let sum = specular + diffuse;
                assert!(sum < if n_dot_v >= 0.5 { 1.05 } else { 1.75 }, "{case}: {sum}");
                println!("{case}: {sum:.4}");
            }
        }
    }
}

/// The mutant of the two tests above: α where α² belongs.
#[test]
fn a_wrong_distribution_is_seen() {
    let (roughness, steps) = (0.5, 100_000);
    let wrong = |n_dot_h: f64| {
        let a: f64 = brdf::alpha(roughness);
        a / (PI * (n_dot_h * n_dot_h * (a - 1.0) + 1.0).powi(2)) * a
    };
    let sum: f64 =
        (0..steps).map(|i| PI * wrong((1.0 - (f64::from(i) + 0.5) / f64::from(steps)).sqrt())).sum();
    assert!((sum / f64::from(steps) - 1.0).abs() > 0.05);
}

fn unit(z: f64, angle: f64) -> DVec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * angle.cos(), r * angle.sin(), z)
}

proptest! {
    #[test]
    fn brdf_is_reciprocal(
        z in (0.01f64..1.0, 0.01f64..1.0), a in (0.0f64..6.3, 0.0f64..6.3),
        base in 0.0f64..1.0, metallic in 0.0f64..1.0, roughness in 0.0f64..1.0,
    ) {
        let s = surface(base, metallic, roughness);
        let (v, l) = (unit(z.0, a.0), unit(z.1, a.1));
        let (there, back) = (brdf::brdf(&s, v, l), brdf::brdf(&s, l, v));
        prop_assert!((there - back).abs().max_element() <= 1e-9 * there.max_element().max(1.0));
        prop_assert!(there.min_element() >= 0.0 && there.is_finite());
    }

    #[test]
    fn octahedral_coordinates_come_back(z in -1.0f64..1.0, angle in 0.0f64..6.3) {
        let n = unit(z, angle);
        let e = packing::octahedral_encode(n);
        prop_assert!(e.abs().max_element() <= 1.0);
        prop_assert!(packing::octahedral_decode(e).abs_diff_eq(n, 1e-12));
    }

    /// The scene's packing, decoded here. Tangents lose their lowest bit to the sign.
    #[test]
    fn packed_vectors_come_back(z in -1.0f64..1.0, angle in 0.0f64..6.3, left: bool) {
        let n = unit(z, angle);
        let t = n.any_orthonormal_vector();
        let sign = if left { -1.0 } else { 1.0 };
        let packed = VertexAttributes::pack(n.as_vec3(), t.as_vec3(), sign, Vec2::ZERO, Vec2::ZERO, [1.0; 4]);
        let found = packing::unpack_normal(packed.normal_os_oct);
        prop_assert!(found.angle_between(n) < 6.5e-5, "{}", found.angle_between(n));
        let (found, found_sign) = packing::unpack_tangent(packed.tangent_os_oct);
        prop_assert!(found.angle_between(t) < 1.5e-4, "{}", found.angle_between(t));
        prop_assert_eq!(found_sign, f64::from(sign));
    }

    #[test]
    fn tone_mapping_stays_in_range_and_keeps_order(r in 0.0f64..50.0, g in 0.0f64..50.0, b in 0.0f64..50.0) {
        let mapped = tonemap::pbr_neutral(DVec3::new(r, g, b));
        prop_assert!(mapped.min_element() >= -1e-12 && mapped.max_element() <= 1.0, "{mapped}");
        let more = tonemap::pbr_neutral(DVec3::new(r, g, b) * 1.1);
        prop_assert!(more.max_element() >= mapped.max_element() - 1e-12);
        let byte = (r * 5.0) as u8;
        let back = tonemap::srgb_from_linear(tonemap::linear_from_srgb(f64::from(byte) / 255.0)) * 255.0;
        prop_assert!((back - f64::from(byte)).abs() < 1e-3);
    }
}

#[test]
fn tone_mapping_has_the_published_landmarks() {
    // grey 0.5 loses F90 = 0.04; 0.08 and below are squared over 0.16; the peak tends to 1
    assert!(tonemap::pbr_neutral(DVec3::splat(0.5)).abs_diff_eq(DVec3::splat(0.46), 1e-12));
    assert!(tonemap::pbr_neutral(DVec3::splat(0.04)).abs_diff_eq(DVec3::splat(0.01), 1e-12));
    let bright = tonemap::pbr_neutral(DVec3::splat(1e6)).max_element();
    assert!(bright > 0.999 && bright < 1.0);
}

#[test]
fn a_white_lambertian_surface_under_pi_lux_has_radiance_one() {
    // F0 = 0.04 is lost to diffuse light at normal incidence; the highlight of α = 1 adds F0 D V π = 0.04 / 4
    let s = surface(1.0, 0.0, 1.0);
    let found = PI * brdf::brdf(&s, DVec3::Z, DVec3::Z);
    assert!(found.abs_diff_eq(DVec3::splat(0.96 + 0.01), 1e-12), "{found}");
}

#[test]
fn lights_end_where_they_should() {
    let point = Light {
        kind: LightKind::Point,
        position_ws: Vec3::ZERO,
        direction_ws: Vec3::NEG_Z,
        intensity: Vec3::ONE,
        range_m: 2.0,
    };
    let at = |light: &Light, x: f64, z: f64| brdf::illuminance(light, DVec3::new(x, 0.0, z)).0.x;
    assert_eq!(at(&point, 0.0, -1.0), 1.0 - 1.0 / 16.0);
    assert_eq!(at(&point, 0.0, -2.0), 0.0);
    assert!(at(&point, 0.0, -1.999) > 0.0);
    let endless = Light { range_m: f32::INFINITY, ..point };
    assert_eq!(at(&endless, 0.0, -10.0), 0.01);
    let spot = Light { kind: LightKind::Spot { inner_angle_rad: 0.2, outer_angle_rad: 0.4 }, ..endless };
    let degree = |rad: f64| at(&spot, rad.tan(), -1.0) * (1.0 + rad.tan().powi(2));
    assert!((degree(0.19) - 1.0).abs() < 1e-6 && degree(0.41) == 0.0);
    let middle: f64 = (0.3f64.cos() - 0.4f64.cos()) / (0.2f64.cos() - 0.4f64.cos());
    assert!((degree(0.3) - middle * middle).abs() < 1e-6);
}

#[test]
fn a_tessellated_sphere_is_the_closed_form() {
    let scene = build("builtin:sphere?segments=512").expect("sphere");
    let rays = RayScene::new(&scene);
    let (camera, size_px) = (&scene.cameras[0], [32, 24]);
    let light = &scene.lights[0];
    let m = &scene.materials[0];
    let s = Surface {
        base_color: DVec3::from_slice(&m.base_color_factor.map(f64::from)[..3]),
        ..surface(1.0, f64::from(m.metallic_factor), f64::from(m.roughness_factor))
    };
    let (mut hits, mut worst) = (0, 0.0f64);
    for i in 0..size_px[0] * size_px[1] {
        let pixel = [i % size_px[0], i / size_px[0]];
        let ray = pixel_ray(camera, pixel, size_px);
        let to_light = -light.direction_ws.as_dvec3().normalize();
        let lux = light.intensity.as_dvec3();
        let exact = furnace::lit_sphere(&s, DVec3::ZERO, 1.0, ray.origin_ws, ray.direction_ws, to_light, lux);
        let found = rays.shade_pixel(&scene.lights, camera, pixel, size_px);
        if let (Some(exact), Some(_)) = (exact, rays.first_hit(&ray)) {
            hits += 1;
            worst = worst.max((exact - found).abs().max_element());
        }
    }
    assert!(hits > 200, "{hits}");
    // 512 segments: a chord lies up to 2e-5 inside, and normals have 16 bits
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn every_pixel_of_the_furnace_is_one() {
    let scene = build("builtin:furnace?segments=48").expect("furnace");
    let rays = RayScene::new(&scene);
    for i in 0..40 * 24 {
        let found = rays.shade_pixel(&scene.lights, &scene.cameras[0], [i % 40, i / 40], [40, 24]);
        assert!(found.abs_diff_eq(DVec3::ONE, 1e-12), "pixel {i}: {found}");
    }
}

#[test]
fn pixels_of_the_edge_are_white_where_their_centres_are_covered() {
    let scene = build("builtin:edge").expect("edge");
    let rays = RayScene::new(&scene);
    let (width, height) = (37, 21);
    let coverage = edge_coverage(width, height);
    for (i, coverage) in coverage.iter().enumerate() {
        let pixel = [i as u32 % width, i as u32 / width];
        let found = rays.shade_pixel(&[], &scene.cameras[0], pixel, [width, height]).x;
        // a slanted line through a pixel: its centre is covered exactly where more than half of it is
        let expected = if *coverage > 0.5 { 1.0 } else { 0.0 };
        assert!((found - expected).abs() < 1e-12, "pixel {pixel:?}: {found}, covered {coverage}");
    }
}

#[test]
fn mirrored_instances_show_their_fronts() {
    let mut scene = build("builtin:sphere?segments=24").expect("sphere");
    let before = RayScene::new(&scene).shade_pixel(&scene.lights, &scene.cameras[0], [20, 12], [40, 24]);
    scene.instances[0].world_from_object = glam::Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let after = RayScene::new(&scene).shade_pixel(&scene.lights, &scene.cameras[0], [20, 12], [40, 24]);
    assert!(before.abs_diff_eq(after, 1e-2) && before.max_element() > 0.01, "{before} {after}");
}

/// Lights of a hall and the tiles of a view into it.
fn tiled_hall() -> (Camera, Vec<Light>) {
    let scene = build("builtin:colonnade?triangles=16384&texture=16").expect("colonnade");
    (scene.cameras[0].clone(), seeded_lights(&scene.bounds_ws(), 200, 1))
}

#[test]
fn culling_never_misses_a_light() {
    let (camera, lights) = tiled_hall();
    let size_px = [701, 393];
    let view = TileView::new(&camera, size_px[0], size_px[1]);
    let (mut listed, mut reached) = (0, 0);
    for i in (0..size_px[0] * size_px[1]).step_by(97) {
        let pixel = [i % size_px[0], i / size_px[0]];
        let ray = pixel_ray(&camera, pixel, size_px);
        let distance_m = 0.5 + f64::from(i % 23);
        let point_ws = ray.origin_ws + ray.direction_ws * distance_m;
        let tile = [pixel[0] / 16, pixel[1] / 16];
        // the tightest bounds that still hold the point
        let decisions = view.cull(tile, Some([distance_m - 1e-9, distance_m + 1e-9]), &lights);
        for (light, decision) in lights.iter().zip(decisions) {
            assert_eq!(decision.passes, decision.slack_m >= 0.0);
            listed += u32::from(decision.passes);
            if light_reaches(light, point_ws) {
                reached += 1;
                assert!(decision.passes, "pixel {pixel:?}: {decision:?}");
            }
        }
    }
    // not a test that lets all pass
    assert!(reached > 1000 && listed < 3 * reached, "{listed} listed, {reached} reached");
}

/// The mutant: ranges 2% too small must miss lights.
#[test]
fn culling_with_smaller_ranges_is_seen() {
    let (camera, lights) = tiled_hall();
    let view = TileView::new(&camera, 64, 64);
    let shrunk: Vec<_> = lights.iter().map(|l| Light { range_m: 0.98 * l.range_m, ..*l }).collect();
    let set = |lights: &[Light]| -> Vec<bool> {
        let tiles = (0..16).flat_map(|t| view.cull([t % 4, t / 4], Some([1.0, 12.0]), lights));
        tiles.map(|d| d.passes).collect()
    };
    assert_ne!(set(&lights), set(&shrunk));
}

#[test]
fn lights_without_an_end_are_on_every_list_and_empty_tiles_have_none() {
    let (camera, mut lights) = tiled_hall();
    lights[0].range_m = f32::INFINITY;
    lights[1].kind = LightKind::Directional;
    let view = TileView::new(&camera, 64, 64);
    let decisions = view.cull([0, 0], Some([1.0, 1.1]), &lights);
    assert!(decisions[0].passes && decisions[1].passes && decisions[0].slack_m == f64::INFINITY);
    assert!(view.cull([0, 0], None, &lights).iter().all(|d| !d.passes));
}

#[test]
fn tiles_take_their_bounds_from_their_pixels() {
    let (camera, _) = tiled_hall();
    let view = TileView::new(&camera, 17, 3);
    let mut distances = vec![Some(4.0); 17 * 3];
    distances[5] = Some(2.5);
    distances[16] = None;
    distances[33] = None;
    distances[50] = None;
    assert_eq!(view.distance_bounds(&distances), [Some([2.5, 4.0]), None]);
    // the tile's planes meet in the eye, and hold the middle of the tile
    let ray = pixel_ray(&camera, [8, 1], [17, 3]);
    for plane in view.side_planes([0, 0]) {
        assert!(plane.dot(ray.origin_ws.extend(1.0)).abs() < 1e-4);
        assert!(plane.dot((ray.origin_ws + 3.0 * ray.direction_ws).extend(1.0)) > 0.0);
    }
}

/// Pairs of a point in a random cluster and a light that reaches it: all, and those whose light is not on the cluster's list,
/// `taken` being the slice that is asked instead of the point's and `lights` those that lists are made of. Third: lights on the
/// lists.
fn listed(logarithmic: bool, taken: u32, range_scale: f32) -> [u32; 3] {
    let (camera, lights) = tiled_hall();
    // Every third is a spot light, of angles up to 100 degrees.
    let spot = |(i, light): (usize, &Light)| match i % 3 {
        0 => {
            let outer_angle_rad = 0.1 + 0.04 * i as f32;
            Light { kind: LightKind::Spot { inner_angle_rad: 0.0, outer_angle_rad }, ..*light }
        }
        _ => *light,
    };
    let lights: Vec<_> = lights[..40].iter().enumerate().map(spot).collect();
    let tested: Vec<_> = lights.iter().map(|l| Light { range_m: range_scale * l.range_m, ..*l }).collect();
    let size_px = [701, 393];
    let (range_m, slices) = ([0.4, 30.0], 24);
    let view = ClusterView::new(&camera, size_px, 32);
    let begins_m = slice_begins_m(range_m, slices, logarithmic);
    let forward = camera.world_from_view.matrix3.z_axis.as_dvec3() * -1.0;
    let (mut state, mut found) = (1u64, [0; 3]);
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    };
    for _ in 0..100_000 {
        let pixel = size_px.map(|size| (random() * f64::from(size)) as u32);
        let distance_m = range_m[0] * (range_m[1] / range_m[0]).powf(random());
        let ray = pixel_ray(&camera, pixel, size_px);
        let point_ws = ray.origin_ws + ray.direction_ws * (distance_m / ray.direction_ws.dot(forward));
        let inner = &begins_m[1..slices as usize];
        let slice = inner.iter().filter(|begin_m| **begin_m <= distance_m).count();
        let asked = (slice + taken as usize) % slices as usize;
        let range_m = [begins_m[asked], begins_m[asked + 1]];
        let cell = Cell { tile: view.tile(pixel), range_m, steps: u32::MAX };
        for (light, decision) in lights.iter().zip(view.cull(&cell, &tested)) {
            let reached = light_reaches(light, point_ws);
            found[0] += u32::from(reached);
            found[1] += u32::from(reached && !decision.passes);
            found[2] += u32::from(decision.passes);
        }
    }
    found
}

#[test]
fn clusters_never_miss_a_light() {
    for logarithmic in [true, false] {
        let [reached, missed, listed] = listed(logarithmic, 0, 1.0);
        let excess = f64::from(listed) / f64::from(reached);
        println!("logarithmic {logarithmic}: {listed} listed, {reached} reached: {excess:.2}");
        assert_eq!(missed, 0);
        // not a test that lets all pass
        assert!(reached > 20_000 && excess < 3.0, "{listed} listed, {reached} reached");
    }
}

/// The mutants of the test above.
#[test]
fn clusters_of_the_next_slice_or_with_smaller_ranges_are_seen() {
    assert!(listed(true, 1, 1.0)[1] > 0, "the next slice's lists go unseen");
    assert!(listed(true, 0, 0.98)[1] > 0, "ranges smaller by two percent go unseen");
}

#[test]
fn slices_are_equal_steps_or_equal_ratios() {
    assert_eq!(slice_begins_m([2.0, 10.0], 4, false), [2.0, 4.0, 6.0, 8.0, 10.0]);
    for (found, expected) in slice_begins_m([1.0, 16.0], 4, true).iter().zip([1.0, 2.0, 4.0, 8.0, 16.0]) {
        assert!((found - expected).abs() < 1e-12, "{found}, expected {expected}");
    }
}
