//! Every sample file: valid ones load; broken ones give one line or load where the break is
//! cosmetic, and never panic.

mod load_common;

use std::path::{Path, PathBuf};

use afterlight_scene::{LoadOptions, Scene, SceneError, load};
use load_common::{check_scene, files_under, scenes_dir};

fn load_file(path: &Path) -> Result<Scene, SceneError> {
    load(path, &LoadOptions::default())
}

#[test]
fn valid_samples_load() {
    let Some(dir) = scenes_dir() else { return };
    let mut count = 0;
    for folder in ["khronos", "assimp", "blender_io"] {
        for file in files_under(&dir.join("samples").join(folder), &["gltf", "glb", "obj"]) {
            let scene = load_file(&file).unwrap_or_else(|e| panic!("{e}"));
            check_scene(&scene).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
            assert!(scene.triangle_count() > 0, "{}: nothing drawn", file.display());
            for image in &scene.images {
                use afterlight_scene::texture::{TextureRole, decode};
                let chain = decode(image, TextureRole::BaseColor, None).unwrap_or_else(|e| panic!("{e}"));
                assert_eq!((chain.width, chain.height), (image.width, image.height), "{}", image.name);
            }
            count += 1;
        }
    }
    assert!(count >= 31, "only {count} samples found");
}

/// Errors of the validator that this loader tolerates, and why.
const TOLERATED: &[(&str, &str)] = &[
    ("EMPTY_ENTITY", "an empty array holds nothing that could be wrong"),
    ("UNSATISFIED_DEPENDENCY", "a property that has no effect without another one"),
    ("ACCESSOR_MIN_MISMATCH", "declared bounds are not used: boxes come from the vertices"),
    ("ACCESSOR_MAX_MISMATCH", "declared bounds are not used"),
    ("ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND", "declared bounds are not used"),
    ("ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND", "declared bounds are not used"),
    ("ANIMATION_SAMPLER_INPUT_ACCESSOR_WITHOUT_BOUNDS", "declared bounds are not used"),
    ("MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS", "declared bounds are not used"),
    ("ACCESSOR_NON_CLAMPED", "colours are clamped"),
    ("ACCESSOR_VECTOR3_NON_UNIT", "normals and tangents are made unit"),
    ("ACCESSOR_INVALID_SIGN", "of a tangent's w the sign is taken"),
    ("ROTATION_NON_UNIT", "rotations are made unit"),
    ("ANIMATION_SAMPLER_OUTPUT_NON_NORMALIZED_QUATERNION", "rotations are made unit"),
    ("ACCESSOR_ANIMATION_SAMPLER_OUTPUT_NON_NORMALIZED_QUATERNION", "rotations are made unit"),
    (
        "ANIMATION_CHANNEL_TARGET_NODE_WEIGHTS_NO_MORPHS",
        "weights of what has no targets are left out, with a warning",
    ),
    ("BUFFER_VIEW_TOO_BIG_BYTE_STRIDE", "every element that is read is checked to be in range"),
    ("BUFFER_VIEW_INVALID_BYTE_STRIDE", "the stride is used as it is, in range"),
    ("MESH_PRIMITIVE_ACCESSOR_WITHOUT_BYTESTRIDE", "elements that lie close together are read as such"),
    ("MESH_PRIMITIVE_INDICES_ACCESSOR_WITH_BYTESTRIDE", "the stride is used as it is, in range"),
    ("SKIN_IBM_ACCESSOR_WITH_BYTESTRIDE", "the stride is used as it is, in range"),
    ("MESH_PRIMITIVE_ACCESSOR_UNALIGNED", "bytes are read whatever their alignment"),
    ("BUFFER_VIEW_TARGET_OVERRIDE", "targets are hints for uploading, not used"),
    ("MESH_PRIMITIVE_INVALID_ATTRIBUTE", "attributes of unknown names are ignored"),
    ("MESH_PRIMITIVE_INDEXED_SEMANTIC_CONTINUITY", "sets are found by their numbers"),
    (
        "MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR",
        "a target of an attribute that is not there changes nothing",
    ),
    ("MESH_PRIMITIVE_TOO_FEW_TEXCOORDS", "texture coordinates are 0, with a warning"),
    ("MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_UNSIGNED_INT", "an application's own attribute, ignored"),
    ("DUPLICATE_ELEMENTS", "an extension named twice is the same extension"),
    ("UNDECLARED_EXTENSION", "an extension that is not declared is used where it is known"),
    ("NODE_SKIN_WITH_NON_SKINNED_MESH", "a mesh without joints is drawn without the skin"),
    ("SKIN_NO_COMMON_ROOT", "each joint's own place is used"),
    ("SKIN_SKELETON_INVALID", "the skeleton's root is a hint, not used"),
    ("ACCESSOR_INVALID_IBM", "the last row of a bind matrix is taken as 0, 0, 0, 1, with a warning"),
];

/// Files that are judged otherwise than the validator does, and why.
const EXCEPTIONS: &[(&str, &str)] = &[
    // broken parts that nothing uses
    ("accessor_data/invalid_elements_float.gltf", "values of accessors that nothing uses are not read"),
    ("image/buffer_view_bytestride.gltf", "no material uses the image"),
    ("image/empty_object.gltf", "no material uses the image"),
    ("image/invalid_data_uri.gltf", "no material uses the image"),
    ("image/invalid_data_uri_mime_type.gltf", "no material uses the image"),
    ("image/invalid_image_data.gltf", "no material uses the image"),
    ("image/invalid_uri_scheme.gltf", "no material uses the image"),
    ("image/not_found.gltf", "no material uses the image"),
    ("image/png_eos.gltf", "no material uses the image"),
    ("mesh_data/joints_weights_complex.gltf", "no node draws the mesh"),
    ("root/extensions_non_objects.gltf", "extensions that are not known are not read"),
    ("buffer/invalid_uri_data.gltf", "an empty parameter in the media type: the bytes are whole"),
    // valid, but not for this program
    ("accessor/unknown_type.gltf", "an element type that glTF 2.0 does not have"),
    ("animation/valid.gltf", "the keys have no data, so that all times are 0"),
    ("skin/ignored_animated_transform.gltf", "the keys have no data, so that all times are 0"),
    ("asset/min_version_valid.gltf", "asks for a reader of glTF 2.1"),
    ("buffer/non_relative_uri.gltf", "nothing is fetched from a network"),
    ("camera/perspective_yfov.gltf", "a view angle of more than half a turn"),
    ("root/named_objects.gltf", "its animation has no data"),
    ("root/unused_objects.gltf", "its animation has no data"),
];

struct Verdict {
    error_codes: Vec<String>,
}

fn verdict(file: &Path) -> Option<Verdict> {
    let report = PathBuf::from(format!("{}.report.json", file.display()));
    let text = std::fs::read_to_string(report).ok()?;
    let report: serde_json::Value = serde_json::from_str(&text).ok()?;
    let messages = report["issues"]["messages"].as_array().cloned().unwrap_or_default();
    let codes = messages.iter().filter(|m| m["severity"] == 0).filter_map(|m| m["code"].as_str());
    Some(Verdict { error_codes: codes.map(str::to_owned).collect() })
}

#[test]
fn invalid_samples_are_judged_as_the_validator_does() {
    let Some(dir) = scenes_dir() else { return };
    let root = dir.join("samples/invalid/khronos_validator");
    let files = files_under(&root, &["gltf", "glb"]);
    assert!(files.len() >= 200, "only {} files found", files.len());
    let mut wrong = Vec::new();
    let mut excepted = Vec::new();
    for file in &files {
        let name = file.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
        let result = load_file(file);
        check_result(file, &result);
        let Some(verdict) = verdict(file) else { continue };
        let broken = !verdict.error_codes.is_empty();
        let tolerated = verdict.error_codes.iter().all(|c| TOLERATED.iter().any(|t| t.0 == c));
        let agrees = if broken { result.is_err() || tolerated } else { result.is_ok() };
        match (agrees, EXCEPTIONS.iter().any(|e| e.0 == name)) {
            (true, false) => {}
            (false, true) => excepted.push(name),
            (true, true) => wrong.push(format!("{name}: listed as an exception, but is judged alike")),
            (false, false) => {
                let found = result.err().map_or("loads".to_owned(), |e| e.to_string());
                wrong.push(format!("{name}: validator {:?}, here {found}", verdict.error_codes));
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {} differ:\n{}", wrong.len(), files.len(), wrong.join("\n"));
    assert_eq!(excepted.len(), EXCEPTIONS.len(), "an exception names no file");
}

/// A result is a sound scene or one line that names a file.
fn check_result(file: &Path, result: &Result<Scene, SceneError>) {
    match result {
        Ok(scene) => check_scene(scene).unwrap_or_else(|e| panic!("{}: {e}", file.display())),
        Err(e) => {
            let text = e.to_string();
            assert!(!text.contains('\n') && !text.is_empty(), "{}: {text:?}", file.display());
            assert!(text.starts_with(&*dirname(file)), "{}: does not name a file: {text}", file.display());
        }
    }
}

fn dirname(file: &Path) -> String {
    file.parent().unwrap().display().to_string()
}

/// Files of other suites: what the message must hold, or `None` where the file loads and why.
const OTHERS: &[(&str, Option<&str>)] = &[
    // normals of length 0 are made from the faces
    ("BoxBadNormals.glb", None),
    ("BoxWithInfinites.glb", Some("inf")),
    ("Cube.gltf", Some("bufferViews[2]")),
    ("AllIndicesOutOfRange.gltf", Some("65535")),
    ("IndexOutOfRange.gltf", Some("255")),
    ("BoxTextured.gltf", Some("BoxTextured0.bin")),
    ("RecursiveNodes.gltf", Some("its own descendants")),
    ("sceneWrongType.gltf", Some("line 6")),
    ("NoScene.gltf", Some("scene: found 0")),
    // a scene may be empty
    ("SceneWithoutNodes.gltf", None),
    ("badArray.gltf", Some("expected a sequence")),
    ("badExtension.gltf", Some("TextureTransform")),
    ("badNumber.gltf", Some("expected f32")),
    ("badObject.gltf", Some("line 125")),
    ("badString.gltf", Some("expected a string")),
    ("badUint.gltf", Some("integer `-1`")),
    ("integer-out-of-bounds.gltf", Some("1e+300")),
    ("invalid-buffer-index.gltf", Some("bufferViews[1].buffer")),
    ("invalid-buffer-view-index.gltf", Some("accessors[0].bufferView")),
    ("invalid-primitive-indices.gltf", Some("accessors[0].bufferView")),
    // a skeleton that is not given is not needed
    ("unassigned-skeleton.gltf", None),
    // an empty BIN chunk before none at all
    ("zero-sized-bin-chunk-issue-440.glb", None),
    ("14_emission_strength.gltf", Some("KHR_materials_pbrSpecularGlossiness")),
];

#[test]
fn other_invalid_samples_end_in_a_line() {
    let Some(dir) = scenes_dir() else { return };
    let root = dir.join("samples/invalid");
    let mut count = 0;
    for folder in ["assimp", "tinygltf", "unsupported_required_extension"] {
        for file in files_under(&root.join(folder), &["gltf", "glb"]) {
            let result = load_file(&file);
            check_result(&file, &result);
            let name = file.file_name().unwrap().to_string_lossy().into_owned();
            let expected =
                OTHERS.iter().find(|o| o.0 == name).unwrap_or_else(|| panic!("{name} is not listed")).1;
            match (result.err().map(|e| e.to_string()), expected) {
                (None, None) => {}
                (Some(text), Some(part)) if text.contains(part) => {}
                (found, expected) => panic!("{name}: {found:?}, expected {expected:?}"),
            }
            count += 1;
        }
    }
    assert_eq!(count, OTHERS.len());
}
