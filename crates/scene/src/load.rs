//! From a name to a scene.

use std::{
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

use crate::{Scene, SceneError};

/// How a scene is loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Time at which the first animation is shown, seconds, wrapped at its duration: nodes, skins, morph targets, cameras and
    /// lights; `None` is the rest pose.
    pub time_s: Option<f64>,
}

/// Loads what the command line names: a file, or `builtin:NAME?key=value&…`.
pub fn load_source(source: &str, options: &LoadOptions) -> Result<Scene, SceneError> {
    if source.starts_with("builtin:") {
        let mut scene = crate::builtin::build(source)?;
        if let Some(time_s) = options.time_s {
            scene.pose(time_s);
        }
        return Ok(scene);
    }
    load(Path::new(source), options)
}

/// Loads a `.gltf`, `.glb` or `.obj` file (in any case of letters).
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, SceneError> {
    let format = Format::of(path)?;
    let bytes = read_file(path)?;
    load_format(format, path, &bytes, options)
}

/// Loads a scene from the bytes of a file; `path` gives the format by its extension, the name for
/// messages and the folder that relative names in the file start from.
pub fn load_bytes(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Scene, SceneError> {
    load_format(Format::of(path)?, path, bytes, options)
}

/// Formats of scene files.
#[derive(Clone, Copy)]
enum Format {
    Gltf,
    Obj,
}

impl Format {
    fn of(path: &Path) -> Result<Self, SceneError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("gltf" | "glb") => Ok(Self::Gltf),
            Some("obj") => Ok(Self::Obj),
            other => Err(SceneError::UnknownFormat {
                file: path.to_owned(),
                found: other.map_or_else(|| "no extension".to_owned(), |e| format!("the extension .{e}")),
            }),
        }
    }
}

fn load_format(
    format: Format,
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Scene, SceneError> {
    let mut scene = match format {
        Format::Gltf => crate::gltf::load(path, bytes, options)?,
        Format::Obj => crate::obj::load(path, bytes)?,
    };
    if scene.name.is_empty() {
        scene.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    }
    if scene.instances.is_empty() {
        scene.warnings.push("nothing to draw: no triangle is placed in the scene".to_owned());
    }
    if scene.cameras.is_empty() {
        let camera = crate::camera::default_camera(&scene);
        scene.cameras.push(camera);
    }
    Ok(scene)
}

/// Largest file that is read, bytes. Scenes are indexed by 32 bits.
const FILE_BYTES_MAX: u64 = 1 << 32;

/// Reads a regular file as a whole. Devices and pipes are refused: a scene could name one that
/// never ends.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>, SceneError> {
    let mut file = File::open(path).map_err(|e| SceneError::io(path, &e))?;
    let metadata = file.metadata().map_err(|e| SceneError::io(path, &e))?;
    if !metadata.is_file() {
        let reason = if metadata.is_dir() { "a folder" } else { "not a regular file" };
        return Err(SceneError::Io { file: path.to_owned(), reason: reason.to_owned() });
    }
    if metadata.len() > FILE_BYTES_MAX {
        return Err(SceneError::TooLarge {
            file: path.to_owned(),
            what: "file size in bytes".to_owned(),
            found: metadata.len(),
            limit: FILE_BYTES_MAX,
        });
    }
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    file.read_to_end(&mut bytes).map_err(|e| SceneError::io(path, &e))?;
    Ok(bytes)
}

/// Reads the first bytes of a regular file, at most `limit`.
pub(crate) fn read_file_start(path: &Path, limit: u64) -> Result<Vec<u8>, SceneError> {
    let file = File::open(path).map_err(|e| SceneError::io(path, &e))?;
    let metadata = file.metadata().map_err(|e| SceneError::io(path, &e))?;
    if !metadata.is_file() {
        return Err(SceneError::Io { file: path.to_owned(), reason: "not a regular file".to_owned() });
    }
    let mut bytes = Vec::new();
    file.take(limit).read_to_end(&mut bytes).map_err(|e| SceneError::io(path, &e))?;
    Ok(bytes)
}

/// The file that a percent-encoded relative URI names, beside `file`; `None` for other schemes,
/// broken escapes and host names.
pub(crate) fn resolve_uri(file: &Path, uri: &str) -> Option<PathBuf> {
    let has_scheme = uri.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    });
    if has_scheme || uri.is_empty() || uri.starts_with("//") {
        return None;
    }
    let decoded = percent_decode(uri.split(['?', '#']).next().unwrap_or(uri));
    // A URI with an unescaped ? or # in its file name breaks the rules but is common: where a
    // file of the whole name exists, that file is meant.
    let folder = file.parent().unwrap_or(Path::new(""));
    let whole = folder.join(percent_decode(uri)?);
    if uri.contains(['?', '#']) && whole.is_file() {
        return Some(whole);
    }
    Some(folder.join(decoded?))
}

/// Decodes `%XX`; `None` where an escape is broken or the result is no UTF-8.
fn percent_decode(text: &str) -> Option<String> {
    String::from_utf8(percent_decode_bytes(text)?).ok()
}

/// Decodes `%XX`; `None` where an escape is broken.
pub(crate) fn percent_decode_bytes(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(b) = bytes.next() {
        if b == b'%' {
            let digit = |b: Option<u8>| b.and_then(|b| char::from(b).to_digit(16));
            let (hi, lo) = (digit(bytes.next())?, digit(bytes.next())?);
            out.push((hi * 16 + lo) as u8);
        } else {
            out.push(b);
        }
    }
    Some(out)
}
