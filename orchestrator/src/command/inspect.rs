//! `trackside inspect`: prints the description of an FMU.

use std::path::PathBuf;

use clap::Args;
use diagnostics::Error;
use fmu_import::Fmu;

use super::{print, print_json};

/// Arguments of `trackside inspect`.
#[derive(Args)]
pub struct Arguments {
    /// The archive.
    fmu: PathBuf,
    /// Print JSON instead of lines.
    #[arg(long)]
    json: bool,
}

/// Prints the description.
///
/// # Errors
/// When the archive cannot be opened.
pub fn run(arguments: &Arguments) -> Result<u8, Error> {
    let fmu = Fmu::open(&arguments.fmu).map_err(|error| Error::input(error.to_string()))?;
    match arguments.json {
        true => print_json(&orchestrator::inspect::json(&fmu)),
        false => print(&orchestrator::inspect::lines(&fmu)),
    }
    Ok(0)
}
