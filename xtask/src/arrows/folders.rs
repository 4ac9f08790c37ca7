//! The wall between the folders of a crate: what the paths in its Rust code, and the includes of its shaders, lead to.
//!
//! A folder is a module with a folder of its own, to a depth of two: `lights/cells`, `lights`. Modules that are files beside `lib.rs` count
//! one by one; they may use each other in circles, but not in one that passes through a folder.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use super::{
    Broken, Folders, Rule,
    circles::on_circles,
    scan::{Reference, Scan, scan},
    shaders,
    tree::{files, from_root, has_extension},
};
use crate::{Error, read};

/// A folder that uses another, and the first place where it does.
struct Arrow {
    from: String,
    to: String,
    file: PathBuf,
    line: usize,
}

/// Checks the folders of one crate.
pub fn check(root: &Path, folders: &Folders) -> Result<Vec<Broken>, Error> {
    let src = root.join(folders.crate_folder).join("src");
    let code = Modules::read(&src)?;
    let mut arrows = code.arrows(root);
    for include in shaders::includes_within(root, &src)? {
        let unit = |path: &Path| code.unit(&path.parent().map(parts).unwrap_or_default());
        if let (Some(from), Some(to)) =
            (unit(&from_root(&src, &include.file)), unit(&from_root(&src, &include.target)))
        {
            arrows.push(Arrow { from, to, file: from_root(root, &include.file), line: include.line });
        }
    }
    arrows.retain(|arrow| arrow.from != arrow.to);
    let (mut broken, mut sound) = (Vec::new(), Vec::new());
    for arrow in arrows {
        match against_rule(&arrow, folders, &code) {
            Some(found) => broken.push(found),
            None => sound.push(arrow),
        }
    }
    broken.extend(circles(&sound, &code));
    Ok(broken)
}

fn against_rule(arrow: &Arrow, folders: &Folders, code: &Modules) -> Option<Broken> {
    let expected = match folders.rule {
        Rule::Layers(layers) => {
            let layer =
                |folder: &str| layers.iter().position(|layer| layer.iter().any(|name| lies_in(folder, name)));
            let (from, to) = (layer(&arrow.from)?, layer(&arrow.to)?);
            (to > from).then(|| {
                let below: Vec<&str> = layers[..=from].concat();
                format!("only {}", below.join(", "))
            })?
        }
        Rule::Parents(shared) => {
            // A file beside `lib.rs` (the registry) may name every folder.
            let free = !code.is_folder(&arrow.from)
                || lies_in(&arrow.from, &arrow.to)
                || shared.iter().any(|name| lies_in(&arrow.to, name));
            (!free).then(|| {
                let parent = arrow.from.rsplit_once('/').map(|(parent, _)| parent);
                let allowed: Vec<&str> = parent.into_iter().chain(shared.iter().copied()).collect();
                if allowed.is_empty() {
                    "no other folder".into()
                } else {
                    format!("only {}", allowed.join(", "))
                }
            })?
        }
    };
    Some(Broken {
        file: arrow.file.clone(),
        line: arrow.line,
        found: format!("{} uses {}", arrow.from, arrow.to),
        expected: format!("{expected}: {}", folders.reason),
    })
}

fn lies_in(folder: &str, parent: &str) -> bool {
    folder.strip_prefix(parent).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// The arrows that lie on a circle through a folder.
fn circles(arrows: &[Arrow], code: &Modules) -> Vec<Broken> {
    let pairs: BTreeSet<(&str, &str)> = arrows.iter().map(|a| (a.from.as_str(), a.to.as_str())).collect();
    let on_circle: Vec<(&str, &str)> = on_circles(&pairs)
        .into_iter()
        .filter(|(from, to)| code.is_folder(from) || code.is_folder(to))
        .collect();
    let first = |from: &str, to: &str| arrows.iter().find(|a| a.from == from && a.to == to);
    let mut broken = Vec::new();
    for (from, to) in on_circle {
        let Some(arrow) = first(from, to) else { continue };
        let back = way(&pairs, to, from).join(" → ");
        broken.push(Broken {
            file: arrow.file.clone(),
            line: arrow.line,
            found: format!("{from} uses {to}"),
            expected: format!("no circle: {back} leads back"),
        });
    }
    broken
}

/// The shortest way along arrows between two folders, both ends included.
fn way<'a>(pairs: &BTreeSet<(&'a str, &'a str)>, start: &'a str, end: &str) -> Vec<&'a str> {
    let mut came_from: BTreeMap<&str, &str> = BTreeMap::new();
    let mut open = std::collections::VecDeque::from([start]);
    while let Some(at) = open.pop_front() {
        if at == end {
            let mut steps = vec![at];
            while let Some(&before) =
                steps.last().filter(|&&last| last != start).and_then(|last| came_from.get(last))
            {
                steps.push(before);
            }
            steps.reverse();
            return steps;
        }
        for &(_, to) in pairs.iter().filter(|(from, _)| *from == at) {
            if to != start && !came_from.contains_key(to) {
                came_from.insert(to, at);
                open.push_back(to);
            }
        }
    }
    Vec::new()
}

fn parts(path: &Path) -> Vec<String> {
    path.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect()
}

/// The modules of a crate.
struct Modules {
    src: PathBuf,
    /// What each module's file names, by the module's path.
    scans: BTreeMap<Vec<String>, (PathBuf, Scan)>,
}

impl Modules {
    fn read(src: &Path) -> Result<Self, Error> {
        let mut scans = BTreeMap::new();
        for file in files(src, &|path| has_extension(path, "rs"))? {
            let code = read(&file)?;
            scans.insert(module_of(&from_root(src, &file)), (file, scan(&code)));
        }
        Ok(Self { src: src.into(), scans })
    }

    fn arrows(&self, root: &Path) -> Vec<Arrow> {
        let mut arrows = Vec::new();
        for (module, (file, scan)) in &self.scans {
            let Some(from) = self.unit(module) else { continue };
            for reference in &scan.references {
                let Some(target) = self.resolve(module, reference) else { continue };
                // What a module gives on of the modules in it is no use of them.
                if reference.exported_as.is_some()
                    && target.len() > module.len()
                    && target.starts_with(module)
                {
                    continue;
                }
                if let Some(to) = self.unit(&target) {
                    arrows.push(Arrow {
                        from: from.clone(),
                        to,
                        file: from_root(root, file),
                        line: reference.line,
                    });
                }
            }
        }
        arrows
    }

    /// The folder, or the file beside `lib.rs`, that a module belongs to; `None` for `lib.rs` itself.
    fn unit(&self, module: &[String]) -> Option<String> {
        let first = module.first()?;
        match module.get(1) {
            Some(second) if self.src.join(first).join(second).is_dir() => Some(format!("{first}/{second}")),
            _ => Some(first.clone()),
        }
    }

    fn is_folder(&self, unit: &str) -> bool {
        self.src.join(unit).is_dir()
    }

    /// The module that a path leads to, through what modules give on.
    fn resolve(&self, module: &[String], reference: &Reference) -> Option<Vec<String>> {
        let here: Vec<String> = module.iter().chain(&reference.inside).cloned().collect();
        self.follow(&here, &reference.path, 8)
    }

    fn follow(&self, here: &[String], path: &[String], steps: usize) -> Option<Vec<String>> {
        let mut at: Vec<String> = Vec::new();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => rest = &path[1..],
            "self" | "super" => {
                at = here.to_vec();
                while let Some(word) = rest.first().filter(|word| matches!(word.as_str(), "self" | "super")) {
                    if word == "super" {
                        at.pop();
                    }
                    rest = &rest[1..];
                }
            }
            _ => at = here.to_vec(),
        }
        while let Some(name) = rest.first() {
            let inner: Vec<String> = at.iter().cloned().chain([name.clone()]).collect();
            if self.scans.contains_key(&inner) || self.src.join(PathBuf::from_iter(&inner)).is_dir() {
                at = inner;
                rest = &rest[1..];
                continue;
            }
            let given_on = self.scans.get(&at).and_then(|(_, scan)| {
                scan.references
                    .iter()
                    .find(|r| r.exported_as.as_ref() == Some(name) && r.path.as_slice() != path)
            });
            return match given_on {
                Some(given_on) if steps > 0 => {
                    let inside: Vec<String> = at.iter().chain(&given_on.inside).cloned().collect();
                    self.follow(&inside, &given_on.path, steps - 1)
                }
                _ => Some(at),
            };
        }
        Some(at)
    }
}

/// The path of the module that a file holds, given from `src`.
fn module_of(file: &Path) -> Vec<String> {
    let mut module = parts(file);
    let name = module.pop().unwrap_or_default();
    match name.as_str() {
        "mod.rs" => {}
        "lib.rs" | "main.rs" if module.is_empty() => {}
        _ => module.push(name.trim_end_matches(".rs").into()),
    }
    module
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_modules() {
        assert_eq!(module_of(Path::new("lib.rs")), Vec::<String>::new());
        assert_eq!(module_of(Path::new("a/mod.rs")), ["a"]);
        assert_eq!(module_of(Path::new("a/b/c.rs")), ["a", "b", "c"]);
    }
}
