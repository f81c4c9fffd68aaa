//! Finds the library of an FMU that this program packs: built now, or installed with the program.

use std::path::{Path, PathBuf};

use diagnostics::Error;
use orchestrator::package::{self, OnProgress};

use crate::command::current_program_path;

/// The folder that this program was built in, unless it goes to other machines.
const BUILT_IN: Option<&str> =
    if cfg!(feature = "portable") { None } else { Some(env!("CARGO_MANIFEST_DIR")) };

/// The library of a package.
///
/// # Errors
/// When no workspace makes it, and it was not installed.
pub fn find_package_library(package: &str, progress: OnProgress) -> Result<PathBuf, Error> {
    // Whoever works elsewhere has the workspace that this program was built in.
    let program = current_program_path()?;
    let beside = program.parent().unwrap_or(Path::new("."));
    let mut folders = vec![Path::new("."), beside];
    folders.extend(BUILT_IN.map(Path::new));
    package::build_or_find_library(package, &folders, progress).map_err(|error| {
        Error::invalid_input(format!("expected a library of the package {package}, found none: {error}"))
    })
}
