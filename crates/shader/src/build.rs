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

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::compile::{CompileError, Compiled, Compiler};
use crate::manifest::{self, Variant};
use crate::{Interface, Shader, StructLayout};

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

    /// Adds a folder that includes are looked up in after the including shader's own.
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

    /// Returns every variant that the folders' manifests list.
    ///
    /// # Errors
    /// [`CompileError::Manifest`].
    pub fn variants(&self) -> Result<Vec<Variant>, CompileError> {
        let mut all = Vec::new();
        for (prefix, folder) in &self.folders {
            all.extend(manifest::read(prefix, folder)?);
        }
        Ok(all)
    }

    /// Compiles every variant, in the manifests' order.
    ///
    /// # Errors
    /// Every [`CompileError`] that there is.
    pub fn compile(&self) -> Result<Vec<Compiled>, CompileError> {
        let variants = self.variants()?;
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(variants.len().max(1));
        let next = std::sync::atomic::AtomicUsize::new(0);
        let mut done: Vec<(usize, Result<Compiled, CompileError>)> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads)
                .map(|_| {
                    scope.spawn(|| {
                        let mut mine = Vec::new();
                        loop {
                            let index = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                            let Some(variant) = variants.get(index) else { return mine };
                            mine.push((index, self.compiler.compile(variant)));
                        }
                    })
                })
                .collect();
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

    /// Compiles every variant and writes `shaders.rs`, with the SPIR-V beside it, into `out_dir`; tells Cargo which files
    /// to watch. Where nothing that shaders are made of changed since the last time, what is there is left as it is.
    ///
    /// # Errors
    /// Every [`CompileError`] that there is.
    pub fn emit(&self, out_dir: impl AsRef<Path>) -> Result<(), CompileError> {
        let folders = self.folders.iter().map(|(_, folder)| folder).chain(self.compiler.include_dirs());
        for folder in folders {
            // The whole folder: a header that did not compile, and one that is new, must start the build again too.
            println!("cargo:rerun-if-changed={}", folder.display());
        }
        let (stamp_path, code_path) =
            (out_dir.as_ref().join("shaders.stamp"), out_dir.as_ref().join("shaders.rs"));
        let stamp =
            self.compiler.fingerprint(self.folders.iter().map(|(_, folder)| folder.as_path())).to_string();
        if code_path.is_file() && std::fs::read_to_string(&stamp_path).is_ok_and(|written| written == stamp) {
            return Ok(());
        }
        write_shaders(&self.compile()?, out_dir.as_ref())?;
        write(stamp_path, stamp.as_bytes())
    }
}

fn write(path: PathBuf, bytes: &[u8]) -> Result<(), CompileError> {
    std::fs::write(&path, bytes).map_err(|source| CompileError::Write { path, source })
}

fn write_shaders(compiled: &[Compiled], out_dir: &Path) -> Result<(), CompileError> {
    let mut code = String::from(
        "/// Every compiled variant of this crate's shaders.\n\
         pub static SHADERS: ::std::sync::LazyLock<::std::vec::Vec<::afterlight_shader::Shader>> =\n    \
         ::std::sync::LazyLock::new(|| {\n        use ::afterlight_shader::*;\n        ::std::vec![\n",
    );
    for (index, one) in compiled.iter().enumerate() {
        let file = format!("shader_{index}.spv");
        let bytes: Vec<u8> = one.shader.spirv.iter().flat_map(|word| word.to_le_bytes()).collect();
        write(out_dir.join(&file), &bytes)?;
        push_shader(&mut code, &one.shader, &file);
    }
    code.push_str(
        "        ]\n    });\n\n\
         /// Returns the variant of that name, `folder/FILE` or `folder/FILE#TAG`.\n\
         pub fn shader(name: &str) -> ::std::option::Option<&'static ::afterlight_shader::Shader> {\n    \
         SHADERS.iter().find(|shader| &*shader.name == name)\n}\n",
    );
    write(out_dir.join("shaders.rs"), code.as_bytes())
}

/// Appends a `Shader { … }` expression.
fn push_shader(code: &mut String, shader: &Shader, file: &str) {
    let reflection = &shader.reflection;
    let _ = writeln!(
        code,
        "            Shader {{ name: Text::Static({:?}), stage: Stage::{:?}, spirv: words_of(include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{file}\"))), reflection: Reflection {{",
        shader.name, shader.stage
    );
    code.push_str("                bindings: Shared::Static(&[");
    for binding in &reflection.bindings {
        let image = match binding.image {
            None => "None".to_owned(),
            Some(shape) => format!(
                "Some(ImageShape {{ dim: ImageDim::{:?}, arrayed: {}, multisampled: {} }})",
                shape.dim, shape.arrayed, shape.multisampled
            ),
        };
        let _ = write!(
            code,
            "Binding {{ set: {}, binding: {}, name: Text::Static({:?}), kind: BindingKind::{:?}, count: {}, readable: {}, writable: {}, image: {image} }}, ",
            binding.set,
            binding.binding,
            binding.name,
            binding.kind,
            binding.count,
            binding.readable,
            binding.writable
        );
    }
    let _ = write!(
        code,
        "]),\n                push_constant_bytes: {}, local_size: {:?},\n                spec_constants: Shared::Static(&[",
        reflection.push_constant_bytes, reflection.local_size
    );
    for constant in &reflection.spec_constants {
        let _ = write!(
            code,
            "SpecConstant {{ id: {}, name: Text::Static({:?}), scalar: Scalar::{:?}, default_bits: {} }}, ",
            constant.id, constant.name, constant.scalar, constant.default_bits
        );
    }
    let _ = write!(
        code,
        "]),\n                inputs: Shared::Static(&[{}]), outputs: Shared::Static(&[{}]) }} }},\n",
        interfaces(&reflection.inputs),
        interfaces(&reflection.outputs)
    );
}

fn interfaces(list: &[Interface]) -> String {
    list.iter()
        .map(|one| {
            format!(
                "Interface {{ location: {}, name: Text::Static({:?}), components: {}, scalar: Scalar::{:?} }}, ",
                one.location, one.name, one.components, one.scalar
            )
        })
        .collect()
}
