//! Compiles the shaders of every folder of `src` that has a `variants.txt`, and tells dependants where the GLSL is.

use std::error::Error;
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
    println!("cargo:rerun-if-changed={}", src.display());
    println!("cargo:glsl={}", src.display());
    let mut folders = Vec::new();
    collect(&src, &mut folders)?;
    folders.sort();
    let mut builder = Builder::new().include_dir(&src).layouts(structs::LAYOUTS);
    for folder in &folders {
        let name = folder.strip_prefix(&src)?.to_string_lossy().replace('\\', "/");
        builder = builder.folder(name, folder);
    }
    builder.emit(PathBuf::from(env::var("OUT_DIR")?))?;
    Ok(())
}

/// Folders with a list of variants, at any depth.
fn collect(folder: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            if path.join(manifest::FILE_NAME).is_file() {
                found.push(path.clone());
            }
            collect(&path, found)?;
        }
    }
    Ok(())
}
