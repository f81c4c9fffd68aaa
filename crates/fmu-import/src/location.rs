//! Defines where the unpacked files of an FMU are, so that another process can open them too.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use python::PythonLibrary;
use serde::{Deserialize, Serialize};

use crate::FmiInterface;

/// Where an opened FMU is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FmuLocation {
    pub(crate) path: PathBuf,
    pub(crate) sha256: String,
    /// The unpacked archive.
    pub folder: PathBuf,
    pub(crate) sizes: BTreeMap<u32, u64>,
    /// The Python that its library expects in the process.
    pub(crate) python: Option<PythonLibrary>,
    pub(crate) interface: FmiInterface,
}

/// The URI of an absolute path (RFC 3986, section 2): all bytes but those that mean nothing else are escaped.
pub(crate) fn file_uri(path: &Path) -> String {
    let escaped = path.as_os_str().as_encoded_bytes().iter().map(|&byte| match byte {
        b'/' | b'-' | b'.' | b'_' | b'~' => char::from(byte).to_string(),
        _ if byte.is_ascii_alphanumeric() => char::from(byte).to_string(),
        _ => format!("%{byte:02X}"),
    });
    format!("file://{}", escaped.collect::<String>())
}
