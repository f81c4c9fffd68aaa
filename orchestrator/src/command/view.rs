//! `trackside view`: opens one run, or two over each other, in the Rerun viewer.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;

/// Arguments of `trackside view`.
#[derive(Args)]
pub struct ViewArguments {
    /// The folder of the run, or a recording.
    run: PathBuf,
    /// Another run to compare it with: its folder, or its run.mcap.
    other: Option<PathBuf>,
    /// Write the comparison to this file, and open nothing.
    #[arg(long, value_name = "FILE.rrd", requires = "other")]
    save: Option<PathBuf>,
}

/// Opens the viewer, or writes the comparison to a file.
///
/// # Errors
/// When a recording cannot be read, or the viewer does not start.
pub fn run_view_command(arguments: &ViewArguments) -> Result<u8, Error> {
    match &arguments.other {
        None => open_run_in_viewer(&arguments.run),
        Some(other) => compare_runs_in_viewer(&arguments.run, other, arguments.save.as_deref()),
    }
}

#[cfg(feature = "rerun")]
fn open_run_in_viewer(run: &Path) -> Result<u8, Error> {
    replay::viewer::view_run(run, &mut |note| super::print_to_stderr(&format!("note: {note}"))).map(|()| 0)
}

#[cfg(not(feature = "rerun"))]
fn open_run_in_viewer(_run: &Path) -> Result<u8, Error> {
    Err(missing_rerun_error())
}

#[cfg(feature = "rerun")]
fn compare_runs_in_viewer(a: &Path, b: &Path, save: Option<&Path>) -> Result<u8, Error> {
    let mut note = |note: &str| super::print_to_stderr(&format!("note: {note}"));
    let differences = known_differences(a, b);
    replay::viewer::compare_runs(a, b, save, differences, &mut note)?;
    if let Some(path) = save {
        super::print_text(&format!("{}\n", path.display()));
    }
    Ok(0)
}

/// What differs between the inputs of two runs, and the first time at which their values do; nothing of a run whose inputs were not kept.
#[cfg(feature = "rerun")]
fn known_differences(a: &Path, b: &Path) -> replay::comparison::RunDifferences {
    let options = attribution::ExperimentOptions { host: None, most_runs: 0, may_continue: &|| Ok(()) };
    let Ok(explanation) = attribution::explain_difference(a, b, &options) else {
        return replay::comparison::RunDifferences::default();
    };
    replay::comparison::RunDifferences {
        first_time: explanation.first_deviation.as_ref().map(|it| it.time),
        inputs: explanation.inputs_are_known().then(|| {
            let rows = explanation.differences.iter();
            rows.map(|it| (it.place.clone(), it.values_of_both())).collect()
        }),
    }
}

#[cfg(not(feature = "rerun"))]
fn compare_runs_in_viewer(_a: &Path, _b: &Path, _save: Option<&Path>) -> Result<u8, Error> {
    Err(missing_rerun_error())
}

#[cfg(not(feature = "rerun"))]
fn missing_rerun_error() -> Error {
    Error::invalid_input("this program was built without the feature `rerun`")
}
