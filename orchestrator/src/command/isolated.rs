//! `trackside isolated`: runs one FMU for the program that started this one.

use clap::Args;
use diagnostics::Error;

/// Arguments of `trackside isolated`.
#[derive(Args)]
pub struct IsolatedArguments {
    /// The number of the process that started this one.
    host: u32,
}

/// Answers until the other process has no more questions.
///
/// # Errors
/// When nobody asks.
pub fn run_isolated_command(arguments: &IsolatedArguments) -> Result<u8, Error> {
    cosim::node::serve_host_process(arguments.host).map(|()| 0)
}
