use std::{
    ffi::OsString,
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU32, Ordering},
};

use crate::ImageError;

/// Largest image file that is read, bytes.
const FILE_BYTES_MAX: u64 = 1 << 31;

/// Writes bytes to a file: beside it first, then renamed over it, so that the file is either
/// complete or as it was. On an error nothing is left behind.
///
/// # Errors
/// [`ImageError::Io`] names the file.
pub fn write_atomically(file: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let beside = name_beside(file);
    let written = File::create_new(&beside)
        .and_then(|mut f| f.write_all(bytes).and_then(|()| f.flush()))
        .and_then(|()| fs::rename(&beside, file));
    written.map_err(|e| {
        // the first error is the one to tell; the file may never have come to be
        let _ = fs::remove_file(&beside);
        ImageError::io(file, "written", &e)
    })
}

/// A name in the same folder that no other writer of this process or another has.
fn name_beside(file: &Path) -> PathBuf {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let mut name = OsString::from(".");
    name.push(file.file_name().unwrap_or_default());
    name.push(format!(".{}-{}.part", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed)));
    file.with_file_name(name)
}

/// Reads a file as a whole.
pub(crate) fn read(file: &Path) -> Result<Vec<u8>, ImageError> {
    let metadata = fs::metadata(file).map_err(|e| ImageError::io(file, "read", &e))?;
    if !metadata.is_file() {
        return Err(ImageError::invalid(file, "a folder or device", "a regular file"));
    }
    if metadata.len() > FILE_BYTES_MAX {
        return Err(ImageError::invalid(file, format!("{} bytes", metadata.len()), "at most 2 GiB"));
    }
    fs::read(file).map_err(|e| ImageError::io(file, "read", &e))
}
