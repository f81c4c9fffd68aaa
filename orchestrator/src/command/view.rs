//! `trackside view`: opens one run, or two over each other, in the Rerun viewer.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;

/// Arguments of `trackside view`.
#[derive(Args)]
pub struct Arguments {
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
pub fn run(arguments: &Arguments) -> Result<u8, Error> {
    match &arguments.other {
        None => view(&arguments.run),
        Some(other) => compare(&arguments.run, other, arguments.save.as_deref()),
    }
}

#[cfg(feature = "rerun")]
fn view(run: &Path) -> Result<u8, Error> {
    replay::viewer::view(run, &mut |note| super::tell(&format!("note: {note}"))).map(|()| 0)
}

#[cfg(not(feature = "rerun"))]
fn view(_run: &Path) -> Result<u8, Error> {
    Err(without_rerun())
}

#[cfg(feature = "rerun")]
fn compare(a: &Path, b: &Path, save: Option<&Path>) -> Result<u8, Error> {
    let mut note = |note: &str| super::tell(&format!("note: {note}"));
    replay::viewer::compare(a, b, save, &mut note)?;
    if let Some(path) = save {
        super::print(&format!("{}\n", path.display()));
    }
    Ok(0)
}

#[cfg(not(feature = "rerun"))]
fn compare(_a: &Path, _b: &Path, _save: Option<&Path>) -> Result<u8, Error> {
    Err(without_rerun())
}

#[cfg(not(feature = "rerun"))]
fn without_rerun() -> Error {
    Error::input("this program was built without the feature `rerun`")
}
