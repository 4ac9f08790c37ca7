//! Compiles one variant: includes, glslang, removal of unused descriptors, reflection, struct check.

use std::collections::HashMap;
use std::fmt;
use std::path::PathBuf;

use glslang::{
    Compiler as Glslang, CompilerOptions, GlslProfile, ShaderInput, ShaderMessage, ShaderSource, ShaderStage,
    SourceLanguage, SpirvVersion, Target, VulkanVersion,
};

pub use crate::lookup::Files;
use crate::lookup::{Includer, display_path};
use crate::manifest::{ManifestError, Variant};
use crate::reflect::{self, ReflectError, StructInMemory};
use crate::{Shader, Stage, StructLayout};

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
    /// The files that decided it.
    pub files: Files,
}

/// Compiles variants.
#[derive(Clone, Debug, Default)]
pub struct Compiler {
    override_dirs: Vec<PathBuf>,
    include_dirs: Vec<PathBuf>,
    layouts: Vec<StructLayout>,
}

impl Compiler {
    /// Returns a compiler with this crate's headers and no layouts to check.
    pub fn new() -> Compiler {
        Compiler::default()
    }

    /// Adds a folder that includes and templates are looked up in. There may be several; no two of them may have a file
    /// of the same name, nor of the name of one of this crate's headers, where a shader includes it.
    pub fn include_dir(mut self, folder: impl Into<PathBuf>) -> Compiler {
        let folder = folder.into();
        if !self.include_dirs.contains(&folder) {
            self.include_dirs.push(folder);
        }
        self
    }

    /// Adds a folder whose files come before those of the include folders and this crate's headers, for trying what a
    /// shader does with another header of the same name.
    pub fn override_dir(mut self, folder: impl Into<PathBuf>) -> Compiler {
        self.override_dirs.push(folder.into());
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

    /// Compiles a variant's file.
    ///
    /// # Errors
    /// [`CompileError`]; messages of the compiler carry file and line.
    pub fn compile(&self, variant: &Variant) -> Result<Compiled, CompileError> {
        let (files, shader) = self.compile_telling_files(variant);
        Ok(Compiled { shader: shader?, files })
    }

    /// Compiles a variant's file; tells what it was made of also where it does not compile.
    pub(crate) fn compile_telling_files(&self, variant: &Variant) -> (Files, Result<Shader, CompileError>) {
        let mut includer = Includer::new(variant, &self.override_dirs, &self.include_dirs);
        let shader = self.compile_with(variant, &mut includer);
        (includer.files, shader)
    }

    fn compile_with(&self, variant: &Variant, includer: &mut Includer) -> Result<Shader, CompileError> {
        let source = std::fs::read_to_string(&variant.path)
            .map_err(|source| CompileError::Read { path: variant.path.clone(), source })?;
        let spirv = to_spirv(variant, &source, includer)?;
        let reflect_error = |source| CompileError::Reflect { variant: variant.name.clone(), source };
        let spirv = reflect::strip_unused(&spirv).map_err(reflect_error)?;
        let structs = reflect::structs_in_memory(&spirv).map_err(reflect_error)?;
        check_layouts(&variant.name, &structs, &self.layouts)?;
        let reflection = reflect::reflect(&spirv).map_err(reflect_error)?;
        let name = variant.name.as_str().into();
        Ok(Shader { name, stage: variant.stage, spirv: spirv.into(), reflection })
    }
}

fn to_spirv(variant: &Variant, source: &str, includer: &mut Includer) -> Result<Vec<u32>, CompileError> {
    let glsl = glsl_to_spirv(variant, source, includer);
    glsl.map_err(|failure| match failure {
        Failure::NoCompiler => CompileError::NoCompiler,
        Failure::Log(log) => {
            let mut messages = diagnostics(&log, &display_path(&variant.path));
            explain_includes(&mut messages, &includer.failures);
            CompileError::Glsl { variant: variant.name.clone(), messages }
        }
    })
}

enum Failure {
    NoCompiler,
    /// The compiler's log.
    Log(String),
}

fn glsl_to_spirv(variant: &Variant, source: &str, includer: &mut Includer) -> Result<Vec<u32>, Failure> {
    fn log(error: impl fmt::Display) -> Failure {
        Failure::Log(error.to_string())
    }
    if let Some(at) = source.find('\0') {
        let line = source[..at].lines().count();
        return Err(log(format_args!("ERROR: 0:{line}: found a zero byte, expected GLSL text")));
    }
    let compiler = Glslang::acquire().ok_or(Failure::NoCompiler)?;
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
        .map_err(log)?;
    let shader = glslang::Shader::new(compiler, input).parse().map_err(log)?;
    shader.compile().map_err(log)
}

/// Puts the reason why an include failed in the place of the compiler's bare complaint.
fn explain_includes(messages: &mut [Diagnostic], failures: &HashMap<String, String>) {
    for message in messages {
        let header = message.text.rsplit_once("header name: ").map(|(_, header)| header.trim());
        if let Some(why) = header.and_then(|header| failures.get(header)) {
            message.text.clone_from(why);
        }
    }
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
