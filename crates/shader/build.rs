//! Lists the files of `include/` so that the library carries them; hashes the sources of the compiler, so that what it
//! compiled is known from what another state of it would.

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let manifest_dir = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    hash_sources(&manifest_dir.join("src"))?;
    let root = manifest_dir.join("include");
    println!("cargo:rerun-if-changed={}", root.display());
    let mut files = Vec::new();
    collect(&root, "glsl", &mut files)?;
    files.sort();
    let mut code = String::from(
        "/// Name (path within `include/`, forward slashes) and text of every header.\npub static INCLUDES: &[(&str, &str)] = &[\n",
    );
    for file in &files {
        let name = file.strip_prefix(&root).unwrap_or(file).to_string_lossy().replace('\\', "/");
        let path = file.to_string_lossy();
        let _ = writeln!(code, "    ({name:?}, include_str!({path:?})),");
    }
    code.push_str("];\n");
    fs::write(PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default()).join("includes.rs"), code)
}

/// Gives the library `AFTERLIGHT_SHADER_SOURCE_HASH`.
fn hash_sources(src: &Path) -> io::Result<()> {
    println!("cargo:rerun-if-changed={}", src.display());
    let mut files = Vec::new();
    collect(src, "rs", &mut files)?;
    files.sort();
    let mut hasher = DefaultHasher::new();
    for file in &files {
        (file.strip_prefix(src).unwrap_or(file), fs::read(file)?).hash(&mut hasher);
    }
    println!("cargo:rustc-env=AFTERLIGHT_SHADER_SOURCE_HASH={:016x}", hasher.finish());
    Ok(())
}

fn collect(folder: &Path, extension: &str, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, extension, files)?;
        } else if path.extension().is_some_and(|found| found == extension) {
            files.push(path);
        }
    }
    Ok(())
}
