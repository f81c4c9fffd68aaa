//! `trackside session`: prepares a scenario for a program that steps it itself, such as Python's `trackside.Session`.
//!
//! The folder gets the gathered scenario, all its files, and the interface: the resources of an FMU without an archive around them. The
//! other program loads the library that the answer names, and makes an instance of FMI 3.0 with this folder.

use std::path::{Path, PathBuf};

use ::system::SessionSettings;
use ::system::expose::{self, SessionDescription, VariableChoice};
use clap::Args;
use diagnostics::Error;
use orchestrator::package::{self, BuildProgress};
use scenario::bundle::{BundleLayout, SCENARIO, ScenarioBundle};
use scenario::plan::RunPlan;
use scenario::resolve::{AnalysisLoading, IsolationPolicy, Overrides};
use scenario::{BuildArtifacts, Scenario};
use serde::Serialize;

use super::progress::BuildLine;
use super::{current_program_path, pack, print_json, print_to_stderr, run};

/// Arguments of `trackside session`.
#[derive(Args)]
pub struct SessionArguments {
    /// The scenario.
    scenario: PathBuf,
    /// The folder for its files, which is there and empty.
    #[arg(long)]
    out: PathBuf,
    /// A value as `trackside run` takes it. May be repeated.
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// The seed of every random stream, instead of the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// A tunable parameter that the session may set between two steps. May be repeated.
    #[arg(long, value_name = "NODE.VARIABLE")]
    tunable: Vec<String>,
    /// Run all FMUs in processes of their own.
    #[arg(long)]
    isolate: bool,
    /// The library of an earlier session, which the other program has in memory.
    #[arg(long)]
    library: Option<PathBuf>,
}

/// The answer: what the other program needs for an instance.
#[derive(Serialize)]
struct PreparedSession {
    /// The library with the functions of FMI 3.0.
    library: PathBuf,
    /// The instantiation token.
    token: String,
    /// The name of the scenario.
    name: String,
    #[serde(flatten)]
    description: SessionDescription,
}

/// Prepares the folder and prints what the other program needs, as JSON.
///
/// # Errors
/// When the scenario or an argument is wrong, or the folder cannot be written.
pub fn run_session_command(arguments: &SessionArguments) -> Result<u8, Error> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let mut building = BuildLine::default();
    let progress = &mut |progress: BuildProgress| building.show(&progress);
    let built = package::build_scenario_packages(&scenario, progress)?;
    let library = match &arguments.library {
        Some(library) => library.clone(),
        None => pack::find_package_library(pack::SYSTEM_LIBRARY, progress)?,
    };
    let isolate = if arguments.isolate { IsolationPolicy::Everything } else { IsolationPolicy::Nothing };
    let starts = run::parse_start_values(&arguments.set)?;
    let (seed, analyses) = (arguments.seed, AnalysisLoading::Skip);
    let overrides = Overrides { starts, seed, isolate, analyses, ..Overrides::default() };
    let original = RunPlan::resolve(&scenario, &built, &overrides, PathBuf::new())?;
    original.system.warnings.iter().for_each(|warning| print_to_stderr(&format!("warning: {warning}")));

    let layout = BundleLayout { fmus: "fmus", others: "files", plugins: None };
    let bundle = ScenarioBundle::gather(&scenario, &built, layout)?;
    bundle.write(&arguments.out)?;
    let inputs = expose::free_input_names(&original.system, &arguments.tunable)?;
    let choice = VariableChoice { inputs, ..VariableChoice::default() };
    let unused_lists = pack::lists_that_judge(&scenario.document);
    let written = scenario.document.connect.iter().map(|it| it.to.get_ref().as_str()).collect();
    let (inputs, text) =
        expose::extend_scenario_for_inputs(&original.system, &unused_lists, &written, SCENARIO, &choice)?;
    let path = arguments.out.join(::system::SCENARIO);
    write_file(&path, &text)?;

    // A free input takes its value from its signal from here on, which begins with the value that was set.
    let starts = overrides.starts.iter().filter(|it| !choice.inputs.contains(&it.name)).cloned().collect();
    let overrides = Overrides { starts, ..overrides };
    let mut plan =
        RunPlan::resolve(&Scenario::read(&path)?, &BuildArtifacts::default(), &overrides, PathBuf::new())?;
    let program = current_program_path()?;
    let settings = SessionSettings {
        program: program.clone(),
        starts: overrides.starts.clone(),
        seed: overrides.seed,
        isolate: arguments.isolate,
    };
    let (mut interface, description) = expose::build_session_interface(&mut plan, &inputs, settings);
    // States of one session are those of another one with the same scenario and values.
    let identity = format!("{}{text}{:?}{:?}", bundle.text, overrides.starts, overrides.seed);
    interface.guid = format!("{{{}}}", &fmu_import::sha256_hex(identity.as_bytes())[..32]);
    let text = serde_json::to_string(&interface)
        .map_err(|error| Error::invalid_input(format!("{}: {error}", ::system::INTERFACE)))?;
    write_file(&arguments.out.join(::system::INTERFACE), &text)?;
    let (token, name) = (interface.guid, bundle.name);
    let answer = serde_json::to_value(PreparedSession { library, token, name, description });
    print_json(&answer.map_err(|error| Error::invalid_input(format!("the answer: {error}")))?);
    Ok(0)
}

fn write_file(path: &Path, text: &str) -> Result<(), Error> {
    std::fs::write(path, text).map_err(|error| Error::output_failure(path, error))
}
