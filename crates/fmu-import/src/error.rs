//! Defines the errors of opening an FMU.

use std::path::PathBuf;

/// Why an archive is no FMU that can run here.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The file is not there or cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The archive.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The archive is broken, or would do harm.
    #[error(transparent)]
    Archive(#[from] archive::Error),
    /// The description is missing, broken or against the rules.
    #[error("{path}: modelDescription.xml: {what}")]
    Description {
        /// The archive.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// It is an FMU of another version or interface than this program steps.
    #[error("{path}: modelDescription.xml: {what}")]
    Interface {
        /// The archive.
        path: PathBuf,
        /// What it offers, and what to ask for instead.
        what: String,
    },
    /// There is no library for this machine.
    #[error("{path} has no library for {platform}: expected {expected}, found {found}")]
    Platform {
        /// The archive.
        path: PathBuf,
        /// This machine, by the name that the version has for it.
        platform: &'static str,
        /// The entry that is needed.
        expected: String,
        /// The libraries and sources that there are, and what to do.
        found: String,
    },
    /// There are sources in place of a library, and no library has come of them.
    #[error("{path}: its sources: {what}")]
    Sources {
        /// The archive.
        path: PathBuf,
        /// What the compiler says, with file and line.
        what: String,
    },
    /// There is only one for Windows, and nothing that runs it.
    #[error("{path} has no library for Linux: {what}")]
    Wine {
        /// The archive.
        path: PathBuf,
        /// What is missing.
        what: String,
    },
    /// The library does not load.
    #[error("{path}: the library does not load: {what}")]
    Library {
        /// The archive.
        path: PathBuf,
        /// What the loader says.
        what: String,
    },
    /// The library lacks a function.
    #[error("{path}: the library lacks the function `{symbol}`")]
    Symbol {
        /// The archive.
        path: PathBuf,
        /// The function.
        symbol: String,
    },
}
