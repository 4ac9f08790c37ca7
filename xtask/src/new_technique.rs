//! `cargo xtask new-technique ID`: makes the folder of a technique from the template in `xtask/template`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{Error, at, read};

/// Where techniques stand, from the root of the tree.
const TECHNIQUES: &str = "crates/techniques/src";
/// Where the template stands.
const TEMPLATE: &str = "xtask/template";
/// The longest id: it stands in tables.
const LONGEST_ID: usize = 40;

/// Makes the folder of a technique in the tree at `root` and returns it. The template's files are copied; in them, and in their names,
/// `TECHNIQUE_ID`, `technique_folder`, `TechniqueType` and `TECHNIQUE_TITLE` are replaced.
///
/// # Errors
/// An id that is none, or whose folder there is already; a file that cannot be read or written.
pub fn make(root: &Path, id: &str, title: Option<&str>) -> Result<PathBuf, Error> {
    check_id(id)?;
    let title = title.map_or_else(|| sentence(id), str::to_string);
    check_title(&title)?;
    let folder_name = id.replace('-', "_");
    let folder = root.join(TECHNIQUES).join(&folder_name);
    if folder.exists() {
        return Err(at(&folder, "found a folder, expected none: choose another id"));
    }
    let replaced = |text: &str| {
        text.replace("TECHNIQUE_ID", id)
            .replace("technique_folder", &folder_name)
            .replace("TechniqueType", &type_name(id))
            .replace("TECHNIQUE_TITLE", &title)
    };
    let files = template(&root.join(TEMPLATE))?;
    fs::create_dir_all(&folder).map_err(|error| at(&folder, error))?;
    for (name, content) in files {
        let path = folder.join(replaced(&name));
        fs::write(&path, replaced(&content)).map_err(|error| at(&path, error))?;
    }
    Ok(folder)
}

/// The template's files: name and content, in order. The template has no folders.
fn template(folder: &Path) -> Result<Vec<(String, String)>, Error> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(|error| at(folder, error))? {
        let path = entry.map_err(|error| at(folder, error))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Rust files of the template end in `.template`, so that no tool takes them for code of this crate.
        files.push((name.trim_end_matches(".template").into(), read(&path)?));
    }
    files.sort();
    Ok(files)
}

/// Words of lower-case letters and digits, the first beginning with a letter, joined by single `-`.
fn check_id(id: &str) -> Result<(), Error> {
    let word =
        |word: &str| !word.is_empty() && word.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
    let sound =
        id.len() <= LONGEST_ID && id.split('-').all(word) && id.starts_with(|c: char| c.is_ascii_lowercase());
    if !sound {
        let expected =
            format!("lower-case words joined by `-`, at most {LONGEST_ID} letters (such as light-list)");
        return Err(Error(format!("a technique's id: found `{id}`, expected {expected}")));
    }
    // The folder's name becomes a Rust module.
    if KEYWORDS.contains(&id) {
        return Err(Error(format!("a technique's id: found `{id}`, expected no keyword of Rust")));
    }
    Ok(())
}

/// Keywords that would pass as ids.
const KEYWORDS: &[&str] = &[
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn",
    "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop",
    "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static",
    "struct", "super", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual",
    "where", "while", "yield",
];

/// A title stands in a Rust literal, a table of Markdown and a page of HTML.
fn check_title(title: &str) -> Result<(), Error> {
    let bad = title.chars().find(|c| c.is_control() || matches!(c, '"' | '\\' | '|' | '<' | '>' | '`'));
    match bad {
        _ if title.trim().is_empty() => {
            Err(Error("a technique's title: found nothing, expected a few words".into()))
        }
        Some(c) => Err(Error(format!("a technique's title: found {c:?} in `{title}`, expected plain words"))),
        None => Ok(()),
    }
}

/// `light-list` as `Light list`.
fn sentence(id: &str) -> String {
    let words = id.replace('-', " ");
    words[..1].to_uppercase() + &words[1..]
}

/// `light-list` as `LightList`.
fn type_name(id: &str) -> String {
    id.split('-').map(|word| word[..1].to_uppercase() + &word[1..]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let template = root.path().join(TEMPLATE);
        fs::create_dir_all(&template).unwrap();
        fs::create_dir_all(root.path().join(TECHNIQUES)).unwrap();
        fs::write(template.join("mod.rs.template"), "struct TechniqueType; // TECHNIQUE_ID, TECHNIQUE_TITLE")
            .unwrap();
        fs::write(template.join("technique_folder.frag.glsl"), "#include \"technique_folder/a.glsl\"")
            .unwrap();
        root
    }

    #[test]
    fn the_template_is_copied_and_filled() {
        let root = root();
        let folder = make(root.path(), "my-idea-2", None).unwrap();
        assert_eq!(folder, root.path().join(TECHNIQUES).join("my_idea_2"));
        assert_eq!(read(&folder.join("mod.rs")).unwrap(), "struct MyIdea2; // my-idea-2, My idea 2");
        assert_eq!(read(&folder.join("my_idea_2.frag.glsl")).unwrap(), "#include \"my_idea_2/a.glsl\"");
    }

    #[test]
    fn a_folder_that_exists_is_left_alone() {
        let root = root();
        make(root.path(), "idea", Some("An idea")).unwrap();
        let error = make(root.path(), "idea", Some("Another")).unwrap_err();
        assert!(error.0.contains("found a folder, expected none"), "{error}");
        assert!(read(&root.path().join(TECHNIQUES).join("idea/mod.rs")).unwrap().contains("An idea"));
    }

    #[test]
    fn ids_and_titles_that_are_none_are_refused() {
        let root = root();
        for id in ["", "-", "a-", "A", "a_b", "1a", "a--b", "../a", "a b", "type", &"a".repeat(41)] {
            let error = make(root.path(), id, None).unwrap_err();
            assert!(error.0.contains("found") && error.0.contains("expected"), "{error}");
        }
        for title in ["", " ", "a\"b", "a|b", "a\nb"] {
            assert!(make(root.path(), "a", Some(title)).unwrap_err().0.contains("expected"));
        }
        assert!(fs::read_dir(root.path().join(TECHNIQUES)).unwrap().next().is_none());
    }
}
