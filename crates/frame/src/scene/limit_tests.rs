//! Limits of a scene on the device, each at its edge: `docs/limits.md` lists them.

use std::sync::Arc;

use afterlight_graph::gpu::Features;
use afterlight_scene::{
    Image, ImageData, Instance, Material, Mesh, Node, Sampler, Scene, TextureRef, Wrap, load_source,
};

use super::{
    DRAW_TRIANGLES,
    draws::{DRAWS_MAX, DrawTable, check_count},
    pieces::compact_pieces,
    textures::TextureTable,
};

/// Draws of the furnace's first sphere, cut down or repeated to so many triangles.
fn draws_of(triangles: u32) -> Vec<u32> {
    let mut scene =
        load_source("builtin:furnace?segments=32", &Default::default()).unwrap_or_else(|e| panic!("{e}"));
    let mesh: Mesh = scene.meshes[0].clone();
    let node: Node = scene.nodes[0].clone();
    let instance: Instance = Instance { mesh: 0, node: 0, ..scene.instances[0].clone() };
    let first = mesh.first_index as usize;
    let own = scene.indices[first..first + mesh.index_count as usize].to_vec();
    scene.indices = own.iter().copied().cycle().take(3 * triangles as usize).collect();
    scene.meshes = vec![Mesh { first_index: 0, index_count: 3 * triangles, ..mesh }];
    (scene.nodes, scene.instances) = (vec![node], vec![instance]);
    let (_, pieces) = compact_pieces(&scene);
    let table = DrawTable::new(&scene, &pieces).unwrap_or_else(|e| panic!("{e}"));
    table.infos.iter().map(|draw| draw.index_count / 3).collect()
}

#[test]
fn a_draw_has_at_most_1024_triangles() {
    assert_eq!(DRAW_TRIANGLES, 1024);
    assert_eq!(draws_of(1024), [1024]);
    assert_eq!(draws_of(1025), [1024, 1], "one triangle more is another draw");
    assert_eq!(draws_of(2048), [1024, 1024]);
}

#[test]
fn more_draws_than_triangle_ids_tell_apart_are_told() {
    assert_eq!(DRAWS_MAX, 4_194_302);
    assert!(check_count(DRAWS_MAX).is_ok());
    // The last triangle of the last draw is not the ID of no surface.
    assert!((DRAWS_MAX as u32 - 1) << 10 | 1023 < u32::MAX);
    let error = check_count(DRAWS_MAX + 1).expect_err("an ID would be that of no surface").to_string();
    assert!(error.contains("4194303") && error.contains("4194302"), "{error}");
}

/// A scene whose materials have one colour texture each, of these sizes and samplers.
fn textured(textures: &[(u32, u32, Sampler)]) -> Scene {
    let image = |(width, height, _): &(u32, u32, Sampler)| Image {
        name: format!("{width} by {height}"),
        data: ImageData::Encoded(Arc::from(Vec::new())),
        width: *width,
        height: *height,
    };
    let material = |(image, (.., sampler)): (usize, &(u32, u32, Sampler))| Material {
        base_color_texture: Some(TextureRef {
            image: image as u32,
            sampler: *sampler,
            uv_set: 0,
            uv_transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        }),
        ..Material::default()
    };
    Scene {
        images: textures.iter().map(image).collect(),
        materials: textures.iter().enumerate().map(material).collect(),
        ..Scene::default()
    }
}

/// Layers of an image of the device that textures are planned for.
const LAYERS: usize = 13;

/// The plan of textures on a device of small images and few layers: buckets of colours, warnings; or the error.
fn planned(textures: &[(u32, u32, Sampler)]) -> Result<(u32, Vec<String>), String> {
    let mut features = Features::default();
    features.max_image_dimension_2d = 64;
    features.max_array_layers = LAYERS as u32;
    let mut warnings = Vec::new();
    let table = TextureTable::plan(&textured(textures), &features, &mut warnings);
    Ok((table.map_err(|error| error.to_string())?.bucket_counts()[0], warnings))
}

#[test]
fn textures_are_as_large_and_as_many_as_the_device_takes() {
    let plain = Sampler::default();
    assert_eq!(planned(&[(64, 64, plain)]), Ok((1, vec![])));
    let error = planned(&[(65, 1, plain)]).expect_err("too wide");
    assert!(error.contains("65 by 1") && error.contains("found 65") && error.contains("64"), "{error}");
    // Layers of one size.
    assert_eq!(planned(&[(8, 8, plain); LAYERS]), Ok((1, vec![])));
    let error = planned(&[(8, 8, plain); LAYERS + 1]).expect_err("too many layers");
    assert!(error.contains("8×8") && error.contains("found 14"), "{error}");
}

/// Twelve sizes and samplers of colours stay as they are; one more is resampled, which is told.
#[test]
fn more_sizes_of_textures_than_arrays_are_told() {
    let sized = |count: u32| (1..=count).map(|size| (size, 1, Sampler::default())).collect::<Vec<_>>();
    assert_eq!(planned(&sized(12)), Ok((12, vec![])));
    let (buckets, warnings) = planned(&sized(13)).unwrap_or_else(|e| panic!("{e}"));
    assert!(
        buckets <= 12 && warnings.len() == 1 && warnings[0].contains("13 sizes"),
        "{buckets}: {warnings:?}"
    );
    // Samplers are kept apart as long as there is room.
    let clamped = Sampler { wrap_u: Wrap::Clamp, ..Sampler::default() };
    assert_eq!(planned(&[(8, 8, Sampler::default()), (8, 8, clamped)]), Ok((2, vec![])));
}
