//! `trackside pack`: builds FMU packages of the workspace and packs them, or packs a scenario as a system of SSP or as one FMU, or a
//! Python script as an FMU.

mod fmu_package;
mod library;
mod python;
mod ssp;
mod system;

use std::path::{Path, PathBuf};

use ::system::expose::VariableChoice;
use clap::{Args, ValueEnum};
use diagnostics::Error;
use fmu_export::pack::FmiVersion;
use orchestrator::package::{BuildError, BuildProgress, BuildTarget, CargoWorkspace, PackOptions};
use scenario::BuildRequest;

use super::print_text;
use super::progress::BuildLine;
pub(super) use library::find_package_library;
pub(super) use system::{LIBRARY as SYSTEM_LIBRARY, lists_that_judge};

/// The packages whose FMUs make the closed loop.
const FMUS: [&str; 6] =
    ["plant-fmu", "controller", "estimator", "friction-fmu", "plant-dual-fmu", "driver-fmu"];

/// The folder of the archives when none is named.
const FOLDER: &str = "target/fmu";

/// Arguments of `trackside pack`.
#[derive(Args)]
pub struct PackArguments {
    /// The packages [default: plant-fmu controller estimator friction-fmu plant-dual-fmu driver-fmu], or with `--ssp` the scenario files, with `--fmu` one of them.
    #[arg(value_name = "PACKAGES|SCENARIOS")]
    packages: Vec<String>,
    /// Pack each scenario as an archive of SSP: its FMUs, start values and connections, and the scenario itself for this program.
    #[arg(long, conflicts_with_all = ["example", "fmi"])]
    ssp: bool,
    /// Pack the scenario as one FMU of this name: its FMUs, connections and coupling behind one description.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["example", "ssp"])]
    fmu: Option<String>,
    /// Pack a Python script as an FMU: a class in it that is a `trackside.fmu.Model`. It needs no compiler.
    #[arg(long, value_name = "SCRIPT", conflicts_with_all = ["packages", "example", "ssp", "fmu"])]
    python: Option<PathBuf>,
    /// Name of the FMU of a Python script [default: that of the script].
    #[arg(long, requires = "python")]
    name: Option<String>,
    /// The class in the Python script, where there are several.
    #[arg(long, value_name = "NAME", requires = "python")]
    class: Option<String>,
    /// Files and folders beside the Python script that it needs.
    #[arg(long, value_name = "PATH", num_args = 1.., requires = "python")]
    with: Vec<PathBuf>,
    /// Inputs of the FMU: inputs of the FMUs inside, signals, or columns of tables. `*` stands for any letters.
    #[arg(long, value_name = "NODE.VARIABLE", num_args = 1.., requires = "fmu")]
    inputs: Vec<String>,
    /// Outputs of the FMU [default: those of all FMUs inside]. `*` stands for any letters.
    #[arg(long, value_name = "NODE.VARIABLE", num_args = 1.., requires = "fmu")]
    outputs: Vec<String>,
    /// Pack an example instead, of the given packages or of any. May be repeated.
    #[arg(long, value_name = "NAME")]
    example: Vec<String>,
    /// The version of FMI; archives of 3.0 end in `_fmi3.fmu`.
    #[arg(long, value_name = "VERSION", default_value = "2")]
    fmi: FmiVersionArg,
    /// Put a library for another platform into each archive, too: a target of Rust, such as x86_64-pc-windows-gnu. May be repeated.
    #[arg(long, value_name = "TARGET", conflicts_with = "ssp")]
    target: Vec<String>,
    /// The folder for the archives [default: target/fmu, with `--ssp` target/ssp]; with `--ssp` also the `.ssp` file itself.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// A version of FMI.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum FmiVersionArg {
    /// FMI 2.0.
    #[value(name = "2", alias = "2.0")]
    Two,
    /// FMI 3.0.
    #[value(name = "3", alias = "3.0")]
    Three,
}

impl From<FmiVersionArg> for FmiVersion {
    fn from(fmi: FmiVersionArg) -> Self {
        match fmi {
            FmiVersionArg::Two => FmiVersion::Two,
            FmiVersionArg::Three => FmiVersion::Three,
        }
    }
}

/// Packs the FMUs and prints the paths of the archives.
///
/// # Errors
/// When a package is unknown, does not compile, or makes no FMU.
pub fn run_pack_command(arguments: &PackArguments) -> Result<u8, Error> {
    if arguments.ssp {
        return ssp::pack_scenarios_as_ssp(&arguments.packages, arguments.out.as_deref());
    }
    if let Some(name) = &arguments.fmu {
        refuse_targets(&arguments.target)?;
        let (inputs, outputs) = (arguments.inputs.clone(), arguments.outputs.clone());
        return system::pack_scenario_as_fmu(&system::PackOptions {
            scenarios: &arguments.packages,
            choice: VariableChoice { name: name.clone(), inputs, outputs },
            version: arguments.fmi.into(),
            out: arguments.out.as_deref().unwrap_or(Path::new(FOLDER)),
        });
    }
    let version = arguments.fmi.into();
    let targets = BuildTarget::from_triples(&arguments.target, version)
        .map_err(|error| Error::invalid_input(error.to_string()))?;
    if let Some(script) = &arguments.python {
        return python::pack_python_script(&python::PackOptions {
            script,
            name: arguments.name.as_deref(),
            class: arguments.class.as_deref(),
            with: &arguments.with,
            version,
            targets: &targets,
            out: arguments.out.as_deref().unwrap_or(Path::new(FOLDER)),
        });
    }
    refuse_scenarios(&arguments.packages)?;
    let out = arguments.out.as_deref().unwrap_or(Path::new(FOLDER));
    let mut building = BuildLine::default();
    let archives = CargoWorkspace::containing(Path::new(".")).and_then(|workspace| {
        let products = package_build_requests(&workspace, arguments)?;
        let mut progress = |progress: BuildProgress| building.show(&progress);
        let options = PackOptions { into: Some(out), version, targets: &targets };
        workspace.build_and_pack(&products, &options, &mut progress)
    });
    let archives = archives.map_err(|error| Error::invalid_input(error.to_string()))?;
    for archive in archives.values() {
        print_text(&format!("{}\n", archive.display()));
    }
    Ok(0)
}

/// A scenario is an FMU for this machine only.
fn refuse_targets(targets: &[String]) -> Result<(), Error> {
    let Some(target) = targets.first() else { return Ok(()) };
    let error = Error::invalid_input(format!(
        "--target {target}: an FMU of a scenario is for this machine only, since it steps the FMUs inside by calls of Linux and has their libraries for this machine"
    ));
    Err(error.with_help("pack the packages of its FMUs: trackside pack PACKAGES --target TARGET"))
}

/// Packages have names without endings.
fn refuse_scenarios(packages: &[String]) -> Result<(), Error> {
    let scenario = packages
        .iter()
        .find(|name| Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")));
    let Some(scenario) = scenario else { return Ok(()) };
    let error = Error::invalid_input(format!("expected a package, found the scenario {scenario}"));
    Err(error.with_help(format!(
        "to pack it as a system of SSP: trackside pack {scenario} --ssp; as one FMU: --fmu NAME"
    )))
}

fn package_build_requests(
    workspace: &CargoWorkspace,
    arguments: &PackArguments,
) -> Result<Vec<BuildRequest>, BuildError> {
    let library = |package: &str| BuildRequest { package: package.to_owned(), example: None };
    let packages = arguments.packages.as_slice();
    match (arguments.example.as_slice(), packages) {
        ([], []) => Ok(FMUS.map(library).to_vec()),
        ([], packages) => Ok(packages.iter().map(|package| library(package)).collect()),
        (examples, packages) => {
            examples.iter().map(|example| workspace.find_example(packages, example)).collect()
        }
    }
}
