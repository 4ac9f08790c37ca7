//! For build scripts: compiles folders of shaders and writes a Rust file that carries them.
//!
//! ```no_run
//! // build.rs
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     afterlight_shader::build::Builder::new().folder("mine", "shaders").emit(std::env::var("OUT_DIR")?)?;
//!     Ok(())
//! }
//! ```
//! and in the library `include!(concat!(env!("OUT_DIR"), "/shaders.rs"));`, which defines `SHADERS` and `shader(name)`.

use std::cmp::Reverse;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::cache::Cache;
use crate::compile::{CompileError, Compiled, Compiler};
use crate::manifest::{self, Variant};
use crate::{Shader, StructLayout, pack};

/// Compiles the variants of several folders.
#[derive(Clone, Debug, Default)]
pub struct Builder {
    compiler: Compiler,
    folders: Vec<(String, PathBuf)>,
}

impl Builder {
    /// Returns a builder without folders.
    pub fn new() -> Builder {
        Builder::default()
    }

    /// Adds a folder that includes and templates are looked up in; there may be several, see [`Compiler::include_dir`].
    pub fn include_dir(mut self, folder: impl Into<PathBuf>) -> Builder {
        self.compiler = self.compiler.include_dir(folder);
        self
    }

    /// Adds a folder with a manifest; its variants are named `prefix/FILE#TAG`.
    pub fn folder(mut self, prefix: impl Into<String>, folder: impl Into<PathBuf>) -> Builder {
        self.folders.push((prefix.into(), folder.into()));
        self
    }

    /// Adds Rust layouts that GLSL structs of the same name must have.
    pub fn layouts(mut self, layouts: &[StructLayout]) -> Builder {
        self.compiler = self.compiler.layouts(layouts);
        self
    }

    pub(crate) fn compiler(&self) -> &Compiler {
        &self.compiler
    }

    pub(crate) fn folders(&self) -> &[(String, PathBuf)] {
        &self.folders
    }

    /// Returns every variant that the folders' manifests list.
    ///
    /// # Errors
    /// [`CompileError::Manifest`].
    pub fn variants(&self) -> Result<Vec<Variant>, CompileError> {
        let mut all = Vec::new();
        for (prefix, folder) in &self.folders {
            all.extend(manifest::read(prefix, folder, self.compiler.include_dirs())?);
        }
        Ok(all)
    }

    /// Compiles every variant, in the manifests' order.
    ///
    /// # Errors
    /// Every [`CompileError`] that there is.
    pub fn compile(&self) -> Result<Vec<Compiled>, CompileError> {
        compile_all(&self.variants()?, |variant| self.compiler.compile(variant))
    }

    /// Compiles every variant and writes `shaders.rs`, with the shaders beside it, into `out_dir`; tells Cargo which files
    /// to watch. A variant of which nothing changed since the last time, neither its line, the files that it includes nor
    /// the layouts, is taken as it was.
    ///
    /// # Errors
    /// Every [`CompileError`] that there is.
    pub fn emit(&self, out_dir: impl AsRef<Path>) -> Result<Emitted, CompileError> {
        let folders = self.folders.iter().map(|(_, folder)| folder).chain(self.compiler.include_dirs());
        for folder in folders {
            // The whole folder: a header that did not compile, and one that is new, must start the build again too.
            println!("cargo:rerun-if-changed={}", folder.display());
        }
        let out_dir = out_dir.as_ref();
        let variants = self.variants()?;
        let cache = Cache::open(out_dir.join("shader_cache"), &self.compiler)?;
        let compiled_count = AtomicUsize::new(0);
        let compiled = compile_all(&variants, |variant| {
            cache.get(variant).map_or_else(
                || {
                    compiled_count.fetch_add(1, Ordering::Relaxed);
                    cache.compile(variant)
                },
                Ok,
            )
        })?;
        cache.keep_only(&variants);
        write_shaders(&compiled, out_dir)?;
        Ok(Emitted { variant_count: variants.len(), compiled_count: compiled_count.into_inner() })
    }
}

/// What [`Builder::emit`] had to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emitted {
    /// Variants in the manifests.
    pub variant_count: usize,
    /// Variants that were compiled; the others were as they are from the last time.
    pub compiled_count: usize,
}

/// Calls `compile` for every variant, on every core, and returns the results in the variants' order.
fn compile_all(
    variants: &[Variant],
    compile: impl Fn(&Variant) -> Result<Compiled, CompileError> + Sync,
) -> Result<Vec<Compiled>, CompileError> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(variants.len().max(1));
    let order = largest_first(variants);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut mine = Vec::new();
        while let Some(&index) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
            mine.push((index, compile(&variants[index])));
        }
        mine
    };
    let mut done: Vec<(usize, Result<Compiled, CompileError>)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    done.sort_by_key(|(index, _)| *index);
    let (mut compiled, mut errors) = (Vec::new(), Vec::new());
    for (_, result) in done {
        match result {
            Ok(one) => compiled.push(one),
            Err(error) => errors.push(error),
        }
    }
    match errors.len() {
        0 => Ok(compiled),
        1 => Err(errors.remove(0)),
        _ => Err(CompileError::Several(errors)),
    }
}

/// Returns the variants' indices by the lengths of their files: one that takes long and starts last leaves cores idle.
fn largest_first(variants: &[Variant]) -> Vec<usize> {
    let bytes = |path: &PathBuf| std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    let mut order: Vec<usize> = (0..variants.len()).collect();
    order.sort_by_cached_key(|&index| {
        let variant = &variants[index];
        Reverse(bytes(&variant.path) + variant.source.as_ref().map_or(0, bytes))
    });
    order
}

const PACKED_NAME: &str = "shaders.bin";

/// What `shaders.rs` says; the shaders themselves are in the file beside it.
const CODE: &str = "\
/// Every compiled variant of this crate's shaders.
pub static SHADERS: ::std::sync::LazyLock<::std::vec::Vec<::afterlight_shader::Shader>> =
    ::std::sync::LazyLock::new(|| {
        match ::afterlight_shader::pack::unpack(include_bytes!(concat!(env!(\"OUT_DIR\"), \"/shaders.bin\"))) {
            ::std::result::Result::Ok(shaders) => shaders,
            ::std::result::Result::Err(error) => ::std::panic!(\"the shaders of this build: {error}\"),
        }
    });

/// Returns the variant of that name, `folder/FILE` or `folder/FILE#TAG`.
pub fn shader(name: &str) -> ::std::option::Option<&'static ::afterlight_shader::Shader> {
    SHADERS.iter().find(|shader| &*shader.name == name)
}
";

fn write_shaders(compiled: &[Compiled], out_dir: &Path) -> Result<(), CompileError> {
    let shaders: Vec<&Shader> = compiled.iter().map(|one| &one.shader).collect();
    write_if_new(out_dir.join(PACKED_NAME), &pack::pack(&shaders))?;
    write_if_new(out_dir.join("shaders.rs"), CODE.as_bytes())
}

/// Writes a file unless it has these bytes: Cargo builds again what includes a file that is newer.
fn write_if_new(path: PathBuf, bytes: &[u8]) -> Result<(), CompileError> {
    if std::fs::read(&path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    std::fs::write(&path, bytes).map_err(|source| CompileError::Write { path, source })
}
