//! Says where the files of an opened FMU are, in this process and for another one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use archive::Folder;
use serde::{Deserialize, Serialize};

/// Where an opened FMU is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    pub(crate) path: PathBuf,
    pub(crate) sha256: String,
    /// The unpacked archive.
    pub folder: PathBuf,
    pub(crate) sizes: BTreeMap<u32, u64>,
}

/// An unpacked archive.
#[derive(Debug)]
pub(crate) enum Unpacked {
    /// It is removed when it is dropped.
    Own(Folder),
    /// That of another process.
    Borrowed(PathBuf),
}

impl Unpacked {
    pub fn path(&self) -> &Path {
        match self {
            Unpacked::Own(folder) => folder.path(),
            Unpacked::Borrowed(path) => path,
        }
    }
}
