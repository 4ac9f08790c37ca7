//! The project's chores, run as `cargo xtask NAME`: see [`arrows`] and [`new_technique`].

use std::{
    fmt,
    path::{Path, PathBuf},
};

pub mod arrows;
pub mod new_technique;

/// Why a chore could not be done: what, found, expected, in one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error(pub String);

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

/// Returns an error that says what happened at `path`.
pub(crate) fn at(path: &Path, what: impl fmt::Display) -> Error {
    Error(format!("{}: {what}", path.display()))
}

/// Reads a text file.
pub(crate) fn read(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|error| at(path, error))
}

/// The root of the tree that this program is run in: the one of the package that cargo runs, else the one that it was built from.
pub fn workspace() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let here = package.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")));
    here.parent().map(Path::to_path_buf).unwrap_or(here)
}
