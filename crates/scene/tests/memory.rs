//! Scenes from memory are, to the bit, those of a file with the same content; what is wrong with a source is named.

mod load_common;

use std::{path::Path, sync::Arc};

use afterlight_scene::{
    ImageData, LoadOptions, Material, MeshSource, Sampler, SceneBuilder, TextureRef, load_bytes,
};
use glam::{Affine3A, Vec3};
use load_common::Document;
use serde_json::json;

const POSITIONS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [1.0, 1.0, 0.0], [0.0, 1.0, 0.4]];
const NORMALS: [[f32; 3]; 4] = [[0.1, 0.0, 1.0], [0.0, 0.2, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]];
const UVS: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [0.8, 0.0], [0.3, 0.1]];
const COLORS: [[f32; 4]; 4] = [[1.0, 0.5, 0.25, 1.0], [0.1, 0.2, 0.3, 0.4], [0.0; 4], [1.0; 4]];
const INDICES: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// A texture of image 0.
fn texture() -> TextureRef {
    let uv_transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    TextureRef { image: 0, sampler: Sampler::default(), uv_set: 0, uv_transform }
}

#[test]
fn a_scene_from_memory_is_that_of_a_file() {
    // The header, which is all that loading reads.
    let png: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x08\0\0\0\x04\x08\x02\0\0\0";
    let mut file = Document::new();
    let [positions, normals] = [&POSITIONS, &NORMALS].map(|values| file.floats(values));
    let (uvs, colors, indices) = (file.floats(&UVS), file.floats(&COLORS), file.indices(&INDICES, 4));
    let view = file.view(png, None);
    file.json["images"] = json!([{"name": "bumps", "bufferView": view, "mimeType": "image/png"}]);
    file.json["textures"] = json!([{"source": 0}]);
    file.json["materials"] = json!([{"name": "bumpy", "normalTexture": {"index": 0}}]);
    let whole = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors});
    file.json["meshes"] = json!([{"primitives": [
        {"attributes": whole, "indices": indices, "material": 0},
        {"attributes": {"POSITION": positions}, "indices": indices, "material": 0},
    ]}]);
    file.json["nodes"] = json!([{"mesh": 0, "translation": [1.0, 2.0, 3.0]}]);
    let options = LoadOptions::default();
    let loaded = load_bytes(Path::new("memory.glb"), &file.glb(), &options).expect("a scene");

    let mut builder = SceneBuilder::new("memory");
    let image = builder.image("bumps", ImageData::Encoded(Arc::from(png))).expect("an image");
    assert_eq!(image.index(), 0);
    let bumpy = Material { name: "bumpy".to_owned(), normal_texture: Some(texture()), ..Material::default() };
    let bumpy = builder.material(bumpy).expect("a material");
    let (normals_os, uvs) = (&NORMALS[..], [&UVS[..], &[]]);
    let bare = MeshSource { positions_os: &POSITIONS, indices: &INDICES, ..MeshSource::default() };
    let whole = MeshSource { normals_os, uvs, colors: &COLORS, ..bare };
    let place = Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0));
    for source in [whole, bare] {
        let mesh = builder.mesh("mesh", &source, bumpy).expect("a mesh");
        builder.instance("instance", mesh, place).expect("an instance");
    }
    let made = builder.finish();

    assert_eq!(made.positions_os, loaded.positions_os);
    assert_eq!(made.attributes, loaded.attributes);
    assert_eq!(made.indices, loaded.indices);
    assert_eq!(made.materials, loaded.materials);
    assert_eq!(made.cameras, loaded.cameras);
    assert_eq!(made.meshes.len(), 2);
    for (made, loaded) in made.meshes.iter().zip(&loaded.meshes) {
        let name = loaded.name.clone();
        assert_eq!(&afterlight_scene::Mesh { name, ..made.clone() }, loaded);
    }
    let placed = |scene: &afterlight_scene::Scene| -> Vec<_> {
        scene.instances.iter().map(|one| (one.mesh, one.world_from_object)).collect()
    };
    assert_eq!(placed(&made), placed(&loaded));
    assert_eq!(
        [made.images[0].width, made.images[0].height],
        [loaded.images[0].width, loaded.images[0].height]
    );
}

#[test]
fn what_is_wrong_is_named() {
    let mut builder = SceneBuilder::new("broken");
    let material = builder.material(Material::default()).expect("a material");
    let good = MeshSource { positions_os: &POSITIONS, indices: &INDICES, ..MeshSource::default() };
    let infinite = [[f32::INFINITY; 3]; 3];
    for (source, message) in [
        (MeshSource { normals_os: &NORMALS[..2], ..good }, "found 2 normals, expected none or 4"),
        (MeshSource { indices: &[0, 1, 4], ..good }, "found index 4, expected one below 4"),
        (MeshSource { indices: &[0, 1], ..good }, "found 2 corners, expected three a triangle"),
        (MeshSource::default(), "found 0 corners"),
        (MeshSource { positions_os: &infinite, ..MeshSource::default() }, "NaN or infinity among positions"),
    ] {
        let error = builder.mesh("quad", &source, material).expect_err(message).to_string();
        assert!(error.starts_with("scene from memory: mesh quad: ") && error.contains(message), "{error}");
    }
    let pixels = ImageData::Rgba8 { width: 2, height: 2, pixels: Arc::from([0; 15]) };
    let error = builder.image("small", pixels).expect_err("a byte is lacking").to_string();
    assert!(error.contains("image small: found 15 bytes for 2 x 2 pixels"), "{error}");
    let textured = Material { base_color_texture: Some(texture()), ..Material::default() };
    assert!(builder.material(textured).expect_err("no image").to_string().contains("image 0"));
    let mut other = SceneBuilder::new("other");
    let error = other.mesh("quad", &good, material).expect_err("another scene's").to_string();
    assert!(error.contains("found material 0, expected one of 0"), "{error}");
    assert!(builder.finish().meshes.is_empty(), "what is refused leaves nothing");
}
