//! Every way in which surfaces find their lights gives the image of a loop over all of them, whatever holds the surfaces.

mod common;

use afterlight_techniques::{
    Settings, Technique, find, registry,
    scene::{Light, LightKind},
    shader::Shader,
};
use common::{Stage, compiled_variant, image_of, params, psnr};
use glam::Vec3;

/// Lights of all kinds, more than a node of the tree holds.
fn settings(stage: &Stage, samples: u32) -> Settings {
    let mut settings = stage.settings((96, 54), 120);
    let position_ws = settings.camera.eye_ws() + Vec3::new(0.1, 0.3, 0.2);
    let direction_ws = Vec3::new(0.3, -0.8, -0.5).normalize();
    let light = |kind, range_m| Light { kind, position_ws, direction_ws, intensity: Vec3::ONE, range_m };
    settings.lights.extend([
        light(LightKind::Spot { inner_angle_rad: 0.3, outer_angle_rad: 0.9 }, 20.0),
        light(LightKind::Spot { inner_angle_rad: 0.1, outer_angle_rad: 0.4 }, 30.0),
        light(LightKind::Directional, f32::INFINITY),
    ]);
    Settings { samples, ..settings }
}

/// The ways that a technique has, apart from those it chooses by itself.
fn ways(technique: &dyn Technique) -> Vec<&'static str> {
    let all = technique.params().infos().into_iter().find(|param| param.key == "lights");
    let values = all.map_or(&[][..], |param| param.kind.names());
    values.iter().copied().filter(|value| !["auto", "all"].contains(value)).collect()
}

fn agree(technique: &dyn Technique, stage: &Stage, settings: &Settings) {
    let image = |sets: &[(&str, &str)]| {
        let mut prepared = stage.prepare_with(technique, settings, &params(technique, sets));
        let image = image_of(&mut prepared);
        let counters = prepared.counters().unwrap();
        assert!(counters.iter().all(|c| c.dropped == 0), "{}: {counters:?}", technique.info().id);
        image
    };
    let reference = image(&[("lights", "all")]);
    for way in ways(technique) {
        let db = psnr(&reference, &image(&[("lights", way)]));
        println!("{} x {}: lights={way} {db:.2} dB", technique.info().id, settings.samples);
        // Sums in another order, half floats between light volumes; an edge pixel of a mask lost would be 50.
        let bound = if way == "volumes" { 54.0 } else { 65.0 };
        assert!(db >= bound, "{}: lights={way}: {db:.2} dB to lights=all", technique.info().id);
    }
}

#[test]
fn every_way_gives_the_image_of_all_lights() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let mut count = 0;
    for technique in registry() {
        if ways(*technique).is_empty() {
            continue;
        }
        count += 1;
        for samples in [1, 4] {
            let there = technique.info().samples.contains(&samples);
            if there && technique.missing(gpu.features()).is_empty() {
                agree(*technique, &stage, &settings(&stage, samples));
            }
        }
    }
    assert!(count >= 9, "{count} techniques have ways to find lights");
}

/// Tessellated surfaces, whose triangles only lists and triangle buffers hold.
#[test]
fn tessellated_surfaces_find_their_lights() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let tessellated = settings(&stage, 4).with_effects(|effects| {
        effects.tessellation.edge_px = Some(16.0);
        effects.tessellation.displacement_mm = 1e3 * 0.02;
    });
    for id in ["dais", "dais-list"] {
        agree(find(id).unwrap(), &stage, &tessellated);
    }
}

/// A shader with a mistake must be seen: the next slice, the range of another pixel, a node too few.
#[test]
fn wrong_lists_are_seen() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let settings = settings(&stage, 1);
    let technique = find("deferred").unwrap();
    let mutant = |header, from, to| -> Shader {
        compiled_variant("surfaces/gbuffer/shade.comp", header, &[(from, to)])
    };
    let image = |lights, shaders: Vec<Shader>| {
        let params = params(technique, &[("lights", lights)]);
        image_of(&mut stage.prepare_shaders(technique, &settings, &params, shaders))
    };
    let reference = image("all", Vec::new());
    for (lights, header, from, to) in [
        ("clusters", "lights/cells/cell_lists.glsl", "cell_lists[i]", "cell_lists[list.x]"),
        ("tiles", "lights/cells/cell_lists.glsl", "i < list.y;", "i + 1u < list.y;"),
        (
            "tree",
            "lights/bvh/boxes.glsl",
            "lessThanEqual(point_ws, box.high)",
            "lessThanEqual(point_ws, 0.5 * (box.low + box.high))",
        ),
        ("lists", "lights/pixel_lists/pixel_lists.glsl", "link = node.y;", "link = 0u;"),
    ] {
        let db = psnr(&reference, &image(lights, vec![mutant(header, from, to)]));
        println!("{lights}, {to}: {db:.2} dB");
        assert!(db < 50.0, "{lights}: {to} goes unseen: {db:.2} dB");
    }
}

/// The forward families by the hardware's samples.
#[test]
fn forward_families_agree_at_several_samples() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let settings = settings(&stage, 4);
    let reference = stage.image(find("forward").unwrap(), &settings);
    for id in ["clustered-forward", "tiled-forward", "forward-plus", "light-list-forward"] {
        let db = psnr(&reference, &stage.image(find(id).unwrap(), &settings));
        println!("{id} x 4: {db:.2} dB");
        assert!(db >= 50.0, "{id}: {db:.2} dB to forward at 4 samples");
    }
}

/// Tiles have a colour each, clusters several a tile; none is white, since no surface of one sample is without a cell.
#[test]
fn the_view_of_cells_shows_each_in_a_colour() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let shown = Settings { view: afterlight_techniques::views::CLUSTERS.to_owned(), ..settings(&stage, 1) };
    let colors = |id: &str| {
        let image = image_of(&mut stage.prepare(find(id).unwrap(), &shown));
        let mut tiles = std::collections::BTreeMap::new();
        for (i, pixel) in image.pixels.chunks_exact(4).enumerate() {
            let (x, y) = (i as u32 % image.width, i as u32 / image.width);
            let color = [pixel[0], pixel[1], pixel[2]];
            assert_ne!(color, [255; 3], "{id}: no cell holds ({x}, {y})");
            if color != [0; 3] {
                tiles.entry([x / 16, y / 16]).or_insert_with(std::collections::BTreeSet::new).insert(color);
            }
        }
        tiles
    };
    for id in ["tiled-forward", "forward-plus"] {
        let tiles = colors(id);
        assert!(tiles.values().all(|colors| colors.len() == 1), "{id}: a tile of several colours");
        let all: std::collections::BTreeSet<_> = tiles.values().flatten().collect();
        assert!(all.len() * 10 > tiles.len() * 9, "{id}: {} colours of {} tiles", all.len(), tiles.len());
    }
    for id in ["clustered", "visibility"] {
        let tiles = colors(id);
        let several = tiles.values().filter(|colors| colors.len() > 1).count();
        assert!(several * 2 > tiles.len(), "{id}: {several} of {} tiles have several clusters", tiles.len());
    }
}
