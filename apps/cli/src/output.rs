//! Files and standard output: a file is complete or absent.

use std::io::Write as _;
use std::path::Path;

use serde::Serialize;

use crate::args::JsonArgs;
use crate::failure::Failure;

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Input(format!(
        "{}: cannot be written ({error}), expected a file in a folder that can be written",
        path.display()
    ))
}

/// Writes a file: beside its place, then renamed into it.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    Ok(afterlight_image::write_atomically(path, bytes)?)
}

/// Makes a folder and those above it.
pub fn make_folder(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path).map_err(|error| cannot_write(path, &error))
}

/// Refuses a file whose folder is not there or cannot be written, before long work for it begins.
pub fn check_file(path: &Path) -> Result<(), Failure> {
    if path.is_dir() {
        return Err(Failure::option(&path.display().to_string(), "a folder", "a file to write"));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(Failure::option(
            &path.display().to_string(),
            format!("no folder {}", folder.display()),
            "a file in a folder that exists",
        ));
    }
    Ok(())
}

/// Writes JSON where `--json` says; nothing without it.
pub fn json(args: &JsonArgs, value: &impl Serialize) -> Result<(), Failure> {
    let Some(path) = &args.json else { return Ok(()) };
    let text = json_text(value)?;
    if args.on_stdout() {
        print(&text);
        return Ok(());
    }
    write_file(path, text.as_bytes())
}

/// JSON as it is written: indented, with a line's end.
pub fn json_text(value: &impl Serialize) -> Result<String, Failure> {
    let text =
        serde_json::to_string_pretty(value).map_err(|error| Failure::Failed(format!("JSON: {error}")))?;
    Ok(text + "\n")
}

/// Prints to standard output; a reader that closed the pipe has read enough.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Prints for people: to standard output, or to standard error where JSON takes the former.
pub fn tell(args: &JsonArgs, text: &str) {
    if args.on_stdout() {
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
    } else {
        print(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_is_whole_or_absent() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        write_file(&path, b"abc").expect("written");
        assert_eq!(fs::read(&path).expect("read"), b"abc");
        // A folder in its place: the rename fails, and nothing is left beside.
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).expect("made");
        let failure = write_file(&taken, b"abc").expect_err("fails");
        assert_eq!(failure.code(), 2);
        let names: Vec<_> =
            fs::read_dir(folder.path()).expect("listed").flatten().map(|e| e.file_name()).collect();
        assert_eq!(names.len(), 2, "{names:?}");
    }

    #[test]
    fn a_missing_folder_is_told_at_once() {
        assert!(check_file(Path::new("no/such/folder/a.png")).is_err());
        assert!(check_file(Path::new("a.png")).is_ok());
    }
}
