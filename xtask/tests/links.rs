//! Every relative link of the documents leads to a file.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Folders that hold no documents of the project; the links of the template are those of the folder that is made from it.
const LEFT_OUT: &[&str] = &["target", "shared", "template"];

fn documents(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !name.starts_with('.') && !LEFT_OUT.contains(&name.as_str()) {
            documents(&path, found);
        } else if name.ends_with(".md") {
            found.push(path);
        }
    }
}

/// The targets of a document's links, with their lines from 1; code is left out.
fn links(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut in_code = false;
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        if in_code {
            continue;
        }
        let mut rest = line;
        while let Some((_, after)) = rest.split_once("](") {
            let Some((target, behind)) = after.split_once(')') else { break };
            found.push((index + 1, target.split_whitespace().next().unwrap_or_default().into()));
            rest = behind;
        }
    }
    found
}

/// What is wrong with the links of a document: those that lead to no file.
fn broken(root: &Path, document: &Path) -> Vec<String> {
    let text = fs::read_to_string(document).unwrap();
    let folder = document.parent().unwrap();
    let leads_nowhere = |target: &str| {
        let file = target.split('#').next().unwrap_or_default();
        let elsewhere = target.contains("://") || target.starts_with("mailto:");
        !elsewhere && !file.is_empty() && !folder.join(file).exists()
    };
    let from_root = document.strip_prefix(root).unwrap().display();
    let links = links(&text).into_iter().filter(|(_, target)| leads_nowhere(target));
    links
        .map(|(line, target)| format!("{from_root}:{line}: found a link to {target}, expected a file"))
        .collect()
}

#[test]
fn links_of_the_documents_lead_to_files() {
    let root = xtask::workspace();
    let mut all = Vec::new();
    documents(&root, &mut all);
    assert!(all.len() > 20, "found {} documents", all.len());
    let broken: Vec<String> = all.iter().flat_map(|document| broken(&root, document)).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn a_link_that_leads_nowhere_is_seen() {
    let root = tempfile::tempdir().unwrap();
    let document = root.path().join("a.md");
    let text =
        "[here](a.md#top) [web](https://a.b/c) [up](#top)\n```\n[code](no.md)\n```\n[gone](b/gone.md)\n";
    fs::write(&document, text).unwrap();
    assert_eq!(broken(root.path(), &document), ["a.md:5: found a link to b/gone.md, expected a file"]);
}
