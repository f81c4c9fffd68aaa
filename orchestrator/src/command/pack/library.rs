//! Finds the library of an FMU that this program packs: built now, or installed with the program.

use std::path::{Path, PathBuf};

use diagnostics::Error;
use fmu_export::pack::{Platform, PlatformLibrary};
use orchestrator::package::{self, BuildError, BuildTarget, OnProgress};

use crate::command::current_program_path;

/// The folder that this program was built in, unless it goes to other machines.
const BUILT_IN: Option<&str> =
    if cfg!(feature = "portable") { None } else { Some(env!("CARGO_MANIFEST_DIR")) };

/// The library of a package for this machine.
///
/// # Errors
/// When no workspace makes it, and it was not installed.
pub fn find_package_library(package: &str, progress: OnProgress) -> Result<PathBuf, Error> {
    let search = WorkspaceSearch::from_current_folder()?;
    let found = package::build_or_find_library(package, &search.folders(), progress);
    found.map_err(|error| missing_library_error(package, &error))
}

/// The libraries of a package, for this machine and for targets. An installed program has none for targets.
///
/// # Errors
/// When one of them is nowhere.
pub fn find_package_libraries(
    package: &str,
    targets: &[BuildTarget],
    progress: OnProgress,
) -> Result<Vec<PlatformLibrary>, Error> {
    let search = WorkspaceSearch::from_current_folder()?;
    let path = find_package_library(package, progress)?;
    let mut libraries = vec![PlatformLibrary { platform: Platform::of_this_program(), path }];
    for target in targets {
        let built = package::build_library_for_target(package, target, &search.folders(), progress);
        libraries.push(built.map_err(|error| missing_library_error(package, &error))?);
    }
    Ok(libraries)
}

fn missing_library_error(package: &str, error: &BuildError) -> Error {
    Error::invalid_input(format!("expected a library of the package {package}, found none: {error}"))
}

/// Where a workspace is looked for.
struct WorkspaceSearch {
    /// The folder of this program.
    beside: PathBuf,
}

impl WorkspaceSearch {
    fn from_current_folder() -> Result<Self, Error> {
        let program = current_program_path()?;
        Ok(WorkspaceSearch { beside: program.parent().unwrap_or(Path::new(".")).to_owned() })
    }

    /// Whoever works elsewhere has the workspace that this program was built in.
    fn folders(&self) -> Vec<&Path> {
        let folders = [Path::new("."), &self.beside];
        folders.into_iter().chain(BUILT_IN.map(Path::new)).collect()
    }
}
