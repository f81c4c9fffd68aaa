//! Unpacks archives of others, FMUs and systems of SSP, into folders that vanish with their process.
//!
//! An archive may be hostile: nothing is written outside of its folder, and sizes are bounded. So are elements of the XML files
//! in it, by [`find_element_over_limit`]. Links are made when they stay inside, and files keep their permissions.

mod attribute_limit;
mod duplicates;
mod folder;
mod links;
mod unpack;

use std::io;
use std::path::{Path, PathBuf};

pub use attribute_limit::{ATTRIBUTES, find_element_over_limit};
pub use folder::{TemporaryFolder, temporary_write_error, unnamed_temporary_file};
pub use unpack::{is_archive, unpack_archive};

/// An archive may unpack to this many bytes, which is far more than any real one needs.
pub const LARGEST: u64 = 4 << 30;

/// An archive itself may have this many bytes: it is read as a whole.
pub const LARGEST_PACKED: u64 = 1 << 30;

/// Reads an archive.
///
/// # Errors
/// When it cannot be read, is no file on a disk, or is larger than [`LARGEST_PACKED`].
pub fn read_archive(path: &Path) -> io::Result<Vec<u8>> {
    let about = std::fs::metadata(path)?;
    // A device is endless, and a folder tells by itself that it is one.
    if !about.is_file() && !about.is_dir() {
        return Err(io::Error::other("expected a file on a disk"));
    }
    if about.len() > LARGEST_PACKED {
        let text = format!("expected at most {LARGEST_PACKED} bytes, found {}", about.len());
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, text));
    }
    std::fs::read(path)
}

/// Why an archive is not unpacked.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file is not there or cannot be read, or its entries cannot be written.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The archive.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is no archive, or a broken one.
    #[error("{path} is not an {kind} archive: {source}")]
    Zip {
        /// The archive.
        path: PathBuf,
        /// What it should be.
        kind: &'static str,
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
    /// A link of the archive would lead out of the folder that it is unpacked to, or hides something.
    #[error("{path}: its link `{entry}` leads to `{target}`, {why}")]
    Link {
        /// The archive.
        path: PathBuf,
        /// The link.
        entry: String,
        /// Where it leads.
        target: String,
        /// What is wrong with that.
        why: &'static str,
    },
    /// An entry of the archive cannot be unpacked.
    #[error("{path}: its entry `{entry}` {what}")]
    Entry {
        /// The archive.
        path: PathBuf,
        /// The entry.
        entry: String,
        /// What it is, and what to do.
        what: String,
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
}

#[cfg(all(test, unix))]
mod tests;
