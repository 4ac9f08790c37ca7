use std::path::{Path, PathBuf};

/// What can be wrong with an image or its file. Its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// A file that cannot be read or written.
    #[error("{}: cannot be {verb} ({reason})", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// "read" or "written".
        verb: &'static str,
        /// What the system says.
        reason: String,
    },
    /// Content that is not of the format.
    #[error("{}: found {found}, expected {expected}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// What is there.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// A number of channels that does not fit the size.
    #[error(
        "image of {width}×{height}: found {found} channel values, expected {expected}, and more than none"
    )]
    Length {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Values given.
        found: usize,
        /// Values that the size needs.
        expected: usize,
    },
    /// Images of different sizes, which cannot be compared.
    #[error("{what}: found an image of {}×{}, expected {}×{} as the reference has", found.0, found.1, expected.0, expected.1)]
    SizeMismatch {
        /// The comparison.
        what: &'static str,
        /// Width and height of the tested image, pixels.
        found: (u32, u32),
        /// Width and height of the reference, pixels.
        expected: (u32, u32),
    },
}

impl ImageError {
    pub(crate) fn io(file: &Path, verb: &'static str, error: &std::io::Error) -> Self {
        Self::Io { file: file.to_owned(), verb, reason: one_line(&error.to_string()) }
    }

    pub(crate) fn invalid(file: &Path, found: impl std::fmt::Display, expected: &'static str) -> Self {
        Self::Invalid { file: file.to_owned(), found: one_line(&found.to_string()), expected }
    }
}

/// A message of another library without line breaks.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
