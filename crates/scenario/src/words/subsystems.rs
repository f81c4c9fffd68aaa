//! Makes the texts of the systems that `[[system]]` names.

use std::ops::Range;

use diagnostics::{Error, Mistakes, Source, TextFile};
use toml::Spanned;
use toml::de::DeTable;

use super::subsystem::label;
use super::system::{self, Imparted, Role, Stepping};
use super::{Algorithm, Imported};

/// An entry of `[[system]]`.
struct Entry {
    name: String,
    /// Whether the scenario gives the name.
    named: bool,
    /// The place of the name, or else that of the path.
    place: Range<usize>,
    path: Spanned<String>,
    variant: Option<Spanned<String>>,
    unconnected: bool,
}

/// A node of the scenario or of a system.
struct Node {
    name: String,
    place: Range<usize>,
    /// The system that it is a part of.
    system: Option<String>,
    /// Whether it is an FMU, and whether its words name the archive or package.
    fmu: Option<bool>,
}

/// What the scenario says of its run, each with the place where it says so.
struct Setting {
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
pub(super) fn texts(source: &Source, table: &DeTable) -> Result<Vec<(TextFile, Imported)>, Error> {
    let mut setting = Setting::of(source, table);
    let (mut nodes, mut names, mut added) = (nodes(table), Vec::new(), Vec::new());
    let mut mistakes = Mistakes::default();
    for entry in tables(table, "system").filter_map(entry) {
        let free = name_is_free(source, &entry, &names, &nodes);
        names.push((entry.name.clone(), entry.named));
        let made = free.and_then(|()| imparted(source, &entry, &setting));
        let Some(mut made) = mistakes.take(made) else { continue };
        mistakes.take(nodes_are_free(source, &entry, &mut made, &mut nodes));
        made.imported.stepping = Some(setting.after(&entry, &made));
        added.push((made.file, made.imported));
    }
    mistakes.finish().map(|()| added)
}

/// The tables of a list at the top level.
fn tables<'t, 'a>(table: &'t DeTable<'a>, list: &str) -> impl Iterator<Item = &'t DeTable<'a>> {
    let list = table.get(list).and_then(|list| list.get_ref().as_array());
    list.into_iter().flatten().filter_map(|entry| entry.get_ref().as_table())
}

/// The text of a key, with its place.
fn text(table: &DeTable, key: &str) -> Option<Spanned<String>> {
    let value = table.get(key)?;
    Some(Spanned::new(value.span(), value.get_ref().as_str()?.to_owned()))
}

/// An entry with a path; the schema tells what else is wrong with one.
fn entry(table: &DeTable) -> Option<Entry> {
    let path = text(table, "path")?;
    let given = text(table, "name");
    let (named, place) = (given.is_some(), given.as_ref().unwrap_or(&path).span());
    let name = label(given.as_ref().map(|name| name.get_ref().as_str()), path.get_ref());
    let unconnected = text(table, "unconnected").is_some();
    Some(Entry { name, named, place, path, variant: text(table, "variant"), unconnected })
}

/// The nodes of the scenario itself.
fn nodes(table: &DeTable) -> Vec<Node> {
    let of = |list: &'static str| {
        tables(table, list).filter_map(move |entry| {
            let word = text(entry, "name")?;
            let place = word.span();
            let named = word.into_inner();
            // A signal is `node.variable`.
            let name = named.split('.').next().unwrap_or_default().to_owned();
            let comes = entry.contains_key("path") || entry.contains_key("crate");
            Some(Node { name, place, system: None, fmu: (list == "fmu").then_some(comes) })
        })
    };
    of("fmu").chain(of("signal")).chain(of("table")).collect()
}

fn name_is_free(
    source: &Source,
    entry: &Entry,
    names: &[(String, bool)],
    nodes: &[Node],
) -> Result<(), Error> {
    let Entry { name, named, place, .. } = entry;
    let wrong = |message: String| source.error(place.clone(), message, "");
    if name.is_empty() || name.contains(['.', '"', '\\']) {
        let message = format!("expected a name without `.`, `\"` and `\\`, found {name:?}");
        return Err(wrong(message));
    }
    if let Some((_, other)) = names.iter().find(|(known, _)| known == name) {
        let error = wrong(format!("there are two systems called `{name}`"));
        return Err(match *named && *other {
            true => error.help("give one of them another name"),
            false => error.help(format!(
                "without `name`, a system is called as its file: give this one a name, such as name = \"{name}_2\""
            )),
        });
    }
    match nodes.iter().find(|node| node.name == *name) {
        None => Ok(()),
        Some(Node { system: Some(system), .. }) => {
            let message = format!("`{name}` is a node of the system `{system}` already");
            Err(wrong(message).help("give the system another `name`"))
        }
        Some(_) => Err(wrong(format!("`{name}` is a node of the scenario already"))
            .help("give the system another `name`")),
    }
}

/// The text of an entry.
fn imparted(source: &Source, entry: &Entry, setting: &Setting) -> Result<Imparted, Error> {
    let Entry { name, path: word, variant, unconnected, .. } = entry;
    let path = source.folder(word.span()).join(word.get_ref());
    if path.exists() && !system::is_system(&path) {
        let message = format!("expected a system of SSP, found {}", path.display());
        return Err(source.error(word.span(), message, "").help(
            "a system is an .ssp archive, its folder or its .ssd file; `extends` takes a scenario, `[[fmu]]` an FMU",
        ));
    }
    let role = Role { name, unconnected: *unconnected, step: setting.step, stops: setting.stops };
    let chosen = variant.as_ref().map(|variant| variant.get_ref().as_str());
    system::imparted(&path, chosen, &role).map_err(|found| {
        let place = variant.as_ref().filter(|_| found.variant).unwrap_or(word).span();
        let message = format!("the system cannot be used: {}", found.error);
        source.error(place, message, "").hint(found.hint)
    })
}

/// Refuses nodes of a system whose names others have, and adds them to the others. An FMU of the scenario with the name of one
/// changes that one.
fn nodes_are_free(
    source: &Source,
    entry: &Entry,
    made: &mut Imparted,
    nodes: &mut Vec<Node>,
) -> Result<(), Error> {
    let mut mistakes = Mistakes::default();
    let system = &entry.name;
    for name in &made.nodes {
        match nodes.iter().find(|node| node.name == *name) {
            Some(Node { system: None, fmu: Some(false), .. }) | None => {}
            Some(Node { system: None, fmu: Some(true), place, .. }) => {
                let position = source.position(place.start);
                made.imported.notes.push(format!(
                    "{position}: `{name}` takes the place of the FMU of this name in the system `{system}`"
                ));
            }
            Some(Node { system: None, fmu: None, place, .. }) => {
                let message = format!("`{name}` is a node of the system `{system}` already");
                let error = source.error(place.clone(), message, "");
                mistakes.push(error.help("rename this one, or give the system another `name`"));
            }
            Some(Node { system: Some(other), .. }) => {
                let message = format!(
                    "the systems `{other}` and `{system}` would both have a node called `{name}`"
                );
                let error = source.error(entry.place.clone(), message, "");
                mistakes.push(error.help("give one of them another `name`"));
            }
        }
    }
    nodes.extend(made.nodes.iter().map(|name| Node {
        name: name.clone(),
        place: entry.place.clone(),
        system: Some(system.clone()),
        fmu: None,
    }));
    mistakes.finish()
}

impl Setting {
    fn of(source: &Source, table: &DeTable) -> Self {
        let at = |place: &Range<usize>| source.position(place.start);
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
        let algorithm = coupling.map(|(text, place)| {
            (text.trim_matches(['"', '\'']).to_owned(), format!(" of {place}"))
        });
        let times = match (&step, &stop) {
            (Some((step, place)), Some((stop, _))) => {
                Some(format!("the step {step} s and the stop time {stop} s of {place}"))
            }
            _ => None,
        };
        Setting {
            step: step.and_then(|(text, _)| number(&text)),
            stops: stop.is_some(),
            times,
            algorithm: algorithm.unwrap_or_else(|| {
                let default = Algorithm::default().word().to_owned();
                (default, ", since nothing says otherwise".to_owned())
            }),
        }
    }

    /// The note about the times and the algorithm that a system runs with; the first system may give the times of all.
    fn after(&mut self, Entry { name, .. }: &Entry, Imparted { times, .. }: &Imparted) -> Stepping {
        let (step, taken) = times;
        self.step = Some(*step);
        self.stops = true;
        let times = self.times.get_or_insert_with(|| taken.clone());
        let times = format!("the system `{name}` runs with {times}");
        Stepping::Part { times, algorithm: self.algorithm.clone() }
    }
}
