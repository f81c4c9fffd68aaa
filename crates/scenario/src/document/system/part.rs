//! Imports an SSP system as a part of a scenario, with its connectors.

use std::path::Path;

use diagnostics::{Error, TextFile};

use super::experiment::{DefaultExperiment, ExperimentTime};
use super::{ImportError, ScenarioAnnotation, ScenarioWriter, SystemImport};

/// What a system is for the scenario that it is a part of.
pub(in crate::document) struct SubsystemSettings<'a> {
    /// Its name there.
    pub name: &'a str,
    /// Whether its input connectors may stay without a connection.
    pub unconnected: bool,
    /// The step that the scenario has already [s].
    pub step: Option<f64>,
    /// Whether the scenario has its stop time already.
    pub stops: bool,
}

/// A system as a part of a scenario.
pub(in crate::document) struct SubsystemPart {
    pub file: TextFile,
    pub import: SystemImport,
    /// The names of its nodes.
    pub nodes: Vec<String>,
    /// The step [s], with the sentence about the times that the scenario takes from the system.
    pub times: (f64, String),
}

/// The system at a path as the text of a part; `variant` chooses another description of it.
///
/// # Errors
/// As for [`import_system`].
pub(in crate::document) fn import_part(
    path: &Path,
    variant: Option<&str>,
    settings: &SubsystemSettings,
) -> Result<SubsystemPart, ImportError> {
    let system = ssp::open_system(path, variant).map_err(|error| ImportError::new(&error))?;
    let mut notes = Vec::new();
    if variant.is_none() && !system.others.is_empty() {
        let (others, path) = (system.others.join(", "), path.display());
        notes.push(format!(
            "{path} has the variants {others} besides: `variant = \"NAME\"` in its [[system]] takes one"
        ));
    }
    match ScenarioAnnotation::from_system(&system, path) {
        Some(ScenarioAnnotation::Current(_)) => notes.push(format!(
            "{}: [[system]] takes FMUs, start values and connections; the signals, effects, checks and all else of the scenario in its annotation are left out, which `extends` takes",
            path.display()
        )),
        Some(ScenarioAnnotation::Stale(note)) => notes.push(note),
        None => {}
    }
    let mut writer = ScenarioWriter::new(&system, Some(settings))?;
    let times = writer.times_of_part(settings)?;
    writer.write_nodes_and_connections()?;
    writer.write_connectors(settings)?;
    let ScenarioWriter { text, source_map, notes: more, names: nodes, .. } = writer;
    notes.extend(system.notes.iter().cloned().chain(more));
    // Two parts may be of one system.
    let path = format!("{} as {}", path.display(), settings.name).into();
    let file = TextFile { path, text, source_map, ..TextFile::default() };
    Ok(SubsystemPart { file, import: SystemImport::new(notes, None, Some(system)), nodes, times })
}

impl ScenarioWriter<'_> {
    /// Writes the times that the scenario around the system leaves open. The step and where the times come from.
    fn times_of_part(&mut self, settings: &SubsystemSettings) -> Result<(f64, String), Error> {
        if let (Some(step), true) = (settings.step, settings.stops) {
            return Ok((step, String::new()));
        }
        let step = settings.step.map(|step| ExperimentTime::new(step, ""));
        let DefaultExperiment { start, step, stop } = self.default_experiment(step)?;
        let mut taken = Vec::new();
        self.write_line(format_args!("[time]"));
        if settings.step.is_none() {
            self.write_line(format_args!("step = {:?}", step.value));
            taken.push(format!("the step {} s ({})", step.value, step.origin));
        }
        if !settings.stops {
            self.write_line(format_args!("start = {start:?}\nstop = {:?}", stop.value));
            taken.push(format!("the time from {start} s to {} s ({})", stop.value, stop.origin));
        }
        Ok((step.value, format!("{} of the system `{}`", taken.join(" and "), settings.name)))
    }
}
