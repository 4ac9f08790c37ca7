//! Compiles shaders again when their files change.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::build::Builder;
use crate::compile::CompileError;
use crate::{Shader, StructLayout, compile::Compiler, manifest};

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
    folders: Vec<(String, PathBuf)>,
    compiler: Compiler,
    /// Files that a variant was made of, as they were when it was last compiled.
    seen: HashMap<String, HashMap<PathBuf, Stamp>>,
    failed_manifests: HashMap<PathBuf, Stamp>,
}

type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

fn stamps(paths: &BTreeSet<PathBuf>) -> HashMap<PathBuf, Stamp> {
    paths.iter().map(|path| (path.clone(), stamp(path))).collect()
}

impl Reloader {
    /// Watches `folders` (prefix and path); compiles each variant once to learn its files.
    ///
    /// # Errors
    /// The first [`CompileError`]: what is watched must compile to begin with.
    pub fn new(folders: &[(String, PathBuf)], layouts: &[StructLayout]) -> Result<Reloader, CompileError> {
        let mut builder = Builder::new().layouts(layouts);
        for (prefix, folder) in folders {
            builder = builder.folder(prefix, folder);
        }
        let seen = builder
            .compile()?
            .into_iter()
            .map(|one| (one.shader.name.to_string(), stamps(&one.dependencies)))
            .collect();
        Ok(Reloader {
            folders: folders.to_vec(),
            compiler: Compiler::new().layouts(layouts),
            seen,
            failed_manifests: HashMap::new(),
        })
    }

    /// Compiles what changed since the last call, variants that are new in a manifest too.
    pub fn poll(&mut self) -> Vec<Changed> {
        let mut changes = Vec::new();
        for (prefix, folder) in self.folders.clone() {
            match manifest::read(&prefix, &folder) {
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

    fn poll_variant(&mut self, variant: &manifest::Variant) -> Option<Changed> {
        if let Some(files) = self.seen.get(&variant.name)
            && files.iter().all(|(path, seen)| stamp(path) == *seen)
        {
            return None;
        }
        match self.compiler.compile(variant) {
            Ok(compiled) => {
                self.seen.insert(variant.name.clone(), stamps(&compiled.dependencies));
                Some(Changed::Compiled(compiled.shader))
            }
            Err(error) => {
                // The files known so far are watched on: any of them may hold the cure.
                let files = self.seen.entry(variant.name.clone()).or_default();
                files.entry(variant.path.clone()).or_default();
                for (path, seen) in files.iter_mut() {
                    *seen = stamp(path);
                }
                Some(Changed::Failed { name: variant.name.clone(), message: error.to_string() })
            }
        }
    }
}
