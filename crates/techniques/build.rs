//! Compiles the shaders of every folder of `src` that has a `variants.txt`, and lists the techniques: a folder whose
//! `mod.rs` defines `pub static TECHNIQUE` is one. So adding a technique is adding a folder.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use afterlight_shader::build::Builder;
use afterlight_shader::{manifest, structs};

fn main() {
    if let Err(error) = build() {
        // One message without the debug quoting of a `main` that returns an error.
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn build() -> Result<(), Box<dyn Error>> {
    let src = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("src");
    let out_dir = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo:rerun-if-changed={}", src.display());
    let mut folders: Vec<PathBuf> =
        fs::read_dir(&src)?.collect::<Result<Vec<_>, _>>()?.into_iter().map(|entry| entry.path()).collect();
    folders.retain(|path| path.is_dir());
    folders.sort();
    fs::write(out_dir.join("registry.rs"), registry(&folders)?)?;
    // Where the stages' GLSL is: their build script tells.
    let stages = PathBuf::from(env::var("DEP_AFTERLIGHT_STAGES_GLSL")?);
    let mut builder = Builder::new().include_dir(&src).include_dir(stages).layouts(structs::LAYOUTS);
    for folder in &folders {
        if folder.join(manifest::FILE_NAME).is_file() {
            builder = builder.folder(folder_name(folder), folder);
        }
    }
    builder.emit(&out_dir)?;
    Ok(())
}

fn folder_name(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the modules of the techniques and their list, in the order of their `// ORDER: NUMBER` lines (those without
/// come last), then of their names.
fn registry(folders: &[PathBuf]) -> Result<String, Box<dyn Error>> {
    let mut techniques = Vec::new();
    for folder in folders {
        let path = folder.join("mod.rs");
        let Ok(code) = fs::read_to_string(&path) else { continue };
        if !code.lines().any(|line| line.starts_with("pub static TECHNIQUE:")) {
            continue;
        }
        techniques.push((order(&path, &code)?, folder_name(folder), path));
    }
    techniques.sort();
    let mut code = String::new();
    for (_, name, path) in &techniques {
        let _ = writeln!(code, "#[path = {path:?}]\npub mod {name};");
    }
    code.push_str("\n/// Every technique of this crate, in the order in which tables list them.\n");
    code.push_str("pub static TECHNIQUES: &[&dyn Technique] = &[");
    for (_, name, _) in &techniques {
        let _ = write!(code, "&{name}::TECHNIQUE, ");
    }
    code.push_str("];\n");
    Ok(code)
}

/// Reads the `// ORDER: NUMBER` line of a technique's `mod.rs`.
fn order(path: &Path, code: &str) -> Result<u32, Box<dyn Error>> {
    match code.lines().find_map(|line| line.strip_prefix("// ORDER:")) {
        None => Ok(u32::MAX),
        Some(number) => number.trim().parse().map_err(|_| {
            format!("{}: found `// ORDER:{number}`, expected a whole number", path.display()).into()
        }),
    }
}
