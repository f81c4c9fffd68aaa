//! Resolves references to files inside the folder or archive of a system.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use archive::{LARGEST, TemporaryFolder};

use crate::error::mistake_error;
use crate::limits::LONGEST;
use crate::source_position::SourceText;
use crate::{Error, SourcePosition, read_archive};

/// The description that is meant when none is named.
pub(crate) const DEFAULT: &str = "SystemStructure.ssd";

/// A folder that nothing is read outside of, but for what links in a folder of the user lead to.
#[derive(Debug)]
struct PackageFolder {
    folder: PathBuf,
    /// What users know it by: the folder or the archive.
    display_path: PathBuf,
}

/// A file inside of a package.
#[derive(Debug, Clone)]
pub(crate) struct PackageLocation {
    package: Arc<PackageFolder>,
    /// Folders and name of the file.
    inside: Vec<String>,
}

impl PackageLocation {
    /// A file directly in a folder.
    pub(crate) fn new(folder: &Path, display_path: &Path, name: &str) -> Self {
        let (folder, display_path) = (folder.to_owned(), display_path.to_owned());
        PackageLocation {
            package: Arc::new(PackageFolder { folder, display_path }),
            inside: vec![name.to_owned()],
        }
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.package.folder.join(self.inside.iter().collect::<PathBuf>())
    }

    /// What users know the file by.
    pub(crate) fn display_path(&self) -> PathBuf {
        self.package.display_path.join(self.inside.iter().collect::<PathBuf>())
    }

    /// The file at a relative address that this file contains. `position` is where it is written.
    pub(crate) fn resolve_address(
        &self,
        address: &str,
        position: &SourcePosition,
    ) -> Result<PackageLocation, Error> {
        let refused = |found: String| {
            let expected = "the path of a file in the folder of the system";
            let cure = "copy the file to the folder of the system, and write its relative path with `/`";
            mistake_error(position, expected, found, cure)
        };
        let path = percent_decode(address).ok_or_else(|| refused(format!("the address `{address}`")))?;
        let scheme = path.split('/').next().is_some_and(|first| first.contains(':'));
        if path.is_empty() || path.starts_with('/') || path.contains(['\\', '\0']) || scheme {
            return Err(refused(format!("`{address}`")));
        }
        let mut inside = self.inside.clone();
        inside.pop();
        for part in path.split('/') {
            match part {
                "" | "." => {}
                ".." if inside.pop().is_some() => {}
                ".." => return Err(refused(format!("`{address}`, which leaves that folder"))),
                part => inside.push(part.to_owned()),
            }
        }
        let found = PackageLocation { package: Arc::clone(&self.package), inside };
        if !found.path().is_file() {
            let expected = format!("the file {}", found.display_path().display());
            let (found, cure) = match found.path().is_dir() {
                true => ("a folder", "pack the folder into an archive: an FMU is a ZIP file"),
                false => ("no such file", "add the file, or correct its path"),
            };
            return Err(mistake_error(position, expected, found, cure));
        }
        Ok(found)
    }
}

/// The text of an address without its percent signs.
fn percent_decode(address: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(address.len());
    let mut rest = address.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let mut digit = || char::from(rest.next()?).to_digit(16)?.try_into().ok();
        let (high, low): (u8, u8) = (digit()?, digit()?);
        bytes.push(high << 4 | low);
    }
    String::from_utf8(bytes).ok()
}

/// Reads texts and archives, and counts what they cost.
#[derive(Debug)]
pub(crate) struct PackageReader {
    /// How many bytes archives may still unpack to.
    unpackable: u64,
    /// How many bytes of texts may still be read.
    readable: u64,
    archives: BTreeMap<PathBuf, PathBuf>,
    folders: Vec<TemporaryFolder>,
}

impl PackageReader {
    pub(crate) fn new() -> Self {
        PackageReader {
            unpackable: LARGEST,
            readable: LONGEST,
            archives: BTreeMap::new(),
            folders: Vec::new(),
        }
    }

    /// The folders that archives were unpacked to: they vanish with them.
    pub(crate) fn into_unpacked_folders(self) -> Vec<TemporaryFolder> {
        self.folders
    }

    /// The text of a file.
    pub(crate) fn read_text(&mut self, file: &PackageLocation) -> Result<Arc<SourceText>, Error> {
        let path = file.display_path();
        let failed = |source| Error::Read { path: path.clone(), source };
        let opened = File::open(file.path()).map_err(failed)?;
        let mut bytes = Vec::new();
        opened.take(self.readable + 1).read_to_end(&mut bytes).map_err(failed)?;
        self.decode_within_limit(path, bytes)
    }

    /// The text of a file in an FMU, at a relative address in it.
    pub(crate) fn read_text_in_fmu(
        &mut self,
        fmu: &PackageLocation,
        address: &str,
        position: &SourcePosition,
    ) -> Result<Arc<SourceText>, Error> {
        let bytes =
            read_archive::read_archive_entry(&fmu.path(), address, self.readable).map_err(|error| {
                let expected = format!("the file {address} in {}", fmu.display_path().display());
                mistake_error(position, expected, error.to_string(), "correct the path inside of the FMU")
            })?;
        self.decode_within_limit(fmu.display_path().join(address), bytes)
    }

    fn decode_within_limit(&mut self, path: PathBuf, bytes: Vec<u8>) -> Result<Arc<SourceText>, Error> {
        let left = self.readable.checked_sub(bytes.len() as u64);
        self.readable = left.ok_or_else(|| Error::TooLong { path: path.clone() })?;
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Arc::new(SourceText { path, text })),
            Err(error) => {
                let valid = error.utf8_error().valid_up_to();
                let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
                let position = SourcePosition::new(&Arc::new(SourceText { path, text }), valid);
                Err(mistake_error(&position, "UTF-8", "other bytes", "write the file in UTF-8"))
            }
        }
    }

    /// The folder that the archive is unpacked to; each archive is unpacked once.
    pub(crate) fn unpack_once(&mut self, path: &Path, display_path: &Path) -> Result<PathBuf, Error> {
        if let Some(folder) = self.archives.get(path) {
            return Ok(folder.clone());
        }
        let failed = |source| Error::Read { path: std::env::temp_dir(), source };
        let folder = TemporaryFolder::new().map_err(failed)?;
        read_archive::unpack_archive(path, display_path, folder.folder_path(), &mut self.unpackable)?;
        let unpacked = folder.folder_path().to_owned();
        self.folders.push(folder);
        self.archives.insert(path.to_owned(), unpacked.clone());
        Ok(unpacked)
    }
}
