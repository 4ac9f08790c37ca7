//! Multisampled G-buffers are lit where `forward` lights surfaces: at the pixel's centre, from a sample's depth and 15 bits of its fragment.

mod common;

use afterlight_techniques::scene::{Camera, lights::seeded_lights};
use afterlight_techniques::{Settings, find};
use common::{Stage, compiled_variant, found_by, image_of, least_db, params, psnr, random_views};
use glam::Vec3;

/// Greatest error of 65,536 depths at the centre: over 1/256 of what depth changes within the pixel and 2^-24 of the depth, which is
/// promised. Parts of the header's text are replaced.
fn worst_error(stage: &Stage, replaced: &[(&str, &str)]) -> f64 {
    let header = ("surfaces/samples/center_depth.glsl", replaced);
    let floats = found_by(stage, "center_depth.comp", header, (4 << 16, 1024));
    let error = |found: &[f64]| {
        let [center, change, sample, read] = [found[0], found[1], found[2], found[3]];
        (read - center).abs() / (change / 256.0 + 2f64.powi(-24) * (center.abs() + sample))
    };
    floats.chunks_exact(4).map(error).fold(0.0, f64::max)
}

#[test]
fn depth_at_the_centre_is_off_by_a_256th_of_its_change() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let error = worst_error(&stage, &[]);
    println!("{error:.3} of what is promised");
    assert!(error <= 1.0, "{error:.3} times what is promised");
    for (from, to) in [
        // The difference is not taken modulo 512.
        ("<< 23 >> 23", ""),
        // Steps of half the number that the change asks for.
        ("exponent + 1 - CENTER_STEP_BITS", "exponent - CENTER_STEP_BITS"),
        // Cut down instead of rounded.
        ("int(round(depth *", "int(floor(depth *"),
        // The margin for rounding is missing.
        ("abs(depth) * DEPTH_ROUNDING", "0.0"),
    ] {
        let error = worst_error(&stage, &[(from, to)]);
        println!("{from:?} replaced by {to:?}: {error:.3}");
        assert!(error > 1.2, "{from:?} replaced by {to:?}: {error:.3} of the bound, a mutant within it");
    }
}

/// Views that nobody chose: small, so that light changes within pixels. Where samples are lit at their own places, some of them fail.
#[test]
fn random_views_agree_with_forward() {
    let mut worst_at_samples = f64::INFINITY;
    random_views(12, |stage, settings, reference, what| {
        for id in ["deferred-ssaa", "deferred-msaa"] {
            let technique = find(id).unwrap();
            for set in [&[][..], &[("lights", "all")], &[("position", "sample")]] {
                let params = params(technique, set);
                let db = psnr(reference, &image_of(&mut stage.prepare_with(technique, settings, &params)));
                println!("{what}: {id} {set:?}: {db:.2} dB");
                let least = least_db(technique, &params, 4);
                assert!(db >= least, "{what}: {id} {set:?}: {db:.2} dB, {least} promised");
                if set.first().is_some_and(|(key, _)| *key == "position") {
                    worst_at_samples = worst_at_samples.min(db);
                }
            }
        }
    });
    println!("lit at samples: {worst_at_samples:.2} dB at worst");
    assert!(worst_at_samples < 38.0, "light at samples stays within the bound of light at centres");
}

/// A floor from seven millimetres above it, whose horizon crosses the image: found by `verify`. In a row of pixels the floor shows at samples and
/// ends before the centre.
fn over_the_floor(stage: &Stage) -> Settings {
    let eye = Vec3::new(-17.001467, 0.0069989935, -18.276127);
    let target = Vec3::new(13.449717, -1.3485626, -44.177635);
    let camera = Camera::look_at("floor", eye, target, 118.5114f32.to_radians(), 0.004);
    let lights = seeded_lights(&stage.scene.bounds_ws(), 1041, 3164818517);
    Settings { samples: 4, lights, ..stage.from(camera, (72, 48), 0) }
}

/// Every technique lights a surface that ends within its pixel at the same place, by whatever way it has to the surface's distance; each way
/// is left out once, as a mutant.
#[test]
fn surfaces_that_end_within_a_pixel_are_lit_alike() {
    let gpu = afterlight_testkit::gpu();
    if afterlight_testkit::sample_counts(&gpu, &[4]).is_empty() {
        return;
    }
    let stage = Stage::new(&gpu, "builtin:floor");
    let settings = over_the_floor(&stage);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let header = "center_distance.glsl";
    let as_it_was = [("frame.samples <= 1u ||", "true ||")];
    for (id, set, shader) in [
        ("deferred-ssaa", &[][..], "surfaces/samples/samples.frag"),
        ("deferred-msaa", &[], "surfaces/samples/samples.frag"),
        ("deferred-dedup", &[], "deferred_dedup/dedup.frag"),
        ("gbuffer-list", &[("fill", "compute"), ("position", "distance")], "gbuffer_list/fill.comp"),
        ("dais", &[("lights", "all")], "dais/shade.comp"),
        ("dais-multirate", &[("lights", "volumes")], "dais/volume.frag"),
    ] {
        let technique = find(id).unwrap();
        let params = params(technique, set);
        let db = |shaders: Vec<_>| {
            psnr(&reference, &image_of(&mut stage.prepare_shaders(technique, &settings, &params, shaders)))
        };
        let (here, mutant) = (db(Vec::new()), db(vec![compiled_variant(shader, header, &as_it_was)]));
        println!("{id} {set:?}: {here:.2} dB, {mutant:.2} as it was");
        let least = least_db(technique, &params, 4);
        assert!(here >= least, "{id} {set:?}: {here:.2} dB, {least} promised");
        assert!(mutant < here - 10.0, "{id} {set:?}: {mutant:.2} dB as it was, a mutant that does no harm");
    }
}

/// A fragment whose surface ends within its pixel looks for lights in the cell where it is lit. At the pixel's centre its plane is elsewhere, in a
/// cell with other lights: found by `verify` in Sponza, looking along a wall.
#[test]
fn cells_are_those_where_surfaces_are_lit() {
    let gpu = afterlight_testkit::gpu();
    let Some(scenes) = afterlight_testkit::shared_scenes() else { return };
    if afterlight_testkit::sample_counts(&gpu, &[4]).is_empty() {
        return;
    }
    let stage = Stage::new(&gpu, &scenes.join("sponza/sponza.gltf").to_string_lossy());
    let eye = Vec3::new(10.824047, 5.515173, -9.104732);
    let target = Vec3::new(39.249557, 14.290485, -9.321085);
    let camera = Camera::look_at("wall", eye, target, 89.47637f32.to_radians(), 0.002975);
    let lights = seeded_lights(&stage.scene.bounds_ws(), 3391, 3603696452);
    let settings = Settings { samples: 4, lights, ..stage.from(camera, (114, 128), 0) };
    let reference = stage.image(find("forward").unwrap(), &settings);
    let technique = find("clustered-forward").unwrap();
    let params = params(technique, &[("cluster-px", "256"), ("slices", "64")]);
    let db = |shaders: Vec<_>| {
        psnr(&reference, &image_of(&mut stage.prepare_shaders(technique, &settings, &params, shaders)))
    };
    let header = "surfaces/depth_first/shade_visible.glsl";
    let replaced = [("frame.samples > 1u ? distance_from_position(s.position_ws) :", "")];
    let mutant = compiled_variant("surfaces/depth_first/by_lights.frag", header, &replaced);
    let (here, mutant) = (db(Vec::new()), db(vec![mutant]));
    println!("clustered-forward: {here:.2} dB, {mutant:.2} by the plane's cell");
    assert!(here >= least_db(technique, &params, 4), "{here:.2} dB");
    assert!(mutant < 40.0, "{mutant:.2} dB by the plane's cell, a mutant within the bound");
}

/// Where a device's centroids tell no edge, as Vulkan lets them, fragments that differ within a pixel do: silhouettes, edges between
/// triangles and intersections.
#[test]
fn edges_are_found_without_centroids() {
    let gpu = afterlight_testkit::gpu();
    let technique = find("deferred-msaa").unwrap();
    let shader = "surfaces/samples/samples.frag";
    let replaced = [("edge ? word | SAMPLE_EDGE : word", "word")];
    let unmarked = compiled_variant(shader, &format!("{shader}.glsl"), &replaced);
    for scene in ["builtin:spheres", "builtin:intersect"] {
        let stage = Stage::new(&gpu, scene);
        let settings = Settings { samples: 4, ..stage.settings((161, 91), 20) };
        let reference = stage.image(find("forward").unwrap(), &settings);
        for lights in ["all", "clusters"] {
            let db = |edges: &str| {
                let params = params(technique, &[("lights", lights), ("edges", edges)]);
                let mut prepared = stage.prepare_shaders(technique, &settings, &params, [unmarked.clone()]);
                psnr(&reference, &image_of(&mut prepared))
            };
            let (fragments, centroid) = (db("fragments"), db("centroid"));
            println!(
                "{scene}, lights={lights}: {fragments:.2} dB by fragments, {centroid:.2} by centroids that tell none"
            );
            assert!(fragments >= 45.0, "{scene}, lights={lights}: {fragments:.2} dB to forward");
            assert!(centroid < 38.0, "{scene}, lights={lights}: {centroid:.2} dB without edges");
        }
    }
}
