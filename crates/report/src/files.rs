//! Files: each is complete or absent.

use std::path::{Path, PathBuf};

use afterlight_image::ImageError;
use serde::Serialize;

use crate::Report;

/// A file that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// A file, by the writer of all files.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A folder that cannot be made.
    #[error("{}: cannot be written ({reason}), expected a file in a folder that can be written", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// A place where no file can be.
    #[error("{}: found {found}, expected {expected}", file.display())]
    Place {
        /// The file.
        file: PathBuf,
        /// What is there.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// Figures that cannot be written as JSON.
    #[error("JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Writes a file: beside its place, then renamed into it.
///
/// # Errors
/// [`FileError::Image`] names the file.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    Ok(afterlight_image::write_atomically(path, bytes)?)
}

/// Makes a folder and those above it.
///
/// # Errors
/// [`FileError::Folder`] names it.
pub fn make_folder(path: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(path)
        .map_err(|error| FileError::Folder { folder: path.to_owned(), reason: error.to_string() })
}

/// Refuses a file whose folder is not there or cannot be written, before long work for it begins.
///
/// # Errors
/// [`FileError::Place`] with what is there.
pub fn check_file(path: &Path) -> Result<(), FileError> {
    let place = |found: String, expected| FileError::Place { file: path.to_owned(), found, expected };
    if path.is_dir() {
        return Err(place("a folder".to_owned(), "a file to write"));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(place(format!("no folder {}", folder.display()), "a file in a folder that exists"));
    }
    Ok(())
}

/// JSON as it is written: indented, with a line's end.
///
/// # Errors
/// Values that JSON cannot hold.
pub fn json_text(value: &impl Serialize) -> Result<String, FileError> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}

/// Writes `report.html` and its figures, `report.json`, into a folder and returns the path of the former.
///
/// # Errors
/// [`FileError`] names the file.
pub fn write_report(folder: &Path, report: &Report<'_>, json: &str) -> Result<PathBuf, FileError> {
    let path = folder.join("report.html");
    write_file(&path, report.html().as_bytes())?;
    write_file(&folder.join("report.json"), json.as_bytes())?;
    Ok(path)
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
        let error = write_file(&taken, b"abc").expect_err("fails");
        assert!(matches!(error, FileError::Image(_)) && error.to_string().contains("taken"), "{error}");
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
