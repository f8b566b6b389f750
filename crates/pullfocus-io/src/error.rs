//! What can go wrong with a file: one sentence with the file, the reason and the way out.

use std::path::{Path, PathBuf};

/// A result whose error is [`FileError`].
pub type FileResult<T> = std::result::Result<T, FileError>;

/// The way out where a limit is in the way.
pub(crate) const RAISE_THE_LIMIT: &str = "if the file is meant to be that large, raise the limit";

/// What stands in messages for a stream without a name.
pub(crate) const OUTPUT: &str = "the output";

/// Every way in which reading or writing a picture fails.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The operating system refused.
    #[error("{}: cannot {doing}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What was tried: "open", "read", "write", "rename".
        doing: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The bytes contradict their own format: cut short, damaged, or another format altogether.
    #[error("{}: damaged or incomplete: {reason}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A sound file that holds something this program cannot use.
    #[error("{}: {what}; {instead}", file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// What it holds, as a clause: "deep pictures are not supported yet".
        what: String,
        /// The way out, as a clause.
        instead: String,
    },
    /// The file asks for more than the limits allow.
    #[error(
        "{}: {what} is {found}, above the limit of {limit}; {RAISE_THE_LIMIT}",
        file.display()
    )]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// What is counted: "the number of pixels".
        what: &'static str,
        /// What the file asks for.
        found: u64,
        /// The limit: see [`crate::Limits`].
        limit: u64,
    },
    /// A view, part, layer or channel that was asked for is not in the file.
    #[error("{}: there is no {what}; the file has {available}", file.display())]
    NotFound {
        /// The file.
        file: PathBuf,
        /// What was asked for: "view 'middle'".
        what: String,
        /// What there is instead.
        available: String,
    },
    /// Two pictures that belong together do not fit.
    #[error("{}: {reason}", file.display())]
    Mismatch {
        /// The second file.
        file: PathBuf,
        /// What differs, and what to do.
        reason: String,
    },
    /// An argument that no file could satisfy, such as a pattern or a channel name that cannot be written.
    #[error("{what}: {reason}")]
    Argument {
        /// What was given.
        what: String,
        /// Why it cannot be used, and what can.
        reason: String,
    },
    /// A result is there already.
    #[error("{}: exists already; choose another name, or allow overwriting", file.display())]
    Exists {
        /// The file.
        file: PathBuf,
    },
    /// Memory, sizes, or cancellation.
    #[error(transparent)]
    Core(#[from] pullfocus_core::Error),
}

impl FileError {
    /// An error of the operating system while `doing` something with `file`.
    pub fn io(file: impl AsRef<Path>, doing: &'static str, source: std::io::Error) -> Self {
        Self::Io { file: file.as_ref().to_owned(), doing, source }
    }

    /// A damaged file.
    pub fn damaged(file: impl AsRef<Path>, reason: impl Into<String>) -> Self {
        Self::Damaged { file: file.as_ref().to_owned(), reason: reason.into() }
    }

    /// Whether [`crate::Limits`] are in the way: for programs, which know how they are raised. The sentence ends with that.
    pub fn asks_for_limits(&self) -> bool {
        match self {
            Self::TooLarge { .. } => true,
            Self::Unsupported { instead, .. } => instead == RAISE_THE_LIMIT,
            Self::Damaged { reason, .. } => reason.ends_with(RAISE_THE_LIMIT),
            _ => false,
        }
    }

    /// With the name of the file that was written to, where it went by "the output", as a stream has no name.
    #[must_use]
    pub fn of_output(self, path: &Path) -> Self {
        let is_output = |file: &Path| file == Path::new(OUTPUT);
        match self {
            Self::Io { file, doing, source } if is_output(&file) => Self::io(path, doing, source),
            Self::Unsupported { file, what, instead } if is_output(&file) => {
                Self::unsupported(path, what, instead)
            }
            error => error,
        }
    }

    /// Something that cannot be used, and the way out.
    pub fn unsupported(file: impl AsRef<Path>, what: impl Into<String>, instead: impl Into<String>) -> Self {
        Self::Unsupported { file: file.as_ref().to_owned(), what: what.into(), instead: instead.into() }
    }

    /// Refuses `found` above `limit`.
    ///
    /// # Errors
    /// [`FileError::TooLarge`].
    pub fn check_limit(file: impl AsRef<Path>, what: &'static str, found: u64, limit: u64) -> FileResult<()> {
        if found <= limit {
            Ok(())
        } else {
            Err(Self::TooLarge { file: file.as_ref().to_owned(), what, found, limit })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_gets_its_files_name() {
        let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
        let named = FileError::io(OUTPUT, "write", full()).of_output(Path::new("a/out.exr")).to_string();
        assert!(named.starts_with("a/out.exr: cannot write"), "{named}");
        let other = FileError::io("in.exr", "read", full()).of_output(Path::new("a/out.exr")).to_string();
        assert!(other.starts_with("in.exr: cannot read"), "{other}");
    }

    #[test]
    fn limits_are_known_by_their_errors() {
        let large = FileError::check_limit("a.exr", "the number of pixels", 9, 8).unwrap_err();
        let decoder = FileError::unsupported("a.tif", "it is large", RAISE_THE_LIMIT);
        for error in [large, decoder] {
            assert!(error.asks_for_limits() && error.to_string().ends_with("raise the limit"), "{error}");
        }
        assert!(!FileError::damaged("a.exr", "cut short").asks_for_limits());
    }
}
