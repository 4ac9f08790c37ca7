//! Finds files.

use std::path::{Path, PathBuf};

use crate::{Error, at};

/// Folders that hold nothing which the rules are about: build outputs, the template of a technique, and tests, which may use anything.
const LEFT_OUT: &[&str] = &["target", "template", "tests", "benches", "fuzz"];

/// Every file below `folder` that `wanted` takes, sorted; none where there is no such folder.
pub fn files(folder: &Path, wanted: &dyn Fn(&Path) -> bool) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    collect(folder, wanted, &mut found)?;
    found.sort();
    Ok(found)
}

fn collect(folder: &Path, wanted: &dyn Fn(&Path) -> bool, found: &mut Vec<PathBuf>) -> Result<(), Error> {
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in std::fs::read_dir(folder).map_err(|error| at(folder, error))? {
        let path = entry.map_err(|error| at(folder, error))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let left_out = LEFT_OUT.contains(&name.as_ref()) || name.starts_with('.');
        if path.is_dir() && !left_out {
            collect(&path, wanted, found)?;
        } else if path.is_file() && name != "tests.rs" && wanted(&path) {
            found.push(path);
        }
    }
    Ok(())
}

/// Whether the file's name ends in `.extension`.
pub fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found == extension)
}

/// The path from the root of the tree.
pub fn from_root(root: &Path, path: &Path) -> PathBuf {
    path.strip_prefix(root).unwrap_or(path).to_path_buf()
}

/// The same with `/` between its parts.
pub fn text(path: &Path) -> String {
    path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}
