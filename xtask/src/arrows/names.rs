//! Nothing below the techniques names one: not in a literal, not in a variant's line, not in a shader's words.

use std::path::Path;

use super::{
    Broken, Table,
    scan::{scan, words},
    tree::{files, from_root, has_extension},
};
use crate::{Error, read};

/// Checks the silent folders of the table.
pub fn check(root: &Path, table: &Table) -> Result<Vec<Broken>, Error> {
    let ids = ids(&root.join(table.names.techniques))?;
    let mut broken = Vec::new();
    for folder in table.names.silent {
        for file in
            files(&root.join(folder), &|path| ["rs", "glsl", "txt"].iter().any(|e| has_extension(path, e)))?
        {
            for (line, text) in texts(&file)? {
                let named =
                    ids.iter().find(|id| names(&text, id, table.names.plain_words.contains(&id.as_str())));
                if let Some(id) = named {
                    broken.push(Broken {
                        file: from_root(root, &file),
                        line,
                        found: format!("`{text}`, which names the technique {id}"),
                        expected: format!(
                            "no technique's name in {folder}: what is below the techniques knows none"
                        ),
                    });
                }
            }
        }
    }
    Ok(broken)
}

/// The texts of a file that could name a technique, comments left out.
fn texts(file: &Path) -> Result<Vec<(usize, String)>, Error> {
    let code = read(file)?;
    Ok(match file.extension().and_then(|e| e.to_str()) {
        Some("rs") => scan(&code).literals,
        Some("glsl") => words(&code),
        _ => {
            let lines = code.lines().enumerate().filter(|(_, line)| !line.starts_with('#'));
            lines
                .flat_map(|(i, line)| line.split_whitespace().map(move |word| (i + 1, word.into())))
                .collect()
        }
    })
}

/// The ids of all techniques: their folders' names with `-` for `_`.
fn ids(techniques: &Path) -> Result<Vec<String>, Error> {
    let mut ids = Vec::new();
    for file in files(techniques, &|path| path.file_name().is_some_and(|name| name == "mod.rs"))? {
        if read(&file)?.lines().any(|line| line.starts_with("pub static TECHNIQUE:")) {
            let folder = file.parent().and_then(Path::file_name).unwrap_or_default();
            ids.push(folder.to_string_lossy().replace('_', "-"));
        }
    }
    // The longest first, so that `dais-list` is not told as `dais`.
    ids.sort_by_key(|id| std::cmp::Reverse(id.len()));
    Ok(ids)
}

/// Whether a text names the technique: its id as whole words joined by `-` or `_`, or, for a word of the field, as the folder of a name.
fn names(text: &str, id: &str, plain_word: bool) -> bool {
    let text = text.to_lowercase().replace('_', "-");
    if plain_word {
        return text.starts_with(&format!("{id}/"));
    }
    text.match_indices(id).any(|(start, _)| {
        let outside = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric());
        outside(text[..start].chars().next_back()) && outside(text[start + id.len()..].chars().next())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_words_are_names() {
        assert!(names("SOURCE_DAIS_LIST", "dais", false));
        assert!(names("multisample/shade.comp#dais-one", "dais", false));
        assert!(names("light_list", "light-list", false));
        assert!(!names("light_lists/append", "light-list", false));
        assert!(!names("a light list", "light-list", false));
        assert!(!names("the tiled ones", "tiled", true));
        assert!(names("tiled/shade.comp", "tiled", true));
    }
}
