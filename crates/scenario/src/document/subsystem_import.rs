//! Imports the systems of SSP that `[[system]]` names, and refuses names that two nodes would have.

use std::ops::Range;

use diagnostics::{Error, ErrorCollector, SourceFiles, TextFile};
use toml::Spanned;
use toml::de::DeTable;

use super::subsystem::subsystem_name_or_stem;
use super::system::{self, SubsystemPart, SubsystemSettings, SystemStepping};
use super::{Algorithm, SystemImport};

/// An entry of `[[system]]`.
struct SubsystemEntry {
    name: String,
    /// Whether the scenario gives the name.
    named: bool,
    /// The place of the name, or else that of the path.
    span: Range<usize>,
    path: Spanned<String>,
    variant: Option<Spanned<String>>,
    unconnected: bool,
}

/// A node of the scenario or of a system.
struct NodeName {
    name: String,
    span: Range<usize>,
    /// The system that it is a part of.
    system: Option<String>,
    /// Whether it is an FMU, and whether its words name the archive or package.
    fmu: Option<bool>,
}

/// What the scenario says of its run, each with the place where it says so.
struct EnclosingSettings {
    step: Option<f64>,
    stops: bool,
    times: Option<String>,
    /// The algorithm, and where it is written.
    algorithm: (String, String),
}

/// The texts of the systems that `table` names, the merged one of the files.
///
/// # Errors
/// When one of them cannot be used, or its names are taken.
pub(super) fn import_subsystems(
    source: &SourceFiles,
    table: &DeTable,
) -> Result<Vec<(TextFile, SystemImport)>, Error> {
    let mut outer = EnclosingSettings::read(source, table);
    let (mut nodes, mut names, mut added) = (scenario_node_names(table), Vec::new(), Vec::new());
    let mut mistakes = ErrorCollector::default();
    for entry in tables_in_list(table, "system").filter_map(parse_subsystem_entry) {
        let free = name_is_free(source, &entry, &names, &nodes);
        names.push((entry.name.clone(), entry.named));
        let made = free.and_then(|()| import_subsystem(source, &entry, &outer));
        let Some(mut made) = mistakes.ok_or_record(made) else { continue };
        mistakes.ok_or_record(nodes_are_free(source, &entry, &mut made, &mut nodes));
        made.import.stepping = Some(outer.stepping_of(&entry, &made));
        added.push((made.file, made.import));
    }
    mistakes.into_result().map(|()| added)
}

/// The tables of a list at the top level.
fn tables_in_list<'t, 'a>(table: &'t DeTable<'a>, list: &str) -> impl Iterator<Item = &'t DeTable<'a>> {
    let list = table.get(list).and_then(|list| list.get_ref().as_array());
    list.into_iter().flatten().filter_map(|entry| entry.get_ref().as_table())
}

/// The text of a key, with its place.
fn spanned_text(table: &DeTable, key: &str) -> Option<Spanned<String>> {
    let value = table.get(key)?;
    Some(Spanned::new(value.span(), value.get_ref().as_str()?.to_owned()))
}

/// An entry with a path; the schema tells what else is wrong with one.
fn parse_subsystem_entry(table: &DeTable) -> Option<SubsystemEntry> {
    let path = spanned_text(table, "path")?;
    let given = spanned_text(table, "name");
    let (named, span) = (given.is_some(), given.as_ref().unwrap_or(&path).span());
    let name = subsystem_name_or_stem(given.as_ref().map(|name| name.get_ref().as_str()), path.get_ref());
    let unconnected = spanned_text(table, "unconnected").is_some();
    Some(SubsystemEntry { name, named, span, path, variant: spanned_text(table, "variant"), unconnected })
}

/// The nodes of the scenario itself.
fn scenario_node_names(table: &DeTable) -> Vec<NodeName> {
    let of = |list: &'static str| {
        tables_in_list(table, list).filter_map(move |entry| {
            let word = spanned_text(entry, "name")?;
            let span = word.span();
            let named = word.into_inner();
            // A signal is `node.variable`.
            let name = named.split('.').next().unwrap_or_default().to_owned();
            let comes = entry.contains_key("path") || entry.contains_key("crate");
            Some(NodeName { name, span, system: None, fmu: (list == "fmu").then_some(comes) })
        })
    };
    of("fmu").chain(of("signal")).chain(of("table")).collect()
}

fn name_is_free(
    source: &SourceFiles,
    entry: &SubsystemEntry,
    names: &[(String, bool)],
    nodes: &[NodeName],
) -> Result<(), Error> {
    let SubsystemEntry { name, named, span, .. } = entry;
    let wrong = |message: String| source.error_at(span.clone(), message, "");
    if name.is_empty() || name.contains(['.', '"', '\\']) {
        let message = format!("expected a name without `.`, `\"` and `\\`, found {name:?}");
        return Err(wrong(message));
    }
    if let Some((_, other)) = names.iter().find(|(known, _)| known == name) {
        let error = wrong(format!("there are two systems called `{name}`"));
        return Err(match *named && *other {
            true => error.with_help("give one of them another name"),
            false => error.with_help(format!(
                "without `name`, a system is called as its file: give this one a name, such as name = \"{name}_2\""
            )),
        });
    }
    match nodes.iter().find(|node| node.name == *name) {
        None => Ok(()),
        Some(NodeName { system: Some(system), .. }) => {
            let message = format!("`{name}` is a node of the system `{system}` already");
            Err(wrong(message).with_help("give the system another `name`"))
        }
        Some(_) => Err(wrong(format!("`{name}` is a node of the scenario already"))
            .with_help("give the system another `name`")),
    }
}

/// The text of an entry.
fn import_subsystem(
    source: &SourceFiles,
    entry: &SubsystemEntry,
    outer: &EnclosingSettings,
) -> Result<SubsystemPart, Error> {
    let SubsystemEntry { name, path: word, variant, unconnected, .. } = entry;
    let path = source.base_folder(word.span()).join(word.get_ref());
    if path.exists() && !system::is_system(&path) {
        let message = format!("expected a system of SSP, found {}", path.display());
        return Err(source.error_at(word.span(), message, "").with_help(
            "a system is an .ssp archive, its folder or its .ssd file; `extends` takes a scenario, `[[fmu]]` an FMU",
        ));
    }
    let settings =
        SubsystemSettings { name, unconnected: *unconnected, step: outer.step, stops: outer.stops };
    let chosen = variant.as_ref().map(|variant| variant.get_ref().as_str());
    system::import_part(&path, chosen, &settings).map_err(|found| {
        let span = variant.as_ref().filter(|_| found.variant).unwrap_or(word).span();
        let message = format!("the system cannot be used: {}", found.error);
        source.error_at(span, message, "").with_optional_help(found.hint)
    })
}

/// Refuses nodes of a system whose names others have, and adds them to the others. An FMU of the scenario with the name of one
/// changes that one.
fn nodes_are_free(
    source: &SourceFiles,
    entry: &SubsystemEntry,
    made: &mut SubsystemPart,
    nodes: &mut Vec<NodeName>,
) -> Result<(), Error> {
    let mut mistakes = ErrorCollector::default();
    let system = &entry.name;
    for name in &made.nodes {
        match nodes.iter().find(|node| node.name == *name) {
            Some(NodeName { system: None, fmu: Some(false), .. }) | None => {}
            Some(NodeName { system: None, fmu: Some(true), span, .. }) => {
                let position = source.describe_position(span.start);
                made.import.notes.push(format!(
                    "{position}: `{name}` takes the place of the FMU of this name in the system `{system}`"
                ));
            }
            Some(NodeName { system: None, fmu: None, span, .. }) => {
                let message = format!("`{name}` is a node of the system `{system}` already");
                let error = source.error_at(span.clone(), message, "");
                mistakes.push(error.with_help("rename this one, or give the system another `name`"));
            }
            Some(NodeName { system: Some(other), .. }) => {
                let message =
                    format!("the systems `{other}` and `{system}` would both have a node called `{name}`");
                let error = source.error_at(entry.span.clone(), message, "");
                mistakes.push(error.with_help("give one of them another `name`"));
            }
        }
    }
    nodes.extend(made.nodes.iter().map(|name| NodeName {
        name: name.clone(),
        span: entry.span.clone(),
        system: Some(system.clone()),
        fmu: None,
    }));
    mistakes.into_result()
}

impl EnclosingSettings {
    fn read(source: &SourceFiles, table: &DeTable) -> Self {
        let at = |span: &Range<usize>| source.describe_position(span.start);
        let inner = |list: &str, key: &str| {
            let value = table.get(list)?.get_ref().as_table()?.get(key)?;
            Some((source.text_at(value.span()).to_owned(), at(&value.span())))
        };
        let step = inner("time", "step");
        let stop = inner("time", "stop");
        let number = |text: &str| text.replace('_', "").parse::<f64>().ok();
        let coupling = match table.get("coupling").and_then(|it| it.get_ref().as_table()) {
            Some(words) if words.contains_key("algorithm") => inner("coupling", "algorithm"),
            _ => None,
        };
        let algorithm = coupling
            .map(|(text, position)| (text.trim_matches(['"', '\'']).to_owned(), format!(" of {position}")));
        let times = match (&step, &stop) {
            (Some((step, position)), Some((stop, _))) => {
                Some(format!("the step {step} s and the stop time {stop} s of {position}"))
            }
            _ => None,
        };
        EnclosingSettings {
            step: step.and_then(|(text, _)| number(&text)),
            stops: stop.is_some(),
            times,
            algorithm: algorithm.unwrap_or_else(|| {
                let default = Algorithm::default().keyword().to_owned();
                (default, ", since nothing says otherwise".to_owned())
            }),
        }
    }

    /// The note about the times and the algorithm that a system runs with; the first system may give the times of all.
    fn stepping_of(
        &mut self,
        SubsystemEntry { name, .. }: &SubsystemEntry,
        SubsystemPart { times, .. }: &SubsystemPart,
    ) -> SystemStepping {
        let (step, taken) = times;
        self.step = Some(*step);
        self.stops = true;
        let times = self.times.get_or_insert_with(|| taken.clone());
        let times = format!("the system `{name}` runs with {times}");
        SystemStepping::Part { times, algorithm: self.algorithm.clone() }
    }
}
