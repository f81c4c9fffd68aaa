//! Clears the folder of a run before the next one writes to it.

use std::path::Path;

use diagnostics::Error;
use scenario::plan::REPORT;

use crate::report::PreviousRun;
use crate::sinks::SINKS;

/// Removes the files of the previous run: they would pass for those of this run if it did not come to its end.
///
/// # Errors
/// When a file cannot be removed.
pub(crate) fn clear(folder: &Path) -> Result<(), Error> {
    use std::io::ErrorKind::{NotADirectory, NotFound};
    let left = PreviousRun::read(folder);
    let recordings = SINKS.iter().flat_map(|kind| kind.files.iter().copied());
    let files = left.files.iter().map(String::as_str).chain([REPORT]).chain(recordings);
    for name in files {
        let path = folder.join(name);
        match std::fs::remove_file(&path) {
            Err(error) if !matches!(error.kind(), NotFound | NotADirectory) => {
                return Err(Error::output(&path, error));
            }
            _ => {}
        }
    }
    for validation in left.validations.iter().map(|validation| folder.join(&validation.name)) {
        clear(&validation)?;
        // If the user put something there, it stays.
        let _ = std::fs::remove_dir(&validation);
    }
    Ok(())
}
