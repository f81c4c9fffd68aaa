//! Writes the scenario of an FMU that runs by itself, for `trackside run --save-scenario`.

use std::fs::File;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use diagnostics::Error;
use scenario::document;
use scenario::resolve::Overrides;

use super::print_to_stderr;

/// Writes the scenario of the only FMU that runs.
///
/// # Errors
/// When not one FMU runs, or the file is there with another text.
pub(super) fn save_fmu_scenario(file: &Path, runs: &[PathBuf], overrides: &Overrides) -> Result<(), Error> {
    let [fmu] = runs.iter().filter(|path| document::is_fmu(path)).collect::<Vec<_>>()[..] else {
        let error = Error::invalid_input("--save-scenario: expected one FMU that runs by itself");
        return Err(
            error.with_help("a scenario that `extends` a system of SSP or another scenario changes that one")
        );
    };
    let starts = overrides.starts.iter().map(|it| (it.variable_name().to_owned(), it.value.to_string()));
    let options = document::StandaloneOptions { starts: starts.collect(), tolerance: overrides.tolerance };
    let text = document::standalone_scenario_text(fmu, file, &options)?;
    // A file of the user is lost in no case.
    if std::fs::read_to_string(file).is_ok_and(|there| there == text) {
        return Ok(());
    }
    let written = File::create_new(file).and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => Error::invalid_input(format!(
            "--save-scenario: expected the name of a new file, found {}, which is there already",
            file.display()
        )),
        _ => Error::output_failure(file, error),
    })?;
    print_to_stderr(&format!("wrote the scenario {}", file.display()));
    Ok(())
}
