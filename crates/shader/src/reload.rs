//! Compiles shaders again when their files change.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::Shader;
use crate::build::Builder;
use crate::compile::{CompileError, Files};
use crate::manifest::{self, Variant};

/// What became of a variant whose files changed.
#[derive(Clone, Debug)]
pub enum Changed {
    /// It compiled: use this from now on.
    Compiled(Shader),
    /// It did not compile: the previous one stays in use.
    Failed {
        /// The variant's name.
        name: String,
        /// The compiler's messages, with file and line.
        message: String,
    },
}

/// Watches folders of shaders by their files' times of change and lengths.
pub struct Reloader {
    builder: Builder,
    /// Each variant as it was when it was last compiled.
    seen: HashMap<String, Seen>,
    failed_manifests: HashMap<PathBuf, Stamp>,
}

/// A variant and the files that decided it, those too whose absence did.
struct Seen {
    variant: Variant,
    files: HashMap<PathBuf, Stamp>,
}

impl Seen {
    fn new(variant: &Variant, files: &Files) -> Seen {
        let paths = files.read.iter().chain(&files.absent);
        Seen { variant: variant.clone(), files: paths.map(|path| (path.clone(), stamp(path))).collect() }
    }

    fn is_current(&self, variant: &Variant) -> bool {
        self.variant == *variant && self.files.iter().all(|(path, seen)| stamp(path) == *seen)
    }
}

/// Time of change and length of a file; none where it does not exist.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

impl Reloader {
    /// Watches the builder's folders, with its include folders and layouts; compiles each variant once to learn its files.
    ///
    /// # Errors
    /// The first [`CompileError`]: what is watched must compile to begin with.
    pub fn new(builder: Builder) -> Result<Reloader, CompileError> {
        let variants = builder.variants()?;
        let seen = variants
            .iter()
            .zip(builder.compile()?)
            .map(|(variant, compiled)| (variant.name.clone(), Seen::new(variant, &compiled.files)))
            .collect();
        Ok(Reloader { builder, seen, failed_manifests: HashMap::new() })
    }

    /// Compiles what changed since the last call, variants that are new in a manifest too.
    pub fn poll(&mut self) -> Vec<Changed> {
        let mut changes = Vec::new();
        for (prefix, folder) in self.builder.folders().to_vec() {
            match manifest::read(&prefix, &folder, self.builder.compiler().include_dirs()) {
                Ok(variants) => {
                    self.failed_manifests.remove(&folder);
                    changes.extend(variants.iter().filter_map(|variant| self.poll_variant(variant)));
                }
                Err(error) => {
                    let now = stamp(&folder.join(manifest::FILE_NAME));
                    if self.failed_manifests.insert(folder, now) != Some(now) {
                        changes.push(Changed::Failed { name: prefix, message: error.to_string() });
                    }
                }
            }
        }
        changes
    }

    fn poll_variant(&mut self, variant: &Variant) -> Option<Changed> {
        if self.seen.get(&variant.name).is_some_and(|seen| seen.is_current(variant)) {
            return None;
        }
        let (files, shader) = self.builder.compiler().compile_telling_files(variant);
        self.seen.insert(variant.name.clone(), Seen::new(variant, &files));
        Some(match shader {
            Ok(shader) => Changed::Compiled(shader),
            Err(error) => Changed::Failed { name: variant.name.clone(), message: error.to_string() },
        })
    }
}
