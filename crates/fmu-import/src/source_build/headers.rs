//! Holds the headers of FMI for sources that come without them: our own words for the types and functions of the standard.

use std::io;
use std::path::Path;

macro_rules! headers {
    ($($name:literal),*) => { &[$(($name, include_str!(concat!("headers/", $name)))),*] };
}

/// The files by their names. Sources that bring some of them along get theirs, since the names that guard against double inclusion are the
/// same.
pub(super) const HEADERS: &[(&str, &str)] = headers![
    "fmi2FunctionTypes.h",
    "fmi2Functions.h",
    "fmi2TypesPlatform.h",
    "fmi3FunctionTypes.h",
    "fmi3Functions.h",
    "fmi3PlatformTypes.h",
    "minmax.h"
];

/// Writes them into a folder, and into the folder `fmi` there: CPPFMU, which many FMUs of C++ are made with, looks for them in one of that name.
pub(super) fn write_headers(folder: &Path) -> io::Result<()> {
    let inner = folder.join("fmi");
    std::fs::create_dir(&inner)?;
    for (name, text) in HEADERS {
        std::fs::write(folder.join(name), text)?;
        std::fs::write(inner.join(name), text)?;
    }
    Ok(())
}
