//! Says why an archive is no FMU that can run here.

use std::path::PathBuf;

use crate::LARGEST;

/// Why an archive is no FMU that can run here.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The file is not there or cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The archive.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is no archive, or a broken one.
    #[error("{path} is not an .fmu archive: {source}")]
    Zip {
        /// The archive.
        path: PathBuf,
        /// What is wrong with it.
        source: zip::result::ZipError,
    },
    /// An entry of the archive would leave the folder that it is unpacked to.
    #[error("{path} contains the entry `{entry}`, which leaves the folder that it is unpacked to")]
    Escapes {
        /// The archive.
        path: PathBuf,
        /// The entry.
        entry: String,
    },
    /// Two entries of the archive have the same name, so what is in it depends on who reads it.
    #[error("{path} has {listed} entries, but only {different} different names")]
    Ambiguous {
        /// The archive.
        path: PathBuf,
        /// How many entries it lists.
        listed: usize,
        /// How many names there are.
        different: usize,
    },
    /// The archive is too large.
    #[error("{path} unpacks to more than {LARGEST} bytes")]
    TooLarge {
        /// The archive.
        path: PathBuf,
    },
    /// The description is missing, broken or against the rules.
    #[error("{path}: modelDescription.xml: {what}")]
    Description {
        /// The archive.
        path: PathBuf,
        /// What is wrong with it.
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
        /// The platforms that there are.
        found: String,
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
        symbol: &'static str,
    },
}
