//! What can be wrong with a scene: one line each that names file or option, what was found, what is expected.

use std::path::{Path, PathBuf};

/// An error of loading or making a scene. Its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file that cannot be read.
    #[error("{}: cannot be read ({reason}); expected a readable file", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// A file name whose extension is of no known format.
    #[error("{}: found {found}, expected a scene file named .gltf, .glb or .obj, or builtin:NAME", file.display())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
        /// Its extension, in words.
        found: String,
    },
    /// Content that breaks the rules of its format.
    #[error("{}: {at}: found {found}, expected {expected}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Place within it, as a path of properties.
        at: String,
        /// What is there.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// Content that is right but that this program cannot show.
    #[error("{}: {what} is not supported, expected {expected}", file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// What is not supported.
        what: String,
        /// What is.
        expected: String,
    },
    /// More than the scene model can hold.
    #[error("{}: {what}: found {found}, expected at most {limit}", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// What there is too much of.
        what: String,
        /// How much there is.
        found: u64,
        /// How much there may be.
        limit: u64,
    },
    /// A built-in scene of an unknown name.
    #[error("builtin scene: found {found}, expected one of {known}")]
    UnknownBuiltin {
        /// The name given.
        found: String,
        /// The names that exist.
        known: String,
    },
    /// An option or parameter with a bad value.
    #[error("{name}: found {found}, expected {expected}")]
    BadParameter {
        /// The parameter.
        name: String,
        /// The value given.
        found: String,
        /// What it may be.
        expected: String,
    },
}

impl SceneError {
    /// An [`SceneError::Invalid`]; line breaks and other control characters in the texts are
    /// shown escaped, long texts shortened, since they may come from the file.
    pub fn invalid(
        file: &Path,
        at: impl AsRef<str>,
        found: impl AsRef<str>,
        expected: impl AsRef<str>,
    ) -> Self {
        Self::Invalid {
            file: file.to_owned(),
            at: one_line(at.as_ref()),
            found: one_line(found.as_ref()),
            expected: one_line(expected.as_ref()),
        }
    }

    /// An [`SceneError::Io`].
    pub fn io(file: &Path, error: &std::io::Error) -> Self {
        Self::Io { file: file.to_owned(), reason: one_line(&error.to_string()) }
    }
}

/// Longest text from a file in a message, in characters: longer ones are cut.
const TEXT_CHARS_MAX: usize = 200;

/// The text without control characters, at most [`TEXT_CHARS_MAX`] long.
pub(crate) fn one_line(text: &str) -> String {
    let mut out = String::new();
    for (i, c) in text.chars().enumerate() {
        if i == TEXT_CHARS_MAX {
            out.push('…');
            break;
        }
        if c.is_control() {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}
