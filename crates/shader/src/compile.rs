//! Compiles one variant: includes, glslang, removal of unused descriptors, reflection, struct check.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
use glslang::{
    Compiler as Glslang, CompilerOptions, GlslProfile, ShaderInput, ShaderMessage, ShaderSource, ShaderStage,
    SourceLanguage, SpirvVersion, Target, VulkanVersion,
};

use crate::manifest::{ManifestError, Variant};
use crate::reflect::{self, ReflectError, StructInMemory};
use crate::{INCLUDES, Shader, Stage, StructLayout};

/// Lines that every shader starts with, after its `#version`.
const PREAMBLE: &str =
    "#extension GL_GOOGLE_include_directive : require\n#extension GL_EXT_scalar_block_layout : require\n";

/// A message of the compiler with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// The file as the compiler was told it.
    pub file: String,
    /// Line, from 1; 0 where the compiler gives none.
    pub line: u32,
    /// What is wrong.
    pub text: String,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.file, self.text),
            line => write!(f, "{}:{line}: {}", self.file, self.text),
        }
    }
}

/// Why a variant was not compiled.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// glslang could not be set up.
    #[error("glslang could not be initialised")]
    NoCompiler,
    /// The source could not be read.
    #[error("{path}: {source}")]
    Read {
        /// Its path.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The manifest is wrong.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// The GLSL is wrong.
    #[error("{variant}: {} error(s)\n{}", messages.len(), lines(messages))]
    Glsl {
        /// The variant's name.
        variant: String,
        /// What the compiler says, in its order.
        messages: Vec<Diagnostic>,
    },
    /// The compiler's output could not be read.
    #[error("{variant}: {source}")]
    Reflect {
        /// The variant's name.
        variant: String,
        /// What is wrong with it.
        source: ReflectError,
    },
    /// A struct lies differently in Rust and in GLSL.
    #[error("{variant}: struct `{name}` differs between GLSL and Rust: {what}")]
    Layout {
        /// The variant's name.
        variant: String,
        /// The struct's name.
        name: String,
        /// The first difference.
        what: String,
    },
    /// Several variants were not compiled.
    #[error("{} shaders do not compile\n{}", .0.len(), .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<CompileError>),
    /// A file could not be written.
    #[error("{path}: {source}")]
    Write {
        /// Its path.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

fn lines(messages: &[Diagnostic]) -> String {
    messages.iter().map(|message| format!("  {message}")).collect::<Vec<_>>().join("\n")
}

/// A compiled variant, and what it was made of.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The shader.
    pub shader: Shader,
    /// Every file on disk that it was made of.
    pub dependencies: BTreeSet<PathBuf>,
}

/// Compiles variants.
#[derive(Clone, Debug, Default)]
pub struct Compiler {
    include_dirs: Vec<PathBuf>,
    layouts: Vec<StructLayout>,
}

impl Compiler {
    /// Returns a compiler with this crate's headers and no layouts to check.
    pub fn new() -> Compiler {
        Compiler::default()
    }

    /// Adds a folder that includes are looked up in, after the variant's own folder and before this crate's headers.
    pub fn include_dir(mut self, folder: impl Into<PathBuf>) -> Compiler {
        self.include_dirs.push(folder.into());
        self
    }

    /// Adds layouts: a GLSL struct or block of the same name must lie in memory as they say.
    pub fn layouts(mut self, layouts: &[StructLayout]) -> Compiler {
        self.layouts.extend_from_slice(layouts);
        self
    }

    pub(crate) fn include_dirs(&self) -> &[PathBuf] {
        &self.include_dirs
    }

    /// Returns a number that changes with anything that compiled shaders depend on: this crate's headers, the layouts, the
    /// program that runs, and every file of `folders` and of the include folders that is not Rust.
    pub(crate) fn fingerprint<'a>(&'a self, folders: impl Iterator<Item = &'a Path>) -> u64 {
        let mut hasher = DefaultHasher::new();
        INCLUDES.hash(&mut hasher);
        format!("{:?}", self.layouts).hash(&mut hasher);
        let program =
            std::env::current_exe().and_then(std::fs::metadata).and_then(|metadata| metadata.modified());
        format!("{program:?}").hash(&mut hasher);
        for folder in folders.chain(self.include_dirs.iter().map(PathBuf::as_path)) {
            hash_folder(folder, &mut hasher);
        }
        hasher.finish()
    }

    /// Compiles a variant's file.
    ///
    /// # Errors
    /// [`CompileError`]; messages of the compiler carry file and line.
    pub fn compile(&self, variant: &Variant) -> Result<Compiled, CompileError> {
        let source = std::fs::read_to_string(&variant.path)
            .map_err(|source| CompileError::Read { path: variant.path.clone(), source })?;
        let mut includer = Includer::new(variant, &self.include_dirs);
        let spirv = to_spirv(variant, &source, &mut includer)?;
        let reflect_error = |source| CompileError::Reflect { variant: variant.name.clone(), source };
        let spirv = reflect::strip_unused(&spirv).map_err(reflect_error)?;
        let structs = reflect::structs_in_memory(&spirv).map_err(reflect_error)?;
        check_layouts(&variant.name, &structs, &self.layouts)?;
        let reflection = reflect::reflect(&spirv).map_err(reflect_error)?;
        let shader = Shader {
            name: variant.name.as_str().into(),
            stage: variant.stage,
            spirv: spirv.into(),
            reflection,
        };
        Ok(Compiled { shader, dependencies: includer.dependencies })
    }
}

fn hash_folder(folder: &Path, hasher: &mut DefaultHasher) {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            hash_folder(&path, hasher);
        } else if path.extension().is_none_or(|extension| extension != "rs") {
            path.hash(hasher);
            std::fs::read(&path).ok().hash(hasher);
        }
    }
}

fn to_spirv(variant: &Variant, source: &str, includer: &mut Includer) -> Result<Vec<u32>, CompileError> {
    let file = display_path(&variant.path);
    let glsl_error = |log: String| CompileError::Glsl {
        variant: variant.name.clone(),
        messages: diagnostics(&log, &file),
    };
    if let Some(at) = source.find('\0') {
        let line = source[..at].lines().count();
        return Err(glsl_error(format!("ERROR: 0:{line}: found a zero byte, expected GLSL text")));
    }
    let compiler = Glslang::acquire().ok_or(CompileError::NoCompiler)?;
    let text = ShaderSource::from(with_preamble(source, &variant.defines));
    let options = CompilerOptions {
        source_language: SourceLanguage::GLSL,
        // SPIR-V 1.5 rather than 1.6: work-group sizes then stay literal (1.6 needs maintenance4 for its form of them).
        target: Target::Vulkan { version: VulkanVersion::Vulkan1_3, spirv_version: SpirvVersion::SPIRV1_5 },
        version_profile: None::<(i32, GlslProfile)>,
        messages: ShaderMessage::DEFAULT | ShaderMessage::VULKAN_RULES | ShaderMessage::SPV_RULES,
    };
    let stage = glslang_stage(variant.stage);
    let input = ShaderInput::new(&text, stage, &options, None::<&[(&str, Option<&str>)]>, Some(includer))
        .map_err(|error| glsl_error(error.to_string()))?;
    let shader =
        glslang::Shader::new(compiler, input).parse().map_err(|error| glsl_error(error.to_string()))?;
    shader.compile().map_err(|error| glsl_error(error.to_string()))
}

/// Puts the preamble and the macros after the `#version` line (which is added where it lacks) without moving the numbers
/// of the lines that follow. glslang's own preamble does not serve: its extensions would come before `#version`.
fn with_preamble(source: &str, defines: &[(String, Option<String>)]) -> String {
    let version_line = source.lines().position(|line| line.trim_start().starts_with("#version"));
    let head_lines = version_line.map_or(0, |line| line + 1);
    let mut text = String::with_capacity(source.len() + 256);
    if version_line.is_none() {
        text.push_str("#version 460\n");
    }
    for line in source.lines().take(head_lines) {
        text.push_str(line);
        text.push('\n');
    }
    text.push_str(PREAMBLE);
    for (name, value) in defines {
        text.push_str(&format!("#define {name} {}\n", value.as_deref().unwrap_or("1")));
    }
    text.push_str(&format!("#line {}\n", head_lines + 1));
    for line in source.lines().skip(head_lines) {
        text.push_str(line);
        text.push('\n');
    }
    text
}

fn glslang_stage(stage: Stage) -> ShaderStage {
    match stage {
        Stage::Vertex => ShaderStage::Vertex,
        Stage::TessControl => ShaderStage::TesselationControl,
        Stage::TessEvaluation => ShaderStage::TesselationEvaluation,
        Stage::Geometry => ShaderStage::Geometry,
        Stage::Fragment => ShaderStage::Fragment,
        Stage::Compute => ShaderStage::Compute,
    }
}

fn display_path(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// Reads `ERROR: FILE:LINE: TEXT` lines; `root` is the file that the compiler calls `0`.
fn diagnostics(log: &str, root: &str) -> Vec<Diagnostic> {
    let mut messages = Vec::new();
    for line in log.lines() {
        let Some(rest) = line.trim().strip_prefix("ERROR: ") else { continue };
        if rest.ends_with("compilation errors.  No code generated.") {
            continue;
        }
        messages.push(diagnostic(rest, root));
    }
    if messages.is_empty() {
        messages.push(Diagnostic { file: root.to_owned(), line: 0, text: log.trim().to_owned() });
    }
    messages
}

fn diagnostic(rest: &str, root: &str) -> Diagnostic {
    // The place is the first `:DIGITS:`; a file's name may hold colons of its own.
    for (at, _) in rest.match_indices(':') {
        let after = &rest[at + 1..];
        let digits = after.bytes().take_while(u8::is_ascii_digit).count();
        if digits > 0 && after[digits..].starts_with(':') {
            let file = match &rest[..at] {
                "0" | "" => root.to_owned(),
                named => named.trim_matches('"').to_owned(),
            };
            let line = after[..digits].parse().unwrap_or(0);
            return Diagnostic { file, line, text: after[digits + 1..].trim().to_owned() };
        }
    }
    Diagnostic { file: root.to_owned(), line: 0, text: rest.trim().to_owned() }
}

/// Finds included files: beside the including file, in the variant's folder, in the include folders, among this crate's
/// headers. A file with `#pragma once` is given once a compilation.
struct Includer<'a> {
    folder: &'a Path,
    include_dirs: &'a [PathBuf],
    /// Folder of each file by the name that the compiler knows it by; the main file's is "".
    folders: HashMap<String, PathBuf>,
    once: HashSet<String>,
    dependencies: BTreeSet<PathBuf>,
}

impl<'a> Includer<'a> {
    fn new(variant: &'a Variant, include_dirs: &'a [PathBuf]) -> Includer<'a> {
        let parent = variant.path.parent().map(Path::to_owned).unwrap_or_default();
        Includer {
            folder: &variant.folder,
            include_dirs,
            folders: HashMap::from([(String::new(), parent)]),
            once: HashSet::new(),
            dependencies: BTreeSet::from([variant.path.clone()]),
        }
    }

    fn find(&self, header: &str, includer: &str) -> Option<(String, Option<PathBuf>, String)> {
        let beside = self.folders.get(includer).map(PathBuf::as_path);
        let candidates =
            beside.into_iter().chain([self.folder]).chain(self.include_dirs.iter().map(PathBuf::as_path));
        for folder in candidates {
            let path = folder.join(header);
            if let Ok(text) = std::fs::read_to_string(&path) {
                return Some((display_path(&path), Some(path), text));
            }
        }
        // A header of this crate may include its neighbour by its bare name.
        let within = includer.strip_prefix(EMBEDDED).and_then(|name| name.rsplit_once('/'));
        let neighbour = within.map(|(folder, _)| format!("{folder}/{header}"));
        let (name, text) = INCLUDES
            .iter()
            .find(|(name, _)| Some(*name) == neighbour.as_deref())
            .or_else(|| INCLUDES.iter().find(|(name, _)| *name == header))?;
        Some((format!("{EMBEDDED}{name}"), None, (*text).to_owned()))
    }
}

/// What names of this crate's headers start with in messages.
const EMBEDDED: &str = "include/";

impl IncludeHandler for Includer<'_> {
    fn include(
        &mut self,
        _kind: IncludeType,
        header_name: &str,
        includer_name: &str,
        _include_depth: usize,
    ) -> Option<IncludeResult> {
        let (name, path, text) = self.find(header_name, includer_name)?;
        if let Some(path) = path {
            self.folders.insert(name.clone(), path.parent().map(Path::to_owned).unwrap_or_default());
            self.dependencies.insert(path);
        }
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

fn check_layouts(
    variant: &str,
    structs: &[StructInMemory],
    layouts: &[StructLayout],
) -> Result<(), CompileError> {
    for found in structs {
        let Some(expected) = layouts.iter().find(|layout| layout.name == found.name) else { continue };
        if let Some(what) = difference(found, expected) {
            return Err(CompileError::Layout { variant: variant.to_owned(), name: found.name.clone(), what });
        }
    }
    Ok(())
}

/// Returns the first difference between a struct as the shader has it and as Rust has it.
fn difference(found: &StructInMemory, expected: &StructLayout) -> Option<String> {
    let mut members = found.members.iter().peekable();
    for field in expected.fields {
        let is_padding = field.name.starts_with('_');
        if is_padding && members.peek().is_none_or(|member| member.name != field.name) {
            continue;
        }
        let Some(member) = members.next() else {
            return Some(format!("GLSL lacks field `{}`", field.name));
        };
        let in_rust = (field.name, field.offset_bytes, Some(field.size_bytes));
        let in_glsl = (
            member.name.as_str(),
            member.offset_bytes as usize,
            member.size_bytes.map(|bytes| bytes as usize),
        );
        if in_rust != in_glsl {
            return Some(format!(
                "GLSL has `{}` at byte {} ({}), Rust has `{}` at byte {} ({} bytes)",
                member.name,
                member.offset_bytes,
                member.size_bytes.map_or("no length".to_owned(), |bytes| format!("{bytes} bytes")),
                field.name,
                field.offset_bytes,
                field.size_bytes
            ));
        }
    }
    // A block may go on with an array without a length after what Rust describes as its header.
    if let Some(member) = members.next()
        && !(member.size_bytes.is_none() && member.offset_bytes as usize == expected.size_bytes)
    {
        return Some(format!("Rust lacks field `{}` at byte {}", member.name, member.offset_bytes));
    }
    match found.stride_bytes {
        Some(stride) if stride as usize != expected.size_bytes => Some(format!(
            "GLSL has arrays of it with a stride of {stride} bytes, Rust has {} bytes",
            expected.size_bytes
        )),
        _ => None,
    }
}
