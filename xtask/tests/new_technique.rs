//! A technique with a surface of its own is one folder: in a copy of the tree the commands of `docs/first-technique.md` are run as they
//! stand there. They make a technique from the template, build it, render it, compare it with `forward`; and nothing outside of its folder
//! has changed but generated tables.
//!
//! The copy is built in a folder of its own, which is kept between runs. It starts with what the tree's own build has made of dependencies.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The document, from the root of the tree.
const DOCUMENT: &str = "docs/first-technique.md";
/// Where the document makes its technique, from the root of the tree.
const FOLDER: &str = "crates/techniques/src/four_words/";
/// Documents with generated regions.
const GENERATED: &[&str] = &["README.md"];

/// Runs a program in a folder and returns what it prints.
fn output(program: &str, arguments: &[&str], folder: &Path) -> String {
    let output = Command::new(program).args(arguments).current_dir(folder).output();
    let output = output.unwrap_or_else(|error| panic!("cannot run {program}: {error}"));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: found {}\n{error}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// Copies a file; its time of change goes along, by which cargo tells what is to be built.
fn copy_file(from: &Path, to: &Path) {
    fs::create_dir_all(to.parent().unwrap()).unwrap();
    let file = |error| panic!("{}: {error}", from.display());
    fs::copy(from, to).unwrap_or_else(file);
    let modified =
        fs::metadata(from).and_then(|data| data.modified()).unwrap_or_else(|error| panic!("{error}"));
    fs::File::options().write(true).open(to).and_then(|file| file.set_modified(modified)).unwrap();
}

/// Copies the files that git knows or would add, and commits them to a repository of their own.
fn copy_tree(root: &Path, copy: &Path) {
    if copy.exists() {
        fs::remove_dir_all(copy).unwrap();
    }
    let files = output("git", &["ls-files", "-z", "--cached", "--others", "--exclude-standard"], root);
    for file in files.split('\0').filter(|file| !file.is_empty() && root.join(file).is_file()) {
        copy_file(&root.join(file), &copy.join(file));
    }
    // Where a tree has been built there is one; the document's commands write into it.
    fs::create_dir(copy.join("target")).unwrap();
    output("git", &["init", "--quiet"], copy);
    output("git", &["add", "--all"], copy);
    let author = ["-c", "user.name=test", "-c", "user.email=test@localhost"];
    let commit = ["commit", "--quiet", "--message", "The tree", "--no-gpg-sign"];
    output("git", &[&author[..], &commit[..]].concat(), copy);
}

/// The `sh` blocks of a document.
fn blocks(document: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut rest = document;
    while let Some((_, after)) = rest.split_once("\n```sh\n") {
        let (block, behind) = after.split_once("\n```").expect("the end of a block");
        blocks.push(block.to_owned());
        rest = behind;
    }
    blocks
}

/// Fills a folder of builds with what another one has of dependencies, so that the first build of the copy does not take minutes. Libraries
/// are linked, since compilers replace them and never write into them; the rest is copied.
fn seed(from: &Path, to: &Path) {
    for part in [".fingerprint", "build", "deps"] {
        seed_part(&from.join(part), &to.join(part));
    }
}

fn seed_part(from: &Path, to: &Path) {
    let Ok(entries) = fs::read_dir(from) else { return };
    fs::create_dir_all(to).unwrap();
    for entry in entries.map(Result::unwrap) {
        let (path, to) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            seed_part(&path, &to);
            continue;
        }
        let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        let is_library = ["rlib", "rmeta", "so", "dylib", "dll", "a"].contains(&extension.as_str());
        // In `deps` files without an extension are programs, such as this test: what is wanted of them is linked anew.
        let is_program = from.ends_with("deps") && extension.is_empty();
        if is_program || (is_library && fs::hard_link(&path, &to).is_ok()) {
            continue;
        }
        copy_file(&path, &to);
    }
}

/// Runs a block as a shell does that stops at the first error.
fn run(block: &str, copy: &Path, target: &Path) {
    let mut command = Command::new("sh");
    command.args(["-e", "-u", "-c", block]).current_dir(copy);
    command.env("CARGO_TARGET_DIR", target).env("CARGO_NET_OFFLINE", "true").env_remove("AFTERLIGHT_BLESS");
    // The copy has no shared scenes beside it, and what it skips is told by the tree's own tests.
    command.env_remove("AFTERLIGHT_EXPECTS").env_remove("AFTERLIGHT_SKIPS");
    println!("$ {block}");
    let start = std::time::Instant::now();
    let output = command.output().unwrap();
    let [out, error] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    println!("{out}{error}({:.1} s)\n", start.elapsed().as_secs_f64());
    assert!(output.status.success(), "{DOCUMENT}: `{block}`: found {}", output.status);
}

#[test]
fn a_new_technique_is_one_folder_and_agrees_with_forward() {
    let root = xtask::workspace();
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("new-technique");
    let (copy, target) = (place.join("tree"), place.join("target"));
    copy_tree(&root, &copy);
    // The folder of this test's own build: `PROFILE/deps/THIS_PROGRAM`.
    let program = std::env::current_exe().unwrap();
    let built = program.ancestors().nth(2).unwrap();
    let profile = target.join("debug");
    if built.ends_with("debug") && !profile.exists() {
        seed(built, &profile);
    }
    let blocks = blocks(&fs::read_to_string(copy.join(DOCUMENT)).unwrap());
    assert!(blocks.iter().any(|block| block.contains("cargo xtask new-technique four-words")));
    assert!(blocks.iter().any(|block| block.contains("--test agreement")));
    for block in &blocks {
        run(block, &copy, &target);
    }
    let status = output("git", &["status", "--short", "--untracked-files=all"], &copy);
    let changed: Vec<&str> = status.lines().map(|line| &line[3..]).collect();
    println!("{status}");
    assert!(changed.iter().any(|file| file.starts_with(FOLDER)), "found no technique in {status}");
    let elsewhere: Vec<_> =
        changed.iter().filter(|file| !file.starts_with(FOLDER) && !GENERATED.contains(file)).collect();
    assert!(elsewhere.is_empty(), "found changes in {elsewhere:?}, expected them in {FOLDER} alone");
    // Of what is generated nothing but one row is new.
    let difference = output("git", &["diff", "--unified=0", "README.md"], &copy);
    let lines: Vec<&str> = difference
        .lines()
        .filter(|line| {
            (line.starts_with('+') || line.starts_with('-'))
                && !line.starts_with("+++")
                && !line.starts_with("---")
        })
        .collect();
    assert!(matches!(lines[..], [row] if row.starts_with("+| [`four-words`]")), "found {lines:#?}");
    fs::remove_dir_all(&copy).unwrap();
}

/// Where a new technique draws what its neighbour draws, the test above would see nothing: the folder is looked at as well.
#[test]
fn the_template_has_a_source_of_its_own() {
    let template: PathBuf = xtask::workspace().join("xtask/template");
    let variants = fs::read_to_string(template.join("variants.txt")).unwrap();
    assert!(
        variants.contains("template surfaces/shade/shade.comp.glsl")
            && variants.contains("source=source.glsl")
    );
    assert!(template.join("source.glsl").is_file() && template.join("cost.rs.template").is_file());
}
