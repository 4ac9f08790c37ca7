//! Tables of the documents that come from the registry: what stands between `<!-- generated: NAME -->` and `<!-- end generated -->` is what
//! the registry gives. `cargo xtask tables` (this test with `AFTERLIGHT_BLESS=1`) writes them.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use afterlight_techniques::{Info, registry};

/// Documents with generated regions, from the root of the tree.
const DOCUMENTS: &[&str] = &["README.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folder of each technique in `folder` and below, from the root of the tree: that of its id with `_` for `-`.
fn folders(folder: &Path, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if !path.is_dir() {
            continue;
        }
        let is_technique = fs::read_to_string(path.join("mod.rs"))
            .is_ok_and(|code| code.lines().any(|line| line.starts_with("pub static TECHNIQUE:")));
        if is_technique {
            let name = path.file_name().unwrap().to_string_lossy().replace('_', "-");
            let inside = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap();
            found.insert(name, format!("crates/techniques/{}", inside.display()));
        }
        folders(&path, found);
    }
}

/// The row of a technique without its last cell.
fn row(info: &Info, folder: &str) -> String {
    let answers = info.answers;
    let cells = [info.title, answers.surface, answers.lights, answers.schedule];
    format!("| [`{}`]({folder}/README.md) | {} |", info.id, cells.join(" | "))
}

/// The table of all techniques. Its last column, bytes a pixel, is written by hand: it is kept from the table that stood there.
fn techniques(before: &str) -> String {
    let mut folders_by_id = BTreeMap::new();
    folders(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut folders_by_id);
    let mut table = String::from(
        "| id | technique | surface | lights | shading runs in | bytes a pixel |\n| --- | --- | --- | --- | --- | --- |\n",
    );
    for technique in registry() {
        let info = technique.info();
        let folder = folders_by_id.get(info.id).unwrap_or_else(|| panic!("found no folder of {}", info.id));
        let own = format!("| [`{}`]", info.id);
        let kept = before.lines().find(|line| line.starts_with(&own));
        let bytes = kept.and_then(|line| line.trim_end().strip_suffix('|')?.rsplit('|').next());
        table += &format!("{} {} |\n", row(info, folder), bytes.unwrap_or("see its README").trim());
    }
    table
}

/// What a region holds; `before` is what stands there.
fn generated(name: &str, before: &str) -> String {
    match name {
        "techniques" => techniques(before),
        _ => panic!("found a generated region `{name}`, expected one of: techniques"),
    }
}

/// The document with every region as it should be.
fn filled(document: &str) -> String {
    let (start, close, end) = ("<!-- generated: ", " -->\n", "<!-- end generated -->");
    let mut text = String::new();
    let mut rest = document;
    while let Some((before, after)) = rest.split_once(start) {
        let (name, after) = after.split_once(close).expect("the name of a region and ` -->`");
        let (region, after) =
            after.split_once(end).unwrap_or_else(|| panic!("region {name}: expected `{end}`"));
        text += &format!("{before}{start}{name}{close}{}{end}", generated(name, region));
        rest = after;
    }
    text + rest
}

#[test]
fn tables_of_the_documents_are_those_of_the_registry() {
    for document in DOCUMENTS {
        let path = root().join(document);
        let found = fs::read_to_string(&path).unwrap();
        assert!(found.contains("<!-- generated: "), "{document}: found no generated region");
        let expected = filled(&found);
        if std::env::var_os("AFTERLIGHT_BLESS").is_some() {
            fs::write(&path, &expected).unwrap();
        } else if let Some((found, expected)) = found.lines().zip(expected.lines()).find(|(a, b)| a != b) {
            panic!("{document}: found\n{found}\nexpected\n{expected}\n`cargo xtask tables` writes it");
        } else {
            assert_eq!(
                found.lines().count(),
                expected.lines().count(),
                "{document}: run `cargo xtask tables`"
            );
        }
    }
}

#[test]
fn a_stale_table_is_seen() {
    let stale =
        "a\n<!-- generated: techniques -->\n| [`forward`](old) | old | 12 S |\n<!-- end generated -->\nb\n";
    let fresh = filled(stale);
    assert_ne!(stale, fresh);
    assert!(
        fresh.starts_with("a\n<!-- generated: techniques -->\n| id |")
            && fresh.ends_with("<!-- end generated -->\nb\n")
    );
    assert!(fresh.contains("fragment shader | 12 S |\n"), "the last cell is kept: {fresh}");
    assert_eq!(filled(&fresh), fresh);
}
