//! Finds the library of an FMU that this program packs: built beforehand, or built now.

use std::path::{Path, PathBuf};

use diagnostics::Error;
use orchestrator::package::{OnProgress, Workspace};
use scenario::BuildRequest;

use crate::command::this_program;

/// Where an installed program has libraries, from its own folder.
const INSTALLED: &str = "../share/trackside/lib";

/// The library of a package of the workspace.
///
/// # Errors
/// When it is neither beside the program nor can be built.
pub fn find(package: &str, progress: OnProgress) -> Result<PathBuf, Error> {
    let request = BuildRequest { package: package.to_owned(), example: None };
    let program = this_program()?;
    let beside = program.parent().unwrap_or(Path::new("."));
    let file = format!(
        "{}{}{}",
        std::env::consts::DLL_PREFIX,
        package.replace('-', "_"),
        std::env::consts::DLL_SUFFIX
    );
    let installed = beside.join(INSTALLED).join(&file);
    if installed.is_file() {
        return Ok(installed);
    }
    // Whoever works elsewhere has the workspace that this program was built in.
    let folders = [Path::new("."), beside, Path::new(env!("CARGO_MANIFEST_DIR"))];
    let mut first = None;
    for folder in folders {
        let built = Workspace::around(folder)
            .and_then(|workspace| workspace.make(&[], std::slice::from_ref(&request), progress));
        match built.map(|mut built| built.plugins.remove(&request)) {
            Ok(Some(library)) => return Ok(library),
            Ok(None) => {}
            Err(error) => drop(first.get_or_insert(error)),
        }
    }
    let what = first.map_or_else(String::new, |error| format!(": {error}"));
    let installed = installed.display();
    Err(Error::input(format!(
        "expected a library of the package {package} as {installed} or built by cargo, found none{what}"
    )))
}
