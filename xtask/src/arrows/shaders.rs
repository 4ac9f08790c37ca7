//! The wall between shaders: what `#include "…"` leads to, and what a manifest's `template … source=…` line does.

use std::path::{Path, PathBuf};

use super::{
    Broken, Table,
    tree::{files, from_root, has_extension, text},
};
use crate::{Error, read};

/// A name of a shader's file, and the file that it leads to.
pub struct Include {
    /// The file that names it: a shader, or a manifest.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// The name as it stands there.
    pub name: String,
    /// The file included.
    pub target: PathBuf,
}

/// Checks that shaders include those of crates which their own may use.
pub fn check(root: &Path, table: &Table) -> Result<Vec<Broken>, Error> {
    let all = files(root, &is_shader)?;
    let crate_of = |path: &Path| {
        let path = from_root(root, path);
        path.ancestors().skip(1).map(text).find_map(|folder| table.of(&folder).map(|rule| (folder, rule)))
    };
    let mut broken = Vec::new();
    for include in includes(&files(root, &names_shaders)?, &all)? {
        let (Some((from, rule)), Some((to, _))) = (crate_of(&include.file), crate_of(&include.target)) else {
            continue;
        };
        if from != to && !table.allows(rule, &to) {
            broken.push(Broken {
                file: from_root(root, &include.file),
                line: include.line,
                found: format!("`{}` of {to}", include.name),
                expected: format!("shaders of {from} and of what it may use: {}", rule.reason),
            });
        }
    }
    Ok(broken)
}

/// The includes of the shaders and manifests in `src` that lead to shaders in `src`.
pub fn includes_within(root: &Path, src: &Path) -> Result<Vec<Include>, Error> {
    let all = files(root, &is_shader)?;
    let own = files(src, &names_shaders)?;
    Ok(includes(&own, &all)?.into_iter().filter(|include| include.target.starts_with(src)).collect())
}

fn is_shader(path: &Path) -> bool {
    has_extension(path, "glsl")
}

fn is_manifest(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name == "variants.txt")
}

fn names_shaders(path: &Path) -> bool {
    is_shader(path) || is_manifest(path)
}

/// Reads the includes of `from`. One that leads to no file of `all` is a name that each variant gives its own file: it is left out.
fn includes(from: &[PathBuf], all: &[PathBuf]) -> Result<Vec<Include>, Error> {
    let mut found = Vec::new();
    for file in from {
        let named =
            |line| if is_manifest(file) { templates(line) } else { included(line).into_iter().collect() };
        for (index, line) in read(file)?.lines().enumerate() {
            for name in named(line) {
                let Some(target) = target(file, name, all) else { continue };
                let (file, line, target) = (file.clone(), index + 1, target.clone());
                found.push(Include { file, line, name: name.into(), target });
            }
        }
    }
    Ok(found)
}

/// The templates and the source that a line of a manifest names.
fn templates(line: &str) -> Vec<&str> {
    let mut words = line.split_whitespace();
    if words.next() != Some("template") {
        return Vec::new();
    }
    let mut names = Vec::new();
    for word in words {
        if let Some(source) = word.strip_prefix("source=") {
            names.push(source);
            break;
        }
        names.push(word);
    }
    names
}

/// The text between the quotes of an include.
fn included(line: &str) -> Option<&str> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?;
    rest.trim_start().strip_prefix('"')?.split('"').next()
}

/// The file of that name: beside the one that includes it, else the one that shares most of its path with it. Where the name could mean
/// several files the nearest is what the author meant.
fn target<'a>(file: &Path, name: &str, all: &'a [PathBuf]) -> Option<&'a PathBuf> {
    let shared = |path: &Path| path.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    all.iter()
        .filter(|path| path.ends_with(name))
        .max_by_key(|path| (shared(path), std::cmp::Reverse(path.components().count())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn includes_are_read() {
        assert_eq!(included("#include \"a/b.glsl\" // why"), Some("a/b.glsl"));
        assert_eq!(included("  # include \"b.glsl\""), Some("b.glsl"));
        assert_eq!(included("// #include \"b.glsl\""), None);
        assert_eq!(included("#define A"), None);
    }

    #[test]
    fn templates_of_manifests_are_read() {
        let line = "template a/b.comp.glsl a/c.frag.glsl source=mine.glsl #tag ONE";
        assert_eq!(templates(line), ["a/b.comp.glsl", "a/c.frag.glsl", "mine.glsl"]);
        assert_eq!(templates("fill.frag.glsl #mask ALPHA_MASK"), [""; 0]);
    }

    #[test]
    fn the_nearest_file_is_meant() {
        let all: Vec<PathBuf> =
            ["/t/a/src/x/list.glsl", "/t/b/src/x/list.glsl"].iter().map(PathBuf::from).collect();
        assert_eq!(target(Path::new("/t/b/src/y/s.glsl"), "x/list.glsl", &all), Some(&all[1]));
        assert_eq!(target(Path::new("/t/b/src/y/s.glsl"), "st.glsl", &all), None);
    }
}
