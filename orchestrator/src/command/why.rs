//! `trackside why`: what differs between two runs, what it did, and which difference is the cause.

use std::path::PathBuf;
use std::time::Duration;

use attribution::{ExperimentOptions, Explanation};
use clap::Args;
use cosim::node::FmuProcessOptions;
use diagnostics::Error;
use orchestrator::nofollow;

use super::run::guest_program_path;
use super::{print_json, print_text};

/// Arguments of `trackside why`.
#[derive(Args)]
pub struct WhyArguments {
    /// The folder of a run, or a baseline: run.mcap or CSV.
    a: PathBuf,
    /// The folder of the run that differs from it.
    b: PathBuf,
    /// The folder of why.html and why.json [default: that of B].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print why.json in place of the text.
    #[arg(long)]
    json: bool,
    /// The most runs that experiments may take.
    #[arg(long, value_name = "COUNT", default_value_t = orchestrator::why::MOST_RUNS)]
    runs: usize,
}

/// Explains the difference, and writes it as a page and as JSON.
///
/// # Errors
/// When a run cannot be read, or an FMU fails in an experiment, or a file cannot be written.
pub fn run_why_command(arguments: &WhyArguments) -> Result<u8, Error> {
    let WhyArguments { a, b, out, json, runs } = arguments;
    fmu_import::catch_termination_signals();
    let may_continue = || match fmu_import::termination_signal() {
        Some(signal) => Err(Error::Interrupted(signal)),
        None => Ok(()),
    };
    let host = FmuProcessOptions {
        program: (guest_program_path()?, vec!["isolated".to_owned()]),
        patience: Duration::from_secs(10),
        give_up: std::sync::Arc::new(|| fmu_import::termination_signal().is_some()),
    };
    let options = ExperimentOptions { host: Some(host), most_runs: *runs, may_continue: &may_continue };
    let explanation = attribution::explain_difference(a, b, &options)?;
    let folder = out.clone().unwrap_or_else(|| match b.is_dir() {
        true => b.clone(),
        false => b.parent().map(PathBuf::from).unwrap_or_default(),
    });
    write_explanation(&explanation, &folder)?;
    match json {
        true => print_json(&serde_json::json!(explanation)),
        false => print_text(&format!("{}{}\n", explanation.to_text(), folder.join(attribution::PAGE).display())),
    }
    Ok(u8::from(!explanation.same))
}

fn write_explanation(explanation: &Explanation, folder: &std::path::Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::output_failure(folder, error))?;
    let json = serde_json::to_string_pretty(explanation).map_err(|error| Error::invalid_input(error.to_string()))?;
    for (name, text) in [(attribution::PAGE, explanation.to_page()), (attribution::DATA, json)] {
        let path = folder.join(name);
        nofollow::write_without_following_links(&path, text).map_err(|error| Error::output_failure(&path, error))?;
    }
    Ok(())
}
