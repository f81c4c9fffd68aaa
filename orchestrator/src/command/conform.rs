//! `trackside conform`: judges an FMU by the rules of its version of FMI.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use diagnostics::Error;
use fmu_conformance::{self as conform, ConformanceError};

use super::{current_program_path, print_json, print_text};

/// Arguments of `trackside conform`.
#[derive(Args)]
pub struct ConformArguments {
    /// The archive.
    fmu: PathBuf,
    /// Print JSON instead of lines.
    #[arg(long)]
    json: bool,
    /// How long each rule may take [s].
    #[arg(long, hide = true, value_name = "SECONDS")]
    limit: Option<f64>,
    /// Judge by this rule in this process, for the process that judges by all.
    #[arg(long, hide = true, requires = "progress_log")]
    rule: Option<String>,
    /// Where that process looks for what was found.
    #[arg(long, hide = true, requires = "rule")]
    progress_log: Option<PathBuf>,
    /// The number of that process.
    #[arg(long, hide = true, requires = "rule")]
    host: Option<u32>,
}

/// Prints a line for each rule; exit code 1 when the FMU breaks one.
///
/// # Errors
/// When the FMU cannot be opened or judged.
pub fn run_conform_command(arguments: &ConformArguments) -> Result<u8, Error> {
    let limit = match arguments.limit.map(Duration::try_from_secs_f64) {
        Some(limit) => limit.map_err(|error| Error::invalid_input(format!("--limit: {error}")))?,
        None => conform::TIME_LIMIT,
    };
    if let (Some(rule), Some(log)) = (&arguments.rule, &arguments.progress_log) {
        // A rule that hangs does not outlive who would end it; who is gone already sends no signal any more.
        #[cfg(target_os = "linux")]
        let _ = rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL));
        if arguments.host.is_some_and(|host| !isolation::is_host_alive(host)) {
            return Err(Error::invalid_input("the process that judges by all rules has ended"));
        }
        let report = conform::check_one_rule(&arguments.fmu, rule, log, limit);
        return report.map(|()| 0).map_err(conformance_error);
    }
    let report = conform::check_conformance(&current_program_path()?, &arguments.fmu, limit)
        .map_err(conformance_error)?;
    match arguments.json {
        true => print_json(&serde_json::json!(report.findings)),
        false => print_text(&conform::report_lines(&report.findings, report.version)),
    }
    Ok(conform::exit_code(&report.findings))
}

fn conformance_error(error: ConformanceError) -> Error {
    match error {
        ConformanceError::ProgressLog { path, source } => Error::output_failure(&path, source),
        error => Error::invalid_input(error.to_string()),
    }
}
