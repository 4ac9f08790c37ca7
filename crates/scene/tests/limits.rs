//! Limits of files, each at its edge where memory allows: `docs/limits.md` lists them.

mod load_common;

use afterlight_scene::{LoadOptions, SceneError, load};
use base64::Engine;
use load_common::Document;
use serde_json::json;

/// Loads a triangle whose texture is an image that says to have so many pixels; nothing decodes it.
fn with_image(width: u32, height: u32) -> Result<(), SceneError> {
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    png.extend(width.to_be_bytes());
    png.extend(height.to_be_bytes());
    png.extend([8, 6, 0, 0, 0]);
    let uri = format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png));
    let mut d = Document::new();
    let positions = d.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    d.json["images"] = json!([{ "uri": uri }]);
    d.json["textures"] = json!([{"source": 0}]);
    d.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}, "material": 0}]}]);
    d.load().map(|_| ())
}

#[test]
fn an_image_has_at_most_2_to_the_28_pixels() {
    with_image(1 << 14, 1 << 14).unwrap_or_else(|e| panic!("{e}"));
    let error = with_image(1 << 14, (1 << 14) + 1).expect_err("too many pixels").to_string();
    assert!(error.contains("found 268451840, expected at most 268435456"), "{error}");
}

/// A file without content on the disk; one of exactly the limit would be read into memory.
#[test]
fn a_file_has_at_most_2_to_the_32_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.glb");
    std::fs::File::create(&path).and_then(|file| file.set_len((1 << 32) + 1)).expect("a sparse file");
    let error = load(&path, &LoadOptions::default()).expect_err("too large").to_string();
    assert!(error.contains("found 4294967297, expected at most 4294967296"), "{error}");
}
