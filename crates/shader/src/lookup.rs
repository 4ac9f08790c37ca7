//! Where an `#include` leads, and which files a variant was made of.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use glslang::include::{IncludeHandler, IncludeResult, IncludeType};

use crate::INCLUDES;
use crate::manifest::Variant;

/// What names of this crate's headers start with in messages.
const EMBEDDED: &str = "include/";

/// The name that stands for the header which a variant's manifest names as `source=`.
const SOURCE: &str = "source";

/// What the include folders have of one name.
pub(crate) enum InDirs {
    /// No folder has it.
    None,
    /// One has it.
    One(PathBuf),
    /// Two have it, so that the name does not say which is meant.
    Two(PathBuf, PathBuf),
}

/// Looks a name up in the include folders.
pub(crate) fn in_dirs(dirs: &[PathBuf], name: &str) -> InDirs {
    let mut found = dirs.iter().map(|folder| folder.join(name)).filter(|path| path.is_file());
    let Some(first) = found.next() else { return InDirs::None };
    // Two spellings of one folder are no contradiction.
    match found.find(|path| path.canonicalize().ok() != first.canonicalize().ok()) {
        None => InDirs::One(first),
        Some(second) => InDirs::Two(first, second),
    }
}

/// Says that a name leads to two files.
pub(crate) fn ambiguous(name: &str, first: &Path, second: &Path) -> String {
    format!(
        "found `{name}` twice, {} and {}, expected it in one include folder",
        display_path(first),
        display_path(second)
    )
}

/// Lists folders for a message.
pub(crate) fn list<'a>(folders: impl Iterator<Item = &'a PathBuf>) -> String {
    let folders: Vec<String> = folders.map(|folder| display_path(folder)).collect();
    if folders.is_empty() { "an include folder (there is none)".to_owned() } else { folders.join(" or ") }
}

pub(crate) fn display_path(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// The files that decide what a variant compiles to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Files {
    /// Every file on disk that was read.
    pub read: BTreeSet<PathBuf>,
    /// Places where an include was looked for before it was found elsewhere: a file that appears there takes its place.
    pub absent: BTreeSet<PathBuf>,
    /// Names of this crate's headers that were read.
    pub embedded: BTreeSet<String>,
}

/// Finds included files. The first of these places that has one is taken:
/// - beside the including file;
/// - in the variant's folder, where the including file lies in it;
/// - in a folder that overrides;
/// - in the one include folder that has it, or among this crate's headers (in two of these: an error).
///
/// `source` is the variant's source. A file with `#pragma once` is given once a compilation.
pub(crate) struct Includer<'a> {
    variant: &'a Variant,
    override_dirs: &'a [PathBuf],
    include_dirs: &'a [PathBuf],
    /// Folder of each file by the name that the compiler knows it by; the main file's is "".
    folders: HashMap<String, PathBuf>,
    once: HashSet<String>,
    /// What the variant is made of so far.
    pub(crate) files: Files,
    /// Why an include failed, by its name: the compiler's own message does not say.
    pub(crate) failures: HashMap<String, String>,
}

/// A file that was found.
struct Found {
    /// The name by which the compiler knows it.
    name: String,
    text: String,
}

impl<'a> Includer<'a> {
    pub(crate) fn new(
        variant: &'a Variant,
        override_dirs: &'a [PathBuf],
        include_dirs: &'a [PathBuf],
    ) -> Includer<'a> {
        let parent = variant.path.parent().map(Path::to_owned).unwrap_or_default();
        Includer {
            variant,
            override_dirs,
            include_dirs,
            folders: HashMap::from([(String::new(), parent)]),
            once: HashSet::new(),
            files: Files { read: BTreeSet::from([variant.path.clone()]), ..Files::default() },
            failures: HashMap::new(),
        }
    }

    fn find(&mut self, header: &str, includer: &str) -> Result<Found, String> {
        if header == SOURCE {
            let source = self.variant.source.clone().ok_or_else(|| {
                format!(
                    "found `#include \"source\"` in `{}`, which has no source; expected a `template` line with \
                     `source=HEADER` in a manifest",
                    self.variant.name
                )
            })?;
            return self.read(source);
        }
        let mut first = self.near(header, includer);
        first.extend(self.override_dirs.iter().map(|folder| folder.join(header)));
        for path in first {
            if path.is_file() {
                return self.read(path);
            }
            self.files.absent.insert(path);
        }
        // A header of this crate includes its neighbour by its bare name.
        if let Some((folder, _)) = includer.strip_prefix(EMBEDDED).and_then(|name| name.rsplit_once('/'))
            && let Some(found) = self.embedded(&format!("{folder}/{header}"))
        {
            return Ok(found);
        }
        self.shared(header)
    }

    /// Returns the places that come before the include folders.
    fn near(&self, header: &str, includer: &str) -> Vec<PathBuf> {
        let Some(beside) = self.folders.get(includer) else { return Vec::new() };
        let mut near = vec![beside.join(header)];
        if beside != &self.variant.folder && beside.starts_with(&self.variant.folder) {
            near.push(self.variant.folder.join(header));
        }
        near
    }

    /// Finds a file by the name that all files know it by.
    fn shared(&mut self, header: &str) -> Result<Found, String> {
        let on_disk = in_dirs(self.include_dirs, header);
        let elsewhere =
            self.include_dirs.iter().map(|folder| folder.join(header)).filter(|path| !path.is_file());
        self.files.absent.extend(elsewhere);
        match (on_disk, self.embedded(header)) {
            (InDirs::Two(first, second), _) => {
                let why = ambiguous(header, &first, &second);
                // Where one of them goes, the name is clear again.
                self.files.read.extend([first, second]);
                Err(why)
            }
            (InDirs::One(path), Some(embedded)) => {
                let why = ambiguous(header, &path, Path::new(&embedded.name));
                self.files.read.insert(path);
                Err(why)
            }
            (InDirs::One(path), None) => self.read(path),
            (InDirs::None, Some(embedded)) => Ok(embedded),
            (InDirs::None, None) => Err(format!(
                "found no file `{header}`, expected it beside the including file, in {}, or among the headers of \
                 afterlight-shader",
                list(self.include_dirs.iter())
            )),
        }
    }

    fn read(&mut self, path: PathBuf) -> Result<Found, String> {
        let name = display_path(&path);
        let text = std::fs::read_to_string(&path).map_err(|error| format!("{name}: {error}"))?;
        if text.contains('\0') {
            return Err(format!("{name}: found a zero byte, expected GLSL text"));
        }
        self.folders.insert(name.clone(), path.parent().map(Path::to_owned).unwrap_or_default());
        self.files.read.insert(path);
        Ok(Found { name, text })
    }

    fn embedded(&mut self, header: &str) -> Option<Found> {
        let (name, text) = INCLUDES.iter().find(|(name, _)| *name == header)?;
        self.files.embedded.insert((*name).to_owned());
        Some(Found { name: format!("{EMBEDDED}{name}"), text: (*text).to_owned() })
    }
}

impl IncludeHandler for Includer<'_> {
    fn include(
        &mut self,
        _kind: IncludeType,
        header_name: &str,
        includer_name: &str,
        _include_depth: usize,
    ) -> Option<IncludeResult> {
        let Found { name, text } = match self.find(header_name, includer_name) {
            Ok(found) => found,
            Err(why) => {
                self.failures.insert(header_name.to_owned(), why);
                return None;
            }
        };
        let data = match once(&text) {
            None => text,
            Some(_) if !self.once.insert(name.clone()) => String::new(),
            Some(without) => without,
        };
        Some(IncludeResult { name, data })
    }
}

/// Returns the text without its `#pragma once` line (glslang does not know it), or none where it has none.
fn once(text: &str) -> Option<String> {
    let line = text.lines().find(|line| line.trim() == "#pragma once")?;
    Some(text.replacen(line, "", 1))
}
