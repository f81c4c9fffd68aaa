//! Parses and applies values from outside the scenario: `--set node.variable=value`, or a file of them.

use std::path::{Path, PathBuf};

use diagnostics::suggest::{self, Unknown};
use diagnostics::{Error, Mistakes};

use super::Overrides;
use super::starts::flatten;
use crate::document::{Edit, EditError, Scenario};
use crate::plan::WordPlace;
use crate::text_of;

/// The most letters of a value that reports repeat: the text of a file is longer.
const LONGEST: usize = 400;

/// A value from the command line, or from the scenario that this one validates: a start value, or a word about a signal, a
/// sensor effect or a fault.
#[derive(Debug, Clone)]
pub struct Override {
    /// The node.
    pub node: String,
    /// Its variable.
    pub variable: String,
    /// The value as typed.
    pub value: String,
    /// Its place in a scenario; none when the command line gives it.
    pub place: Option<WordPlace>,
}

impl Override {
    /// Reads `node.variable=value`, or the file of `@FILE`; `find` turns the name of the file into its path.
    ///
    /// # Errors
    /// In words, when it has another form, or the file cannot be read.
    pub fn parse(entry: &str, find: impl Fn(&str) -> PathBuf) -> Result<Vec<Self>, String> {
        if let Some(file) = entry.strip_prefix('@') {
            return read_file(&find(file));
        }
        let parts =
            entry.split_once('=').and_then(|(name, value)| Some((name.split_once('.')?, value)));
        let Some(((node, variable), value)) = parts else {
            return Err(format!("expected node.variable=value or @FILE, found `{entry}`"));
        };
        // An archive, or a file whose text is a value, lies where its giver is, not where the scenario is.
        let is_archive = variable == "path" && value.ends_with(".fmu");
        let absolute = |file: &str| std::path::absolute(find(file)).ok();
        let value = match value.parse::<toml::Value>().ok().as_ref().and_then(text_of::path_of) {
            Some(file) => absolute(file).map(|path| text_of::literal(&path)),
            None if is_archive => absolute(value).map(|path| path.to_string_lossy().into_owned()),
            None => None,
        }
        .unwrap_or_else(|| value.to_owned());
        let (node, variable) = (node.to_owned(), variable.to_owned());
        Ok(vec![Override { node, variable, value, place: None }])
    }

    /// As it is written on the command line; of a long text, its beginning.
    pub(super) fn text(&self) -> String {
        let value: String = self.value.chars().take(LONGEST).collect();
        let more = if value.len() < self.value.len() { "..." } else { "" };
        format!("{}={value}{more}", self.name())
    }

    fn name(&self) -> String {
        format!("{}.{}", self.node, self.variable)
    }

    pub(super) fn error(&self, message: &str) -> Error {
        let Override { node, variable, .. } = self;
        match &self.place {
            Some((source, place)) => {
                source.error(place.clone(), format!("{node}.{variable}: {message}"), "")
            }
            None => Error::input(format!("--set {node}.{variable}: {message}")),
        }
    }
}

/// The scenario with the entries that these values change, and the start values among them; no scenario when it stays as it is.
pub(super) fn apply(
    scenario: &Scenario,
    overrides: &Overrides,
    mistakes: &mut Mistakes,
) -> (Option<Scenario>, Overrides) {
    let is_edit = |entry: &Override| {
        let name = entry.name();
        scenario.has_target(&name) || scenario.is_archive(&name, &entry.value)
    };
    let (edited, starts): (Vec<_>, Vec<_>) = overrides.starts.iter().cloned().partition(is_edit);
    let rest = Overrides { starts, ..overrides.clone() };
    if edited.is_empty() && overrides.coupling.is_none() {
        return (None, rest);
    }
    let edit = |entry: &Override| Edit { name: entry.name(), value: entry.value.clone() };
    let edits: Vec<_> = edited.iter().map(edit).collect();
    let mut changed = scenario.with_edits(&edits).map_err(|errors| {
        let located = |it: EditError| edited[it.index].error(&it.message).hint(it.help);
        errors.into_iter().for_each(|error| mistakes.push(located(error)));
    });
    if let (Ok(changed), Some(algorithm)) = (&mut changed, overrides.coupling) {
        changed.document.coupling.algorithm = algorithm;
    }
    (changed.ok(), rest)
}

/// Finds the values of nodes that are no FMUs, and of nothing else in the scenario.
pub(super) fn check_node_names(scenario: &Scenario, overrides: &Overrides) -> Result<(), Error> {
    let document = &scenario.document;
    let fmus: Vec<_> = document.fmu.iter().map(|fmu| fmu.name.get_ref().as_str()).collect();
    let names = document.signal.iter().filter_map(|part| part.get_ref().name.as_ref());
    let signals: Vec<_> = names.map(|name| name.get_ref().as_str()).collect();
    let tables: Vec<_> = document.table.iter().map(|table| table.name.get_ref().as_str()).collect();
    let foreign = overrides.all().filter(|entry| !fmus.contains(&entry.node.as_str()));
    let errors = foreign.map(|entry| {
        let sources = signals.iter().filter_map(|name| Some(name.split_once('.')?.0));
        let Unknown { message, help, .. } = if tables.contains(&entry.node.as_str()) {
            return entry.error(&format!(
                "`{}` is a table, which has its values from its file",
                entry.node
            ));
        } else if sources.clone().any(|node| node == entry.node) {
            suggest::unknown("signal", &entry.name(), signals.iter().copied())
        } else {
            suggest::unknown("node", &entry.node, fmus.iter().copied().chain(sources))
        };
        entry.error(&message).hint(help)
    });
    errors.collect::<Mistakes>().finish()
}

/// The largest file with start values [B].
const LARGEST: u64 = 64 << 20;

/// Start values from a TOML file with a table for each node, or with keys `"node.variable"`, such as an
/// identification writes.
fn read_file(path: &Path) -> Result<Vec<Override>, String> {
    let wrong = |what: String| format!("{}: {what}", path.display());
    let text =
        diagnostics::read_text_bounded(path, LARGEST).map_err(|error| wrong(error.to_string()))?;
    let tables: toml::Table = toml::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    let mut starts = Vec::new();
    for (name, value) in &tables {
        flatten(name, value, &mut |name, value| {
            let Some((node, variable)) = name.split_once('.') else {
                let found = value.type_str();
                return Err(wrong(format!(
                    "expected a table [{name}] or a key `{name}.variable`, found {found}"
                )));
            };
            let (node, variable) = (node.to_owned(), variable.to_owned());
            let beside = |file: &str| {
                std::path::absolute(path.parent().unwrap_or(Path::new("")).join(file)).ok()
            };
            let text = text_of::path_of(value).and_then(beside).map(|path| text_of::literal(&path));
            let text = text.or_else(|| value.as_str().map(str::to_owned));
            let value = text.unwrap_or_else(|| value.to_string());
            starts.push(Override { node, variable, value, place: None });
            Ok(())
        })?;
    }
    Ok(starts)
}
