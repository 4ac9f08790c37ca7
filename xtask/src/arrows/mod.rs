//! `cargo xtask arrows`: imports run one way. Three walls are held against [`TABLE`]: between crates (manifests), between the folders of a
//! crate (Rust paths) and between shaders (`#include`); and nothing below the techniques names one.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use crate::Error;

mod circles;
mod crates;
mod folders;
mod names;
mod scan;
mod shaders;
mod table;
mod tree;

pub use table::{Crate, Folders, Names, Rule, TABLE, Table};

/// An import that runs the wrong way.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Broken {
    /// File, from the root of the tree.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// What stands there.
    pub found: String,
    /// What may stand there.
    pub expected: String,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: found {}, expected {}", self.file.display(), self.line, self.found, self.expected)
    }
}

/// Checks the tree at `root`; returns every broken arrow, by file and line. Crates and folders of the table that the tree does not have are
/// passed over.
///
/// # Errors
/// A file that cannot be read, or a manifest that is no TOML.
pub fn check(root: &Path, table: &Table) -> Result<Vec<Broken>, Error> {
    let mut broken = crates::check(root, table)?;
    for folders in table.folders {
        broken.extend(folders::check(root, folders)?);
    }
    broken.extend(shaders::check(root, table)?);
    broken.extend(names::check(root, table)?);
    broken.sort();
    broken.dedup();
    Ok(broken)
}
