//! How the program ends when it does not end well.

use pullfocus_core::Error;
use pullfocus_io::FileError;
use std::fmt;
use std::process::ExitCode;

/// A failure, with the sentence that the user reads.
#[derive(Debug)]
pub enum Failure {
    /// What was asked for cannot be: exit code 2.
    Usage(String),
    /// What was asked for did not work: exit code 1.
    Failed(anyhow::Error),
    /// The user stopped it: exit code 1.
    Stopped(String),
}

/// A result whose error is [`Failure`].
pub type Result<T> = std::result::Result<T, Failure>;

impl Failure {
    /// A usage error with this sentence.
    pub fn usage(sentence: impl Into<String>) -> Self {
        Self::Usage(sentence.into())
    }

    /// A failure with this sentence.
    pub fn failed(sentence: impl Into<String>) -> Self {
        Self::Failed(anyhow::Error::msg(sentence.into()))
    }

    /// Whether work ended because somebody raised its flag.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Stopped(_) => true,
            Self::Usage(_) => false,
            Self::Failed(error) => error.chain().any(|cause| {
                matches!(cause.downcast_ref(), Some(Error::Cancelled))
                    || matches!(cause.downcast_ref(), Some(FileError::Core(Error::Cancelled)))
            }),
        }
    }

    /// 2 for usage, 1 for the rest.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Failed(_) | Self::Stopped(_) => 1,
        }
    }
}

impl From<&Failure> for ExitCode {
    fn from(failure: &Failure) -> Self {
        failure.exit_code().into()
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(sentence) | Self::Stopped(sentence) => f.write_str(sentence),
            // The chain in one line: a sentence and its reason.
            Self::Failed(error) => write!(f, "{error:#}"),
        }
    }
}

impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}

impl From<pullfocus_core::Error> for Failure {
    fn from(error: pullfocus_core::Error) -> Self {
        Self::Failed(error.into())
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::Failed(error.into())
    }
}

impl From<pullfocus_io::FileError> for Failure {
    fn from(error: pullfocus_io::FileError) -> Self {
        match error {
            pullfocus_io::FileError::Argument { .. } => Self::Usage(error.to_string()),
            pullfocus_io::FileError::Exists { .. } => Self::failed(format!(
                "{error}; --overwrite replaces it, --resume keeps it and does what is missing"
            )),
            error if error.asks_for_limits() => Self::failed(format!("{error} with --allow-large-files")),
            error => Self::Failed(error.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limits_option_is_named() {
        let error = FileError::check_limit("a.exr", "the number of pixels", 9, 8).unwrap_err();
        let failure = Failure::from(error);
        assert!(failure.to_string().ends_with("raise the limit with --allow-large-files"), "{failure}");
        assert_eq!(failure.exit_code(), 1);
    }
}
