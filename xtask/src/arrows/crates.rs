//! The wall between crates: normal and build dependencies of every manifest. Tests may use any crate.

use std::{collections::BTreeMap, path::Path};

use toml_edit::{Document, Item, TableLike};

use super::{
    Broken, Table,
    tree::{files, from_root, text},
};
use crate::{Error, at, read};

/// A dependency as a manifest declares it.
struct Dependency {
    /// Name of the package.
    package: String,
    /// Line, from 1.
    line: usize,
}

struct Manifest {
    /// The crate's folder, from the root.
    folder: String,
    package: String,
    dependencies: Vec<Dependency>,
}

/// Checks every manifest below `root`.
pub fn check(root: &Path, table: &Table) -> Result<Vec<Broken>, Error> {
    let mut manifests = Vec::new();
    for path in files(root, &|path| path.file_name().is_some_and(|name| name == "Cargo.toml"))? {
        manifests.extend(manifest(root, &path)?);
    }
    let folder_of: BTreeMap<&str, &str> =
        manifests.iter().map(|m| (m.package.as_str(), m.folder.as_str())).collect();
    let mut broken = Vec::new();
    for found in &manifests {
        let file = Path::new(&found.folder).join("Cargo.toml");
        let Some(rule) = table.of(&found.folder) else {
            let expected = "a rule for it in xtask/src/arrows/table.rs".into();
            broken.push(Broken { file, line: 1, found: format!("the crate {}", found.folder), expected });
            continue;
        };
        for dependency in &found.dependencies {
            let Some(used) = folder_of.get(dependency.package.as_str()) else { continue };
            if !table.allows(rule, used) {
                broken.push(Broken {
                    file: file.clone(),
                    line: dependency.line,
                    found: format!("{} uses {used}", found.folder),
                    expected: format!("only {}: {}", list(rule.may_use), rule.reason),
                });
            }
        }
    }
    Ok(broken)
}

fn list(folders: &[&str]) -> String {
    if folders.is_empty() {
        "crates from outside the tree".into()
    } else {
        format!("{} and what these use", folders.join(", "))
    }
}

/// Reads a manifest; `None` where it holds no package.
fn manifest(root: &Path, path: &Path) -> Result<Option<Manifest>, Error> {
    let code = read(path)?;
    let document = Document::parse(code.as_str()).map_err(|error| at(path, error))?;
    let Some(package) = document.get("package").and_then(|p| p.get("name")).and_then(Item::as_str) else {
        return Ok(None);
    };
    let mut dependencies = Vec::new();
    collect(document.as_table(), &code, &mut dependencies);
    let targets = document.get("target").and_then(Item::as_table_like);
    for (_, target) in targets.into_iter().flat_map(TableLike::iter) {
        target.as_table_like().into_iter().for_each(|target| collect(target, &code, &mut dependencies));
    }
    let folder = text(&from_root(root, path.parent().unwrap_or(path)));
    Ok(Some(Manifest { folder, package: package.into(), dependencies }))
}

fn collect(table: &dyn TableLike, code: &str, found: &mut Vec<Dependency>) {
    for section in ["dependencies", "build-dependencies"] {
        let Some(section) = table.get(section).and_then(Item::as_table_like) else { continue };
        for (name, item) in section.iter() {
            let renamed = item.get("package").and_then(Item::as_str);
            let start = section.key(name).and_then(|key| key.span()).map_or(0, |span| span.start);
            let line = 1 + code.bytes().take(start).filter(|&byte| byte == b'\n').count();
            found.push(Dependency { package: renamed.unwrap_or(name).into(), line });
        }
    }
}
