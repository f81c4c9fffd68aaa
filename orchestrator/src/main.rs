//! Parses the command line and runs the command; the exit code is its result.
#![forbid(unsafe_code)]

mod command;

use std::process::ExitCode;

use clap::Parser;

/// Co-simulation of vehicle dynamics: runs scenarios of FMUs, records them and judges them.
#[derive(Parser)]
#[command(name = "trackside", version)]
struct Cli {
    #[command(subcommand)]
    command: command::Command,
}

fn main() -> ExitCode {
    ExitCode::from(Cli::parse().command.run())
}
