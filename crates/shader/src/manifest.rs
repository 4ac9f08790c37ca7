//! The list of shader variants of a folder, `variants.txt`.
//!
//! Indentation and empty lines mean nothing; what follows a `#` that stands alone is a comment.
//!
//! # A file of the folder itself
//! One variant a line: the file, a tag that tells variants of one file apart, macros.
//! ```text
//! FILE [#TAG] [DEFINE[=VALUE]…]
//! fill.frag.glsl #mask ALPHA_MASK
//! ```
//! is the variant `FOLDER/fill.frag#mask`.
//!
//! # A template of another folder
//! A stage that works on whatever surfaces a technique has writes its shader as a template: where it needs the surfaces it
//! says `#include "source"`. The technique names the template and its own header that stands in for `source`; so the
//! stage never knows who uses it.
//! ```text
//! template PATH… source=HEADER [#TAG] [DEFINE[=VALUE]…]
//!   axis OPTION | OPTION…
//!   without #TAG #TAG…
//! ```
//! - Each PATH is looked up in the include folders alone, HEADER in the folder of the manifest and then in the include
//!   folders. A name that two include folders have is an error.
//! - Each `axis` line gives options, of which every variant takes one: `[#TAG] [DEFINE[=VALUE]…]`, or `-` for nothing. The
//!   variants are every combination of one option of each axis, the last axis changing fastest. A variant's tag is that
//!   of the `template` line and those of its options, in this order, joined by `-`.
//! - A `without` line leaves out the combinations that have all of its tags.
//! - The variants belong to the folder of the manifest: `FOLDER/TEMPLATE_FILE#TAG`.
//! ```text
//! template surfaces/shade.comp.glsl surfaces/volume.frag.glsl source=source_dais.glsl EXPLICIT_GRADIENTS
//!   axis - | #refs REFERENCES | #keys SAMPLES_IN_KEYS
//!   axis - | #one ONE_SAMPLE
//!   without #keys #one
//! ```
//! in the folder `dais` are `dais/shade.comp`, `dais/shade.comp#one`, `dais/shade.comp#refs`, `dais/shade.comp#refs-one`,
//! `dais/shade.comp#keys`, and the same of `dais/volume.frag`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use crate::Stage;
use crate::lookup::{self, InDirs};

/// Name of the manifest in each shader folder.
pub const FILE_NAME: &str = "variants.txt";

/// A macro and its value.
pub type Define = (String, Option<String>);

/// One variant of a manifest.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Folder, file and tag: `forward/surface.frag#mask`.
    pub name: String,
    /// The stage, from the file's extension.
    pub stage: Stage,
    /// Path of the GLSL file.
    pub path: PathBuf,
    /// Folder of the manifest: files within it look up their includes here after their own folder.
    pub folder: PathBuf,
    /// The header that `#include "source"` stands for; a template has one, a file of the folder has none.
    pub source: Option<PathBuf>,
    /// Macros, with their values.
    pub defines: Vec<Define>,
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

/// Reads `folder`'s manifest; `prefix` is the folder's name in the variants' names, `include_dirs` hold the templates.
///
/// # Errors
/// [`ManifestError`] names the file and line.
pub fn read(prefix: &str, folder: &Path, include_dirs: &[PathBuf]) -> Result<Vec<Variant>, ManifestError> {
    let path = folder.join(FILE_NAME);
    let text = std::fs::read_to_string(&path)
        .map_err(|source| ManifestError::Read { path: path.clone(), source })?;
    parse(prefix, folder, include_dirs, &text)
}

/// Parses a manifest's text, see [`read`].
///
/// # Errors
/// [`ManifestError::Line`].
pub fn parse(
    prefix: &str,
    folder: &Path,
    include_dirs: &[PathBuf],
    text: &str,
) -> Result<Vec<Variant>, ManifestError> {
    let mut parser =
        Parser { prefix, folder, include_dirs, variants: Vec::new(), names: HashSet::new(), block: None };
    let at = |line: usize| {
        move |what: String| ManifestError::Line { path: folder.join(FILE_NAME), line: line + 1, what }
    };
    for (number, line) in text.lines().enumerate() {
        // A comment may stick to the `#` that starts its line; elsewhere a word that starts with `#` is a tag.
        let line = if line.trim_start().starts_with('#') { "" } else { line };
        let words: Vec<&str> = line.split_whitespace().take_while(|word| *word != "#").collect();
        let Some((first, rest)) = words.split_first() else { continue };
        if !matches!(*first, "axis" | "without") {
            parser.finish_block().map_err(|(line, what)| at(line)(what))?;
        }
        match *first {
            "template" => parser.template(number, rest),
            "axis" => parser.axis(rest),
            "without" => parser.without(rest),
            file => parser.plain(file, rest),
        }
        .map_err(at(number))?;
    }
    parser.finish_block().map_err(|(line, what)| at(line)(what))?;
    Ok(parser.variants)
}

/// A tag and macros, as one line or one option of an axis gives them.
#[derive(Clone, Default)]
struct Choice {
    tag: Option<String>,
    defines: Vec<Define>,
}

/// A `template` line and the lines that belong to it.
struct Block {
    /// Number of the `template` line, from 0.
    line: usize,
    templates: Vec<Template>,
    source: PathBuf,
    base: Choice,
    axes: Vec<Vec<Choice>>,
    without: Vec<Vec<String>>,
}

struct Template {
    file_name: String,
    stage: Stage,
    path: PathBuf,
}

struct Parser<'a> {
    prefix: &'a str,
    folder: &'a Path,
    include_dirs: &'a [PathBuf],
    variants: Vec<Variant>,
    names: HashSet<String>,
    block: Option<Block>,
}

impl Parser<'_> {
    /// A line `FILE [#TAG] [DEFINE…]`.
    fn plain(&mut self, file: &str, words: &[&str]) -> Result<(), String> {
        let stage = stage_or_why(file)?;
        let choice = choice(words)?;
        self.push(file, stage, self.folder.join(file), None, choice)
    }

    /// A line `template PATH… source=HEADER [#TAG] [DEFINE…]`: opens a block.
    fn template(&mut self, line: usize, words: &[&str]) -> Result<(), String> {
        let at = words.iter().position(|word| word.starts_with("source=")).ok_or_else(|| {
            format!("found `template {}` without a source, expected `source=HEADER`", words.join(" "))
        })?;
        let (paths, rest) = (&words[..at], &words[at + 1..]);
        if paths.is_empty() {
            return Err(
                "found no template before `source=`, expected its path in an include folder".to_owned()
            );
        }
        let templates = paths.iter().map(|path| self.find_template(path)).collect::<Result<_, _>>()?;
        let source = self.find_source(&words[at]["source=".len()..])?;
        let base = choice(rest)?;
        self.block = Some(Block { line, templates, source, base, axes: Vec::new(), without: Vec::new() });
        Ok(())
    }

    /// A line `axis OPTION | OPTION…`.
    fn axis(&mut self, words: &[&str]) -> Result<(), String> {
        let block = self.block.as_mut().ok_or("found `axis`, expected a `template` line above it")?;
        let mut tags: HashSet<String> = block
            .axes
            .iter()
            .flatten()
            .chain([&block.base])
            .filter_map(|choice| choice.tag.clone())
            .collect();
        let mut untagged = false;
        let mut options = Vec::new();
        for words in words.split(|word| *word == "|") {
            let option = match words {
                [] => return Err("found an empty option, expected `[#TAG] [DEFINE…]` or `-`".to_owned()),
                ["-"] => Choice::default(),
                words => choice(words)?,
            };
            match &option.tag {
                Some(tag) if !tags.insert(tag.clone()) => {
                    return Err(format!(
                        "found `#{tag}` a second time, expected each tag once in a template's axes"
                    ));
                }
                None if std::mem::replace(&mut untagged, true) => {
                    return Err("found two options without a tag, expected at most one in an axis".to_owned());
                }
                _ => options.push(option),
            }
        }
        block.axes.push(options);
        Ok(())
    }

    /// A line `without #TAG #TAG…`.
    fn without(&mut self, words: &[&str]) -> Result<(), String> {
        let block = self.block.as_mut().ok_or("found `without`, expected a `template` line above it")?;
        let mut tags = Vec::new();
        for word in words {
            let known = word.strip_prefix('#').and_then(|tag| {
                let axis = block
                    .axes
                    .iter()
                    .position(|axis| axis.iter().any(|option| option.tag.as_deref() == Some(tag)))?;
                Some((axis, tag.to_owned()))
            });
            let (axis, tag) =
                known.ok_or_else(|| format!("found `{word}`, expected a #TAG of an axis above this line"))?;
            if tags.iter().any(|(other, _)| *other == axis) {
                return Err(format!("found `{word}`, expected tags of different axes"));
            }
            tags.push((axis, tag));
        }
        if tags.len() < 2 {
            return Err(format!("found {} tag(s) after `without`, expected two or more", tags.len()));
        }
        block.without.push(tags.into_iter().map(|(_, tag)| tag).collect());
        Ok(())
    }

    /// Adds the variants of the open block; an error comes with the number of the block's line.
    fn finish_block(&mut self) -> Result<(), (usize, String)> {
        let Some(block) = self.block.take() else { return Ok(()) };
        let combinations = combinations(&block);
        for template in &block.templates {
            for choice in &combinations {
                self.push(
                    &template.file_name,
                    template.stage,
                    template.path.clone(),
                    Some(block.source.clone()),
                    choice.clone(),
                )
                .map_err(|what| (block.line, what))?;
            }
        }
        Ok(())
    }

    fn push(
        &mut self,
        file: &str,
        stage: Stage,
        path: PathBuf,
        source: Option<PathBuf>,
        choice: Choice,
    ) -> Result<(), String> {
        let mut name = format!("{}/{}", self.prefix, file.strip_suffix(".glsl").unwrap_or(file));
        if let Some(tag) = &choice.tag {
            name = format!("{name}#{tag}");
        }
        if !self.names.insert(name.clone()) {
            return Err(format!("found `{name}` a second time, expected a #TAG that tells variants apart"));
        }
        let folder = self.folder.to_owned();
        self.variants.push(Variant { name, stage, path, folder, source, defines: choice.defines });
        Ok(())
    }

    fn find_template(&self, path: &str) -> Result<Template, String> {
        let stage = stage_or_why(path)?;
        let found = match lookup::in_dirs(self.include_dirs, path) {
            InDirs::One(found) => found,
            InDirs::None => {
                return Err(format!(
                    "found no template `{path}`, expected a file of {}",
                    lookup::list(self.include_dirs.iter())
                ));
            }
            InDirs::Two(first, second) => return Err(lookup::ambiguous(path, &first, &second)),
        };
        let file_name = path.rsplit_once('/').map_or(path, |(_, name)| name).to_owned();
        Ok(Template { file_name, stage, path: found })
    }

    fn find_source(&self, header: &str) -> Result<PathBuf, String> {
        let own = self.folder.join(header);
        if own.is_file() {
            return Ok(own);
        }
        match lookup::in_dirs(self.include_dirs, header) {
            InDirs::One(found) => Ok(found),
            InDirs::None => Err(format!(
                "found no source `{header}`, expected a file of {}",
                lookup::list([&self.folder.to_owned()].into_iter().chain(self.include_dirs))
            )),
            InDirs::Two(first, second) => Err(lookup::ambiguous(header, &first, &second)),
        }
    }
}

fn stage_or_why(file: &str) -> Result<Stage, String> {
    stage_of(file).ok_or_else(|| {
        format!("found file `{file}`, expected one that ends in .vert, .tesc, .tese, .geom, .frag or .comp")
    })
}

/// Returns every combination of one option of each axis that no `without` line leaves out.
fn combinations(block: &Block) -> Vec<Choice> {
    let mut partial: Vec<Vec<&Choice>> = vec![vec![&block.base]];
    for axis in &block.axes {
        partial = partial
            .iter()
            .flat_map(|taken| axis.iter().map(|option| [taken.as_slice(), &[option]].concat()))
            .collect();
    }
    let has = |taken: &[&Choice], tag: &String| taken.iter().any(|choice| choice.tag.as_ref() == Some(tag));
    partial.retain(|taken| !block.without.iter().any(|tags| tags.iter().all(|tag| has(taken, tag))));
    partial
        .into_iter()
        .map(|taken| {
            let tags: Vec<&str> = taken.iter().filter_map(|choice| choice.tag.as_deref()).collect();
            Choice {
                tag: (!tags.is_empty()).then(|| tags.join("-")),
                defines: taken.iter().flat_map(|choice| choice.defines.iter().cloned()).collect(),
            }
        })
        .collect()
}

/// Reads `[#TAG] [DEFINE[=VALUE]…]`.
fn choice(words: &[&str]) -> Result<Choice, String> {
    let mut choice = Choice::default();
    for word in words {
        if let Some(tag) = word.strip_prefix('#') {
            if choice.tag.is_some() {
                return Err(format!("found a second tag `#{tag}`, expected at most one"));
            }
            choice.tag = Some(tag.to_owned());
            continue;
        }
        let (define, value) = match word.split_once('=') {
            Some((define, value)) => (define, Some(value.to_owned())),
            None => (*word, None),
        };
        if define == "source" {
            return Err(format!("found `{word}`, expected it once and on a `template` line"));
        }
        let starts_well = define.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
        if !starts_well || !define.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
            return Err(format!("found `{word}`, expected NAME or NAME=VALUE"));
        }
        choice.defines.push((define.to_owned(), value));
    }
    Ok(choice)
}
