//! An .fmu archive goes in: it is unpacked, and its description is read and checked. Instances that can be called come out.

mod attributes;
mod binding;
mod call;
mod definitions;
pub mod description;

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sha2::{Digest as _, Sha256};
use tempfile::TempDir;

pub use attributes::{Causality, Initial, Variability};
pub use binding::{FmuState, Instance, Library, watch};
pub use call::{CallError, Message};
use description::Description;

/// An archive may unpack to this many bytes, which is far more than any real one needs.
const LARGEST: u64 = 4 << 30;

/// A description may be this long; the longest real ones have some hundred thousand variables.
const LONGEST: u64 = 64 << 20;

/// The folders of this platform's library, by FMI 2.0's names.
const PLATFORM: &str = if cfg!(all(target_os = "linux", target_pointer_width = "64")) {
    "linux64"
} else if cfg!(target_os = "linux") {
    "linux32"
} else if cfg!(all(target_os = "windows", target_pointer_width = "64")) {
    "win64"
} else if cfg!(target_os = "windows") {
    "win32"
} else {
    "darwin64"
};

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
    #[error("{path} has no library for {PLATFORM}: expected {expected}, found {found}")]
    Platform {
        /// The archive.
        path: PathBuf,
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

/// An opened FMU, from which instances are made.
#[derive(Debug)]
pub struct Fmu {
    /// The archive.
    pub path: PathBuf,
    /// SHA-256 of the archive, in hexadecimal digits.
    pub sha256: String,
    /// What it says about itself.
    pub description: Description,
    /// The unpacked archive, which lives as long as any instance.
    folder: TempDir,
}

/// SHA-256 in hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Fmu {
    /// Opens the archive at `path` and reads its description.
    ///
    /// # Errors
    /// When the file is no FMI 2.0 co-simulation archive; its library is not looked at yet.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let read = |source| OpenError::Read { path: path.to_owned(), source };
        let bytes = std::fs::read(path).map_err(read)?;
        let folder = TempDir::with_prefix("trackside-").map_err(read)?;
        unpack(path, &bytes, folder.path())?;
        let wrong = |what: String| OpenError::Description { path: path.to_owned(), what };
        let xml = folder.path().join("modelDescription.xml");
        let length = std::fs::metadata(&xml).map_err(|error| wrong(error.to_string()))?.len();
        if length > LONGEST {
            return Err(wrong(format!("expected at most {LONGEST} bytes, found {length}")));
        }
        let xml = std::fs::read_to_string(&xml).map_err(|error| wrong(error.to_string()))?;
        let description = Description::parse(&xml).map_err(wrong)?;
        Ok(Fmu { path: path.to_owned(), sha256: sha256(&bytes), description, folder })
    }

    /// Loads the library.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load, or lacks a function.
    pub fn load(self: &Arc<Self>) -> Result<Arc<Library>, OpenError> {
        let library = self.library()?;
        Library::load(Arc::clone(self), &library).map(Arc::new)
    }

    /// The functions of FMI 2.0 co-simulation that the library lacks.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load.
    pub fn missing_symbols(&self) -> Result<Vec<&'static str>, OpenError> {
        Library::missing(self, &self.library()?)
    }

    /// The platforms that the archive has libraries for.
    #[must_use]
    pub fn platforms(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path().join("binaries"));
        let mut names: Vec<_> = entries
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// The unpacked library for this machine.
    ///
    /// # Errors
    /// When there is none.
    pub fn library(&self) -> Result<PathBuf, OpenError> {
        let entry = format!(
            "binaries/{PLATFORM}/{}.{}",
            self.description.identifier,
            std::env::consts::DLL_EXTENSION
        );
        let path = self.folder.path().join(&entry);
        if path.is_file() {
            return Ok(path);
        }
        let platforms = self.platforms();
        let found = if platforms.is_empty() { "none".to_owned() } else { platforms.join(", ") };
        Err(OpenError::Platform { path: self.path.clone(), expected: entry, found })
    }

    /// The URI of the unpacked `resources` folder, as FMI 2.0 wants it.
    fn resources(&self) -> String {
        format!("file://{}", self.folder.path().join("resources").display())
    }
}

fn unpack(path: &Path, bytes: &[u8], into: &Path) -> Result<(), OpenError> {
    let broken = |source| OpenError::Zip { path: path.to_owned(), source };
    let failed = |source| OpenError::Read { path: path.to_owned(), source };
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).map_err(broken)?;
    let different = archive.len();
    if let Some(listed) = listed_entries(bytes).filter(|listed| *listed != different) {
        return Err(OpenError::Ambiguous { path: path.to_owned(), listed, different });
    }
    let mut left = LARGEST;
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(broken)?;
        let Some(inside) = entry.enclosed_name().filter(|_| !entry.is_symlink()) else {
            let entry = String::from_utf8_lossy(entry.name_raw()).into_owned();
            return Err(OpenError::Escapes { path: path.to_owned(), entry });
        };
        let target = into.join(inside);
        if entry.is_dir() {
            std::fs::create_dir_all(&target).map_err(failed)?;
            continue;
        }
        if let Some(parent) = target.parent() {
            std::fs::create_dir_all(parent).map_err(failed)?;
        }
        let mut file = File::create(&target).map_err(failed)?;
        // What the entry claims about its size is not believed: one byte over the limit is enough.
        let written =
            std::io::copy(&mut entry.by_ref().take(left + 1), &mut file).map_err(failed)?;
        left = left
            .checked_sub(written)
            .ok_or_else(|| OpenError::TooLarge { path: path.to_owned() })?;
    }
    Ok(())
}

/// How many entries the archive says it has. The zip library keeps the last one of each name and does
/// not tell. Nothing is known of archives with more entries than the field can hold.
fn listed_entries(bytes: &[u8]) -> Option<usize> {
    const END: &[u8] = b"PK\x05\x06";
    let end = bytes.windows(END.len()).rposition(|window| window == END)?;
    let count = bytes.get(end + 10..end + 12)?;
    let count = u16::from_le_bytes([count[0], count[1]]);
    (count != u16::MAX).then_some(count.into())
}

#[cfg(test)]
mod tests;
