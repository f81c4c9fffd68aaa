//! `trackside isolated`: runs one FMU, or one script, for the program that started this one.

use std::ffi::OsString;

use clap::Args;
use diagnostics::{Error, print_to_stderr};

use super::print_text;

/// Arguments of `trackside isolated`.
#[derive(Args)]
pub struct IsolatedArguments {
    /// The number of the process that started this one.
    host: u32,
    /// Enter the sandbox, and print what it keeps a process from on this machine.
    #[arg(long)]
    sandbox: bool,
    /// Enter this sandbox, in JSON, and go on as the command.
    #[arg(long, requires = "command")]
    enter: Option<String>,
    /// The command.
    #[arg(last = true)]
    command: Vec<OsString>,
}

/// Answers until the other process has no more questions.
///
/// # Errors
/// When nobody asks.
pub fn run_isolated_command(arguments: &IsolatedArguments) -> Result<u8, Error> {
    if arguments.sandbox {
        print_sandbox();
        return Ok(0);
    }
    if let Some(sandbox) = &arguments.enter {
        let failure = isolation::become_sandboxed_command(sandbox, &arguments.command, |mechanisms| {
            fmu_import::adopt_forked_process();
            let warnings = mechanisms.iter().filter_map(isolation::ProtectionMechanism::warning);
            warnings.for_each(|it| print_to_stderr(&format!("warning: in its sandbox {it}")));
        });
        let program = arguments.command.first().map(|it| it.display().to_string()).unwrap_or_default();
        return Err(Error::invalid_input(format!("{program} does not start in its sandbox: {failure}")));
    }
    cosim::node::serve_host_process(arguments.host).map(|()| 0)
}

/// One line for each mechanism of the sandbox that this process then is in.
fn print_sandbox() {
    let mechanisms = isolation::enter_sandbox(&isolation::Sandbox::default());
    fmu_import::adopt_forked_process();
    let width = mechanisms.iter().map(|mechanism| mechanism.name.len()).max().unwrap_or(0);
    let line = |mechanism: &isolation::ProtectionMechanism| {
        let state =
            mechanism.failure.as_ref().map_or_else(|| "holds".to_owned(), |why| format!("MISSING: {why}"));
        format!("  {:width$}  keeps it from {}: {state}\n", mechanism.name, mechanism.protects)
    };
    let lines: String = mechanisms.iter().map(line).collect();
    print_text(&format!("the sandbox of an isolated FMU on this machine\n{lines}"));
}
