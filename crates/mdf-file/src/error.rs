//! Says why a file cannot be read or written, and where.

use std::fmt;

/// Why a file cannot be read or written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The byte of the file where it goes wrong, from 0, where there is one.
    pub at: Option<u64>,
    /// What was expected, what was found, what to do.
    pub text: String,
}

impl Error {
    pub(crate) fn new(at: u64, text: impl Into<String>) -> Self {
        Self { at: Some(at), text: text.into() }
    }

    pub(crate) fn without_offset(text: impl Into<String>) -> Self {
        Self { at: None, text: text.into() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Some(at) => write!(f, "byte {at}: {}", self.text),
            None => f.write_str(&self.text),
        }
    }
}

impl std::error::Error for Error {}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self::without_offset(format!("the file cannot be read or written: {error}"))
    }
}
