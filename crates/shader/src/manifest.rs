//! The list of shader variants of a folder, `variants.txt`: `FILE [#TAG] [DEFINE[=VALUE]…]`, one a line; a line that
//! starts with `#` is a comment.

use std::path::{Path, PathBuf};

use crate::Stage;

/// Name of the manifest in each shader folder.
pub const FILE_NAME: &str = "variants.txt";

/// One line of a manifest.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// Folder, file and tag: `forward/surface.frag#mask`.
    pub name: String,
    /// The stage, from the file's extension.
    pub stage: Stage,
    /// Path of the GLSL file.
    pub path: PathBuf,
    /// Root of the folder that includes are looked up in first (after the including file's own).
    pub folder: PathBuf,
    /// Macros, with their values.
    pub defines: Vec<(String, Option<String>)>,
}

/// Why a manifest could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// The file could not be read.
    #[error("{path}: {source}")]
    Read {
        /// Its path.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A line is wrong.
    #[error("{path}:{line}: {what}")]
    Line {
        /// The manifest.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What was found and what is expected.
        what: String,
    },
}

/// Returns the stage that a file name's extension names, `.comp` or `.comp.glsl`.
pub fn stage_of(file: &str) -> Option<Stage> {
    let file = file.strip_suffix(".glsl").unwrap_or(file);
    Some(match file.rsplit_once('.')?.1 {
        "vert" => Stage::Vertex,
        "tesc" => Stage::TessControl,
        "tese" => Stage::TessEvaluation,
        "geom" => Stage::Geometry,
        "frag" => Stage::Fragment,
        "comp" => Stage::Compute,
        _ => return None,
    })
}

/// Reads `folder`'s manifest; `prefix` is the folder's name in the variants' names.
///
/// # Errors
/// [`ManifestError`] names the file and line.
pub fn read(prefix: &str, folder: &Path) -> Result<Vec<Variant>, ManifestError> {
    let path = folder.join(FILE_NAME);
    let text = std::fs::read_to_string(&path)
        .map_err(|source| ManifestError::Read { path: path.clone(), source })?;
    parse(prefix, folder, &text)
}

/// Parses a manifest's text, see [`read`].
///
/// # Errors
/// [`ManifestError::Line`].
pub fn parse(prefix: &str, folder: &Path, text: &str) -> Result<Vec<Variant>, ManifestError> {
    let path = folder.join(FILE_NAME);
    let mut variants: Vec<Variant> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let wrong = |what: String| ManifestError::Line { path: path.clone(), line: index + 1, what };
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let mut words = line.split_whitespace();
        let file = words.next().unwrap_or_default();
        let stage = stage_of(file).ok_or_else(|| {
            wrong(format!(
                "found file `{file}`, expected one that ends in .vert, .tesc, .tese, .geom, .frag or .comp"
            ))
        })?;
        let mut name = format!("{prefix}/{}", file.strip_suffix(".glsl").unwrap_or(file));
        let mut defines = Vec::new();
        for word in words {
            if let Some(tag) = word.strip_prefix('#') {
                if tag.is_empty() {
                    break;
                }
                if name.contains('#') {
                    return Err(wrong(format!("found a second tag `#{tag}`, expected at most one")));
                }
                name = format!("{name}#{tag}");
                continue;
            }
            let (define, value) = match word.split_once('=') {
                Some((define, value)) => (define, Some(value.to_owned())),
                None => (word, None),
            };
            let starts_well = define.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
            if !starts_well || !define.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
                return Err(wrong(format!("found `{word}`, expected NAME or NAME=VALUE")));
            }
            defines.push((define.to_owned(), value));
        }
        if variants.iter().any(|variant| variant.name == name) {
            return Err(wrong(format!(
                "found `{name}` a second time, expected a #TAG that tells variants apart"
            )));
        }
        variants.push(Variant { name, stage, path: folder.join(file), folder: folder.to_owned(), defines });
    }
    Ok(variants)
}
