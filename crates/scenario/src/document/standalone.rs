//! Imports a single FMU as the text of a scenario: its default experiment, its start values, all of its outputs.

use std::path::Path;

use diagnostics::{Error, TextFile};
use fmu_import::Fmu;
use fmu_import::description::FmiType;

use super::SystemImport;
use super::system::{DefaultExperiment, ExperimentSettings, default_experiment, node_name, toml_string};

/// What the command line says of the run of an FMU.
#[derive(Debug, Clone, Default)]
pub struct StandaloneOptions {
    /// Variables of the FMU with their start values as they are typed.
    pub starts: Vec<(String, String)>,
    /// Relative tolerance of the integration inside the FMU [-].
    pub tolerance: Option<f64>,
}

/// Whether a path is that of an FMU rather than of a scenario.
#[must_use]
pub fn is_fmu(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("fmu"))
}

/// The text of the scenario that runs an FMU by itself, for a file at `file`.
///
/// # Errors
/// When the FMU cannot be opened, or proposes a stop time that comes before its start.
pub fn standalone_scenario_text(
    fmu: &Path,
    file: &Path,
    options: &StandaloneOptions,
) -> Result<String, Error> {
    let absolute = |path: &Path| std::path::absolute(path).map_err(|it| Error::invalid_input(it.to_string()));
    let (opened, archive) = (open_standalone_fmu(fmu)?, absolute(fmu)?);
    let (times, _) = proposed_times(fmu, &opened)?;
    let folder = absolute(file)?.parent().map(Path::to_owned).unwrap_or_default();
    let path = archive.strip_prefix(folder).unwrap_or(&archive);
    Ok(fmu_scenario_text(&opened, path, &times, options))
}

/// The scenario of an FMU, as the text of a file beside it.
pub(super) fn import_fmu(path: &Path) -> Result<(TextFile, SystemImport), Error> {
    let fmu = open_standalone_fmu(path)?;
    let (times, mut notes) = proposed_times(path, &fmu)?;
    let DefaultExperiment { start, step, stop } = &times;
    notes.push(format!(
        "{} runs by itself from {start} s to {} s ({}) with the step {} s ({}); `--save-scenario FILE` writes this scenario",
        path.display(),
        stop.value,
        stop.origin,
        step.value,
        step.origin
    ));
    let name = Path::new(path.file_name().unwrap_or_default());
    let text = fmu_scenario_text(&fmu, name, &times, &StandaloneOptions::default());
    Ok((TextFile::new(path, text), SystemImport::new(notes, None, None)))
}

fn open_standalone_fmu(path: &Path) -> Result<Fmu, Error> {
    Fmu::open(path).map_err(|error| Error::invalid_input(error.to_string()))
}

/// The times that the description proposes, and what there is to say about them.
fn proposed_times(path: &Path, fmu: &Fmu) -> Result<(DefaultExperiment, Vec<String>), Error> {
    let proposal = fmu.description.default_start;
    let (start, mut notes) = (proposal.max(0.0), Vec::new());
    if start != proposal {
        notes.push(format!(
            "{} proposes to start at {proposal} s: recordings have no times before 0 s, so it starts there",
            path.display()
        ));
    }
    let given = ExperimentSettings { start, stop: None, step: None };
    let name = path.display().to_string();
    default_experiment(&name, given, std::slice::from_ref(fmu)).map(|times| (times, notes))
}

/// The text of the scenario of an FMU, whose archive it names by `path`.
fn fmu_scenario_text(
    fmu: &Fmu,
    path: &Path,
    times: &DefaultExperiment,
    options: &StandaloneOptions,
) -> String {
    let DefaultExperiment { start, step, stop } = times;
    let description = &fmu.description;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let tolerance = options.tolerance.map(|it| format!("tolerance = {it:?}\n")).unwrap_or_default();
    let mut starts = String::new();
    let mut archive = toml_string(&path.to_string_lossy());
    for (name, typed) in &options.starts {
        let is_text = description
            .find_variable(name)
            .is_some_and(|it| matches!(description.variables[it].kind, FmiType::String | FmiType::Binary));
        let is_value = !is_text && typed.parse::<toml::Value>().is_ok();
        let value = if is_value { typed.clone() } else { toml_string(typed) };
        match name == "path" && typed.ends_with(".fmu") {
            true => archive = value,
            false => starts += &format!("{} = {value}\n", toml_string(name)),
        }
    }
    if !starts.is_empty() {
        starts.insert_str(0, "\n[fmu.start]\n");
    }
    format!(
        "title = {}\n\n[time]\nstart = {start:?}\nstep = {:?}\nstop = {:?}\n{tolerance}\n[[fmu]]\nname = {}\npath = {archive}\n\
         unconnected = \"start\"\n{starts}",
        toml_string(&description.name),
        step.value,
        stop.value,
        toml_string(&node_name(&stem)),
    )
}
