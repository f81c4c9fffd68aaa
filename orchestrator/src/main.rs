//! Parses the command line and runs the command; the exit code is its result.
#![forbid(unsafe_code)]

mod command;

use std::io::IsTerminal as _;

use clap::Parser;
use miette::MietteHandlerOpts;

/// Co-simulation of vehicle dynamics: runs scenarios of FMUs, records them and judges them.
#[derive(Parser)]
#[command(name = "trackside", version)]
struct CommandLine {
    #[command(subcommand)]
    command: command::CliCommand,
}

/// The exit code of every Rust program that panics.
const PANICKED: u8 = 101;

/// Terminals wrap errors at their width; elsewhere, in a file or the log of a CI system, lines stay whole.
fn wrap_errors_only_on_terminals() {
    let _ = miette::set_hook(Box::new(|_| {
        let options = MietteHandlerOpts::new();
        let options = match std::io::stderr().is_terminal() {
            true => options.break_words(false),
            false => options.wrap_lines(false),
        };
        Box::new(options.build())
    }));
}

fn main() -> ! {
    wrap_errors_only_on_terminals();
    let command = CommandLine::parse().command;
    fmu_import::guard_exit();
    command::offer_sandbox();
    let code = std::panic::catch_unwind(|| command.run());
    fmu_import::exit_without_destructors(code.unwrap_or(PANICKED))
}
