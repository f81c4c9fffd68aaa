//! Finds the Rerun viewer and opens a run in it.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use diagnostics::Error;

use crate::comparison::{RunComparison, RunDifferences};
use program::{SearchPlaces, find_viewer};

mod program;

/// The version of the recordings.
pub const VERSION: &str = "0.36.3";

/// What to know before the first start of the viewer.
const TELEMETRY: &str = "the viewer sends anonymous usage data from its second start on; `rerun analytics disable` \
                         switches this off";

/// Opens a run, which is a folder with `run.rrd` or the recording itself, and waits until the viewer is closed. `note` gets what a
/// user should know before.
///
/// # Errors
/// When there is no such recording, no viewer that opens it, and when the viewer fails.
pub fn view_run(run: &Path, note: &mut dyn FnMut(&str)) -> Result<(), Error> {
    let recording = recording_file(run)?;
    let viewer = find_viewer(&SearchPlaces::of_this_process(), note)?;
    open_recording(&viewer, &recording, note)
}

/// Puts two runs into one recording and opens it at the first difference, or with `save` only writes it. `note` gets its oddities.
///
/// # Errors
/// When a run cannot be read, they have nothing in common, or as with [`view_run`].
pub fn compare_runs(
    a: &Path,
    b: &Path,
    save: Option<&Path>,
    differences: RunDifferences,
    note: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let viewer = match save {
        None => Some(find_viewer(&SearchPlaces::of_this_process(), note)?),
        Some(_) => None,
    };
    let mut comparison = RunComparison::open(a, b, differences)?;
    let failed = |error: std::io::Error| Error::output_failure(&std::env::temp_dir(), error);
    let private = tempfile::Builder::new().permissions(Permissions::from_mode(0o700)).tempdir();
    let folder = private.map_err(failed)?;
    let path = save.map_or_else(|| folder.path().join("comparison.rrd"), Path::to_owned);
    if let Err(error) = comparison.write_recording(&path) {
        // A part of it would pass for the whole.
        let _ = std::fs::remove_file(&path);
        return Err(error);
    }
    comparison.notes.iter().for_each(|it| note(it));
    viewer.map_or(Ok(()), |viewer| open_recording(&viewer, &path, note))
}

/// Opens a recording.
fn open_recording(viewer: &Path, recording: &Path, note: &mut dyn FnMut(&str)) -> Result<(), Error> {
    let variable = |name| std::env::var_os(name).filter(|it| !it.is_empty()).map(PathBuf::from);
    let settings = variable("XDG_CONFIG_HOME").or(variable("HOME").map(|it| it.join(".config")));
    if settings.is_some_and(|settings| is_first_start(&settings)) {
        note(TELEMETRY);
    }
    let status = Command::new(viewer).arg(recording).status();
    let status = status.map_err(|error| Error::invalid_input(format!("cannot start the viewer: {error}")))?;
    if status.success() {
        return Ok(());
    }
    let error = Error::invalid_input(format!("the viewer ended with {status}"));
    Err(error.with_help("without a graphics card: apt install mesa-vulkan-drivers"))
}

/// Whether the viewer has never run with these settings of a user.
fn is_first_start(settings: &Path) -> bool {
    !settings.join("rerun/analytics.json").exists()
}

/// The recording of a run.
fn recording_file(run: &Path) -> Result<PathBuf, Error> {
    let path = if run.is_dir() { run.join("run.rrd") } else { run.to_owned() };
    if path.is_file() {
        return Ok(path);
    }
    let error = Error::invalid_input(format!("{} has no recording for the viewer", run.display()));
    Err(error.with_help(
        "expected a folder with run.rrd, such as target/runs/limit_handling, or a file .rrd or .mcap; \
         `trackside run --rerun save` makes one",
    ))
}

#[cfg(test)]
mod tests {
    use super::is_first_start;

    #[test]
    fn the_first_start_is_that_without_settings_of_the_viewer() {
        let settings = tempfile::tempdir().expect("a folder");
        assert!(is_first_start(settings.path()));
        std::fs::create_dir(settings.path().join("rerun")).expect("a folder");
        assert!(is_first_start(settings.path()));
        std::fs::write(settings.path().join("rerun/analytics.json"), "{}").expect("a file");
        assert!(!is_first_start(settings.path()));
    }
}
