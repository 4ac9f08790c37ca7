//! GLB chunks and JSON: bytes to a typed document whose extensions are known.

use std::path::Path;

use gltf::json::{self, Root, Value};

use super::node::Places;
use crate::SceneError;

/// Extensions that are understood in full, so that a file may require them.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// The JSON and the binary chunk of a file.
pub(super) struct Container<'a> {
    pub(super) root: Root,
    /// Where nodes are, in 64 bits.
    pub(super) places: Places,
    /// The BIN chunk; `None` in a `.gltf` or where the GLB has none.
    pub(super) bin: Option<&'a [u8]>,
    pub(super) is_glb: bool,
    pub(super) warnings: Vec<String>,
}

/// Reads GLB or JSON, told apart by GLB's first bytes or the name's extension.
pub(super) fn parse<'a>(file: &Path, bytes: &'a [u8]) -> Result<Container<'a>, SceneError> {
    let named_glb = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    let is_glb = named_glb || bytes.starts_with(b"glTF");
    let (json, bin) = if is_glb { split_glb(file, bytes)? } else { (bytes, None) };
    let root = parse_json(file, json)?;
    let mut warnings = Vec::new();
    check_version(file, &root)?;
    check_extensions(file, &root, &mut warnings)?;
    let places = Places::read(&root, json);
    Ok(Container { root, places, bin, is_glb, warnings })
}

const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;

/// Splits a GLB (glTF 2.0, chapter 4) into its JSON and its BIN chunk.
fn split_glb<'a>(file: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>), SceneError> {
    let wrong = |at: &str, found: String, expected: &str| SceneError::invalid(file, at, found, expected);
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(magic), Some(version), Some(length)) = (word(0), word(4), word(8)) else {
        return Err(wrong("GLB header", format!("{} bytes", bytes.len()), "12 bytes or more"));
    };
    if magic != u32::from_le_bytes(*b"glTF") {
        return Err(wrong("GLB header", format!("the first word {magic:#010x}"), "glTF (0x46546c67)"));
    }
    if version != 2 {
        return Err(wrong("GLB header", format!("version {version}"), "version 2"));
    }
    let length = length as usize;
    if length < 20 || length > bytes.len() {
        return Err(wrong(
            "GLB header",
            format!("a length of {length} bytes"),
            &format!("20 up to the {} bytes of the file", bytes.len()),
        ));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    let mut chunk_index = 0;
    while at < length {
        let place = format!("GLB chunk {chunk_index}");
        let (Some(chunk_bytes), Some(kind)) = (word(at), word(at + 4)) else {
            return Err(wrong(&place, format!("{} bytes of header", length - at), "8 bytes"));
        };
        let start = at + 8;
        let chunk_bytes = chunk_bytes as usize;
        if start > length || chunk_bytes > length - start {
            return Err(wrong(
                &place,
                format!("a length of {chunk_bytes} bytes"),
                &format!("at most the {} bytes that remain", length.saturating_sub(start)),
            ));
        }
        if !chunk_bytes.is_multiple_of(4) {
            return Err(wrong(&place, format!("a length of {chunk_bytes} bytes"), "a multiple of 4"));
        }
        let data = &bytes[start..start + chunk_bytes];
        match (chunk_index, kind) {
            (0, CHUNK_JSON) if data.is_empty() => {
                return Err(wrong(&place, "an empty JSON chunk".to_owned(), "a JSON object"));
            }
            (0, CHUNK_JSON) => json = Some(data),
            (0, _) => return Err(wrong(&place, format!("type {kind:#010x}"), "JSON (0x4e4f534a)")),
            (1, CHUNK_BIN) => bin = Some(data),
            (_, CHUNK_JSON | CHUNK_BIN) => {
                let expected = "one JSON chunk, then at most one BIN chunk";
                return Err(wrong(&place, format!("another chunk of type {kind:#010x}"), expected));
            }
            // chunks of other types are extensions, to be ignored
            _ => {}
        }
        at = start + chunk_bytes;
        chunk_index += 1;
    }
    let json = json.ok_or_else(|| wrong("GLB", "no chunk".to_owned(), "a JSON chunk"))?;
    Ok((json, bin))
}

/// Parses JSON into the typed document. The typed reader is stricter than glTF in a few points
/// (an integer may be written `1.0`, extras may be anything, a scene may have no nodes): what it
/// refuses is read by way of untyped JSON.
fn parse_json(file: &Path, text: &[u8]) -> Result<Root, SceneError> {
    let wrong = |e: &json::Error| SceneError::invalid(file, "JSON", e.to_string(), "glTF 2.0");
    if text.starts_with(b"\xEF\xBB\xBF") {
        return Err(SceneError::invalid(file, "JSON", "a byte order mark", "UTF-8 without one"));
    }
    // `Root::from_slice` alone reads the typed document: each other reader of it, from a value or a type of text, would be
    // compiled here once more, for most of this crate's time.
    let first_error = match Root::from_slice(text) {
        Ok(root) => return Ok(root),
        Err(e) => e,
    };
    let mut value: Value = json::deserialize::from_slice(text).map_err(|e| wrong(&e))?;
    if !value.is_object() {
        return Err(SceneError::invalid(file, "JSON", kind_of(&value), "an object"));
    }
    whole_floats_to_integers(&mut value);
    drop_extras(&mut value);
    add_missing_scene_nodes(&mut value);
    drop_untargeted_channels(&mut value);
    let mended = json::serialize::to_vec(&value).map_err(|e| wrong(&e))?;
    Root::from_slice(&mended).map_err(|_| wrong(&first_error))
}

fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

fn whole_floats_to_integers(value: &mut Value) {
    match value {
        Value::Number(n) => {
            let f = n.as_f64().unwrap_or(0.5);
            // 2^53: whole numbers up to here are exact
            if n.is_f64() && f.fract() == 0.0 && f.abs() <= 9_007_199_254_740_992.0 {
                *value = if f < 0.0 { Value::from(f as i64) } else { Value::from(f as u64) };
            }
        }
        Value::Array(items) => items.iter_mut().for_each(whole_floats_to_integers),
        Value::Object(map) => map.values_mut().for_each(whole_floats_to_integers),
        _ => {}
    }
}

/// Application data may be any JSON; nothing here reads it.
fn drop_extras(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(drop_extras),
        Value::Object(map) => {
            map.remove("extras");
            map.values_mut().for_each(drop_extras);
        }
        _ => {}
    }
}

fn add_missing_scene_nodes(root: &mut Value) {
    let scenes = root.get_mut("scenes").and_then(Value::as_array_mut);
    for scene in scenes.into_iter().flatten().filter_map(Value::as_object_mut) {
        scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
}

/// Channels without a target node are for extensions, to be ignored (glTF 2.0, 5.6); the typed
/// reader insists on a node.
fn drop_untargeted_channels(root: &mut Value) {
    let animations = root.get_mut("animations").and_then(Value::as_array_mut);
    for animation in animations.into_iter().flatten() {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            channels.retain(|c| {
                let target = c.get("target");
                !target.is_some_and(|t| t.is_object() && t.get("path").is_some() && t.get("node").is_none())
            });
        }
    }
}

fn check_version(file: &Path, root: &Root) -> Result<(), SceneError> {
    let parse = |v: &str| -> Option<(u32, u32)> {
        let (major, minor) = v.split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    };
    let version = parse(&root.asset.version);
    if version.is_none_or(|(major, _)| major != 2) {
        return Err(SceneError::invalid(file, "asset.version", format!("{:?}", root.asset.version), "2.0"));
    }
    if let Some(min) = &root.asset.min_version
        && parse(min).is_none_or(|m| m > (2, 0))
    {
        return Err(SceneError::invalid(file, "asset.minVersion", format!("{min:?}"), "2.0 at most"));
    }
    Ok(())
}

fn check_extensions(file: &Path, root: &Root, warnings: &mut Vec<String>) -> Result<(), SceneError> {
    let supported = |name: &String| SUPPORTED.contains(&name.as_str());
    if let Some(name) = root.extensions_required.iter().find(|n| !supported(n)) {
        return Err(SceneError::Unsupported {
            file: file.to_owned(),
            what: format!("the required extension {}", crate::error::one_line(name)),
            expected: format!("none other than {}", SUPPORTED.join(", ")),
        });
    }
    for name in root.extensions_used.iter().filter(|n| !supported(n)) {
        warnings.push(format!("extension {} is not supported and is ignored", crate::error::one_line(name)));
    }
    Ok(())
}
