//! `trackside pack --fmu`: packs a scenario as one FMU.

use std::collections::BTreeMap;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use ::system::expose::{self, VariableChoice};
use cosim::system::{NodeBody, NodePlan, System};
use diagnostics::Error;
use fmu_export::pack::{FmiVersion, is_identifier};
use orchestrator::package::{self, BuildProgress};
use scenario::bundle::{BundleLayout, SCENARIO, ScenarioBundle};
use scenario::document::Document;
use scenario::plan::RunPlan;
use scenario::resolve::Overrides;
use scenario::{BuildArtifacts, Scenario};

use super::fmu_package::FmuPackage;
use crate::command::progress::BuildLine;
use crate::command::{print_text, print_to_stderr};

/// The package whose library steps a scenario.
pub const LIBRARY: &str = "system-fmu";

/// What to pack, and how.
pub struct PackOptions<'a> {
    /// One scenario.
    pub scenarios: &'a [String],
    /// Name, inputs and outputs of the FMU.
    pub choice: VariableChoice,
    /// Its version of FMI.
    pub version: FmiVersion,
    /// The folder of the archive.
    pub out: &'a Path,
}

/// Packs a scenario and prints the path of the archive.
///
/// # Errors
/// When the scenario is wrong, a chosen variable is none, or the archive cannot be written.
pub fn pack_scenario_as_fmu(options: &PackOptions) -> Result<u8, Error> {
    let [path] = options.scenarios else {
        let found = options.scenarios.len();
        let error = Error::invalid_input(format!("--fmu: expected one scenario, found {found}"));
        return Err(error
            .with_help("trackside pack SCENARIO.toml --fmu NAME --inputs plant.delta --outputs 'plant.*'"));
    };
    let name = &options.choice.name;
    if !is_identifier(name) {
        return Err(Error::invalid_input(format!(
            "--fmu: expected letters, digits and `_` without a digit in front, found `{name}`"
        )));
    }
    let scenario = Scenario::read(Path::new(path))?;
    let mut building = BuildLine::default();
    let progress = &mut |progress: BuildProgress| building.show(&progress);
    let built = package::build_scenario_packages(&scenario, progress)?;
    let original = RunPlan::resolve(&scenario, &built, &Overrides::default(), PathBuf::new())?;
    refuse_multi_process_fmus(&original.system)?;
    let libraries = super::library::find_package_libraries(LIBRARY, &[], progress)?;
    let private = tempfile::Builder::new().permissions(Permissions::from_mode(0o700)).tempdir();
    let folder = private.map_err(|error| Error::output_failure(Path::new("."), error))?;
    let exposed = prepare_system_export(&scenario, &original.system, &built, &options.choice, folder.path())?;
    let ExportedSystem { mut interface, table, left_out, resources } = exposed;
    let (version, out) = (options.version, options.out);
    let package = FmuPackage { name, version, out, table: &table, libraries: &libraries };
    interface.guid = package.content_guid(&resources);
    let path = package.write_archive(&interface.guid, resources, ::system::INTERFACE, &interface)?;
    if !left_out.is_empty() {
        let names = left_out.join(", ");
        print_to_stderr(&format!(
            "note: these parameters are none of the FMU, since they have no start value that FMI 2.0 can hold: {names}"
        ));
    }
    print_text(&format!("{}\n", path.display()));
    Ok(0)
}

/// What the scenario looks like from outside.
struct ExportedSystem {
    interface: ::system::ScenarioFmuInterface,
    table: fmu_export::description::DescriptionTable,
    left_out: Vec<String>,
    /// The files of the scenario, by their paths.
    resources: BTreeMap<String, Vec<u8>>,
}

/// Refuses FMUs that cannot be in one process.
fn refuse_multi_process_fmus(system: &System) -> Result<(), Error> {
    let fmus = system.nodes.iter().filter_map(|node| match &node.body {
        NodeBody::Fmu { fmu, .. } => Some((&node.name, fmu)),
        _ => None,
    });
    let fmus: Vec<_> = fmus.collect();
    for (place, (name, fmu)) in fmus.iter().enumerate() {
        for (other, theirs) in &fmus[..place] {
            if let Some(why) = fmu.clash_reason(theirs) {
                let message = format!(
                    "`{other}` and `{name}` cannot be in one FMU, which steps all of its own in one process: {why}"
                );
                return Err(Error::invalid_input(message).with_help(
                    "`trackside run` gives one of them a process of its own; or pack the scenario with `--ssp`",
                ));
            }
        }
    }
    Ok(())
}

/// The lists of a scenario that judge a run, those that have entries.
pub fn lists_that_judge(document: &Document) -> Vec<&'static str> {
    let lists = [
        ("check", document.check.is_empty()),
        ("analysis", document.analysis.is_empty()),
        ("validation", document.validation.is_empty()),
        ("baseline", document.baseline.is_empty()),
    ];
    lists.iter().filter(|(_, empty)| !empty).map(|(list, _)| *list).collect()
}

/// Gathers the scenario and all its files in a folder, with the chosen inputs free.
fn prepare_system_export(
    scenario: &Scenario,
    original: &System,
    built: &BuildArtifacts,
    choice: &VariableChoice,
    folder: &Path,
) -> Result<ExportedSystem, Error> {
    let overrides = Overrides::default();
    let layout = BundleLayout { fmus: "fmus", others: "files", plugins: None };
    let bundle = ScenarioBundle::gather(scenario, built, layout)?;
    bundle.write(folder)?;
    let apart = |node: &&NodePlan| matches!(node.body, NodeBody::Fmu { isolation: Some(_), .. });
    for node in original.nodes.iter().filter(apart) {
        let what = "is not isolated there: an FMU steps all of its own in one process";
        print_to_stderr(&format!("note: `{}` {what}", node.name));
    }
    let document = &scenario.document;
    let unused_lists = lists_that_judge(document);
    let written = document.connect.iter().map(|it| it.to.get_ref().as_str()).collect();
    let (inputs, text) =
        expose::extend_scenario_for_inputs(original, &unused_lists, &written, SCENARIO, choice)?;
    let path = folder.join(::system::SCENARIO);
    std::fs::write(&path, text).map_err(|error| Error::output_failure(&path, error))?;
    let guided = Scenario::read(&path)?;
    let mut plan = RunPlan::resolve(&guided, &BuildArtifacts::default(), &overrides, PathBuf::new())?;
    let (interface, table, left_out) = expose::build_fmu_interface(&mut plan, choice, &inputs)?;
    let names = bundle.files.keys().map(String::as_str).chain([SCENARIO, ::system::SCENARIO]);
    let read = |name: &str| {
        let path = folder.join(name);
        let bytes = std::fs::read(&path).map_err(|error| Error::output_failure(&path, error))?;
        Ok((name.to_owned(), bytes))
    };
    let resources = names.map(read).collect::<Result<_, Error>>()?;
    Ok(ExportedSystem { interface, table, left_out, resources })
}
