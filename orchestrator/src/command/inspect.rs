//! `trackside inspect`: prints the description of an FMU, the coupling of a scenario, or the channels of a log.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;
use fmu_import::Fmu;
use orchestrator::inspect;
use orchestrator::package::{self, BuildProgress};
use recording::survey::SurveyExtent;
use recording::table;
use scenario::Scenario;
use scenario::plan::RunPlan;
use scenario::resolve::{AnalysisLoading, Overrides};

use super::progress::BuildLine;
use super::{print_json, print_text};

/// Arguments of `trackside inspect`.
#[derive(Args)]
pub struct InspectArguments {
    /// The archive of an FMU, a scenario, a system of SSP, or a log: MCAP, a bag of ROS 2 (file or folder), CSV, MoTeC, VBOX, Parquet, Arrow, MAT.
    #[arg(required_unless_present = "sandbox")]
    file: Option<PathBuf>,
    /// Print what the sandbox of an isolated FMU keeps it from on this machine, and what the kernel lacks for it.
    #[arg(long, exclusive = true)]
    sandbox: bool,
    /// Print JSON instead of lines.
    #[arg(long)]
    json: bool,
    /// Read a large log as a whole: of one above 64 MiB with an index (MCAP, MDF, MoTeC, Parquet) only the beginning is read.
    #[arg(long)]
    all: bool,
    /// Print the nodes of a scenario and their connections as a graph for Graphviz: `trackside inspect --dot SCENARIO | dot -Tsvg`.
    #[arg(long, conflicts_with = "json")]
    dot: bool,
    /// The description of a system of SSP that counts, by its file or its name.
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
}

/// Prints the description. No script, no plugin and no library of an FMU is loaded.
///
/// # Errors
/// When the archive cannot be opened, or the scenario is wrong.
pub fn run_inspect_command(arguments: &InspectArguments) -> Result<u8, Error> {
    let Some(file) = &arguments.file else { return inspect_sandbox() };
    let is = |endings: &[&str]| {
        let ending = file.extension().map(|it| it.to_ascii_lowercase());
        ending.is_some_and(|ending| endings.iter().any(|it| ending == *it))
    };
    let is_scenario = is(&["toml", "ssp", "ssd"]);
    let is_fmu = !is_scenario && (is(&["fmu"]) || table::is_fmu(file));
    if arguments.all && (is_scenario || is_fmu) {
        let message = format!("expected a log for `--all`, found {}", file.display());
        return Err(Error::invalid_input(message));
    }
    if is_scenario {
        return inspect_scenario(file, arguments);
    }
    if arguments.dot || arguments.variant.is_some() {
        let message = format!("expected a scenario for `--dot` and `--variant`, found {}", file.display());
        return Err(Error::invalid_input(message));
    }
    if !is_fmu {
        let extent = if arguments.all { SurveyExtent::Whole } else { SurveyExtent::Beginning };
        let survey = table::survey_file(file, extent).map_err(|it| Error::invalid_input(it.to_string()))?;
        match arguments.json {
            true => print_json(&survey.to_json()),
            false => print_text(&survey.terminal_report()),
        }
        return Ok(0);
    }
    let fmu = Fmu::open(file).map_err(|error| Error::invalid_input(error.to_string()))?;
    match arguments.json {
        true => print_json(&inspect::fmu_json(&fmu)),
        false => print_text(&inspect::describe_fmu(&fmu)),
    }
    Ok(0)
}

fn inspect_scenario(file: &Path, arguments: &InspectArguments) -> Result<u8, Error> {
    let scenario = Scenario::read_variant(file, arguments.variant.as_deref())?;
    let mut building = BuildLine::default();
    let mut progress = |progress: BuildProgress| building.show(&progress);
    let built = package::build_fmus(&scenario, &mut progress)?;
    let folder = Path::new("target/runs").to_owned();
    let overrides = Overrides { analyses: AnalysisLoading::Skip, ..Overrides::default() };
    let plan = RunPlan::resolve(&scenario, &built, &overrides, folder)?;
    match (arguments.json, arguments.dot) {
        (true, _) => print_json(&inspect::scenario::describe_scenario_as_json(&scenario, &plan)),
        (_, true) => print_text(&inspect::scenario::system_dot_graph(&plan.system)),
        _ => print_text(&inspect::scenario::describe_scenario(&scenario, &plan)),
    }
    Ok(0)
}

/// In a process of its own, as a sandbox is for good.
fn inspect_sandbox() -> Result<u8, Error> {
    let failed = |error: std::io::Error| Error::invalid_input(format!("no process for the sandbox: {error}"));
    let program = std::env::current_exe().map_err(failed)?;
    let mut process = std::process::Command::new(program);
    let status = process.args(["isolated", "0", "--sandbox"]).status().map_err(failed)?;
    match status.success() {
        true => Ok(0),
        false => Err(Error::invalid_input(format!("the process in the sandbox ended with {status}"))),
    }
}
