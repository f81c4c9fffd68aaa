//! Exports a scenario as an SSP archive: FMUs, start values and connections in the words of the standard, and the scenario itself in
//! an annotation, so that nothing of it is lost.

mod connections;
mod connectors;
mod definitions;
mod values;

use std::collections::BTreeMap;
use std::path::Path;

use cosim::system::{NodeBody, NodePlan, System};
use diagnostics::Error;
use ssp::SystemExperiment;
use ssp::write::{
    ArchiveEntryContent, DraftAnnotation, DraftComponent, SspVersion, SystemDraft, pack_archive,
    parameter_set, read_back, system_structure_xml,
};

use crate::build_request::BuildArtifacts;
use crate::bundle::{self, BundleLayout, ScenarioBundle};
use crate::document::{Algorithm, Scenario, ScenarioAnnotation};
use connectors::SystemLookup;
use definitions::SspDefinitions;

const STRUCTURE: &str = "SystemStructure.ssd";
/// The name of all sets of start values: Ecos applies those of one name.
const VALUES: &str = "start_values";
const LAYOUT: BundleLayout =
    BundleLayout { fmus: "resources", others: "extra/org.trackside.scenario", plugins: None };

/// What an export wrote.
#[derive(Debug)]
pub struct ExportReport {
    /// What other tools do not get, and what the archive needs besides.
    pub notes: Vec<String>,
    /// The version of SSP.
    pub version: &'static str,
}

/// Writes the archive `path` of a scenario that was resolved to `system`. It appears under its name when it is complete.
///
/// # Errors
/// When a file of the scenario is missing, or the archive cannot be written.
pub fn export_ssp(
    scenario: &Scenario,
    built: &BuildArtifacts,
    system: &System,
    path: &Path,
) -> Result<ExportReport, Error> {
    let ScenarioBundle { text, mut files, fmus, mut notes, .. } =
        ScenarioBundle::gather(scenario, built, LAYOUT)?;
    files.remove(bundle::SCENARIO);
    let mut entries: BTreeMap<String, ArchiveEntryContent> = files
        .into_iter()
        .map(|(name, content)| match content {
            bundle::BundledFile::File(path) => (name, ArchiveEntryContent::File(path)),
            bundle::BundledFile::Text(text) => (name, ArchiveEntryContent::Text(text)),
        })
        .collect();
    let mut draft = draft_ssp_system(scenario, system, &fmus, &mut entries, &mut notes);
    notes.extend(unexported_features_note(scenario));
    entries.insert(STRUCTURE.to_owned(), ArchiveEntryContent::Text(system_structure_xml(&draft)));
    let read = read_back(&entries)
        .map_err(|error| Error::output_failure(path, format!("the system cannot be read back: {error}")))?;
    let attributes = [("version", "1".to_owned()), ("system", read.fingerprint())];
    draft.annotation = Some(DraftAnnotation {
        kind: ScenarioAnnotation::KIND.to_owned(),
        namespace: ScenarioAnnotation::NAMESPACE.to_owned(),
        element: "Scenario".to_owned(),
        attributes: attributes.map(|(key, value)| (key.to_owned(), value)).to_vec(),
        text,
    });
    entries.insert(STRUCTURE.to_owned(), ArchiveEntryContent::Text(system_structure_xml(&draft)));
    pack_archive(path, &entries).map_err(|error| Error::output_failure(path, error))?;
    let version = match draft.required_version() {
        SspVersion::One => "1.0",
        SspVersion::Two => "2.0",
    };
    Ok(ExportReport { notes, version })
}

/// The system in the words of the standard; files of start values join the entries.
fn draft_ssp_system(
    scenario: &Scenario,
    system: &System,
    fmus: &BTreeMap<String, String>,
    entries: &mut BTreeMap<String, ArchiveEntryContent>,
    notes: &mut Vec<String>,
) -> SystemDraft {
    let variables = SystemLookup::new(system);
    let mut definitions = SspDefinitions::default();
    let element_connections = variables.fmu_connections();
    let nodes = || system.nodes.iter().filter(|node| matches!(node.body, NodeBody::Fmu { .. }));
    let mut components: Vec<_> = nodes()
        .filter_map(|node| {
            let NodeBody::Fmu { fmu, .. } = &node.body else { return None };
            Some(DraftComponent {
                name: node.name.clone(),
                source: fmus.get(&node.name)?.clone(),
                implementation: fmu.description.interface.to_string(),
                values: None,
                connectors: variables.ssp_connectors(node, &element_connections, &mut definitions),
            })
        })
        .collect();
    let connections =
        connections::ssp_connections(&variables, &element_connections, &components, &definitions, notes);
    let clock = system.clock;
    let experiment = SystemExperiment { start: Some(clock.start), stop: Some(clock.stop_time()) };
    let mut draft = SystemDraft {
        name: scenario.name.clone(),
        components: components.clone(),
        connectors: Vec::new(),
        connections,
        units: definitions.units,
        experiment,
        step: Some(clock.step),
        annotation: None,
    };
    let version = draft.required_version();
    for (component, node) in components.iter_mut().zip(nodes()) {
        let values =
            values::ssp_start_values(&variables, node, &component.connectors, &element_connections, notes);
        if !values.is_empty() {
            let name = free_path(entries, node);
            let text = parameter_set(VALUES, version, &values);
            entries.insert(name.clone(), ArchiveEntryContent::Text(text));
            component.values = Some(name);
        }
    }
    draft.components = components;
    draft
}

/// A path for the start values of a node that no other entry has.
fn free_path(entries: &BTreeMap<String, ArchiveEntryContent>, node: &NodePlan) -> String {
    let kept = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    let stem: String = node.name.chars().map(|c| if kept(c) { c } else { '_' }).collect();
    let taken = |name: &str| entries.keys().any(|known| known.eq_ignore_ascii_case(name));
    let names = (1..).map(|number| match number {
        1 => format!("resources/{stem}.ssv"),
        number => format!("resources/{stem}_{number}.ssv"),
    });
    let mut free = names.skip_while(|name| taken(name));
    free.next().unwrap_or_default()
}

/// What the scenario has that the standard has no words for.
fn unexported_features_note(scenario: &Scenario) -> Option<String> {
    let document = &scenario.document;
    let effects = document.connect.iter().map(|connect| connect.effects().len()).sum();
    let ends = document.connect.iter().filter(|connect| connect.at.is_some()).count();
    let extrapolations = document.connect.iter().filter(|it| it.extrapolate.is_some()).count();
    let steps = document.fmu.iter().filter(|fmu| fmu.step.is_some()).count();
    let coupling = &document.coupling;
    let divides = coupling.tolerance.is_some() || coupling.on_discard.is_some();
    let couples = coupling.algorithm != Algorithm::default() || divides;
    let view = &document.view;
    let views = view.plot.len() + view.xy_plot.len() + view.arrow.len();
    let counts = [
        (document.signal.len(), "[[signal]]"),
        (document.table.len(), "[[table]]"),
        (document.connector.len(), "[[connector]]"),
        (effects, "sensor effects"),
        (ends, "`at` of [[connect]]"),
        (extrapolations, "`extrapolate` of [[connect]]"),
        (steps, "`step` of [[fmu]]"),
        (usize::from(couples), "[coupling]"),
        (document.fault.len(), "[[fault]]"),
        (document.check.len(), "[[check]]"),
        (document.baseline.len(), "[[baseline]]"),
        (document.analysis.len(), "[[analysis]]"),
        (document.validation.len(), "[[validation]]"),
        (views, "drawings of [view]"),
    ];
    let counts = counts.iter().filter(|(count, _)| *count > 0);
    let words: Vec<_> = counts.map(|(count, what)| format!("{count} {what}")).collect();
    (!words.is_empty()).then(|| {
        format!(
            "SSP has no words for {}: they are in an annotation, which other tools ignore",
            words.join(", ")
        )
    })
}
