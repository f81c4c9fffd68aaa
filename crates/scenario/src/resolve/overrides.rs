//! Reads values that do not stand in the scenario: `node.variable=value`, or a file of them.

use std::path::{Path, PathBuf};

use diagnostics::suggest::{self, UnknownName};
use diagnostics::{Error, Mistakes};

use super::Overrides;
use super::starts::flatten;
use crate::plan::WordPlace;
use crate::text_of;
use crate::words::{Change, Misfit, Scenario};

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
            return read(&find(file));
        }
        let parts =
            entry.split_once('=').and_then(|(name, value)| Some((name.split_once('.')?, value)));
        let Some(((node, variable), value)) = parts else {
            return Err(format!("expected node.variable=value or @FILE, found `{entry}`"));
        };
        // An archive, or a file whose text is a value, lies where its giver is, not where the scenario is.
        let is_archive = variable == "path" && value.ends_with(".fmu");
        let absolute = |file: &str| std::path::absolute(find(file)).ok();
        let value = match value.parse::<toml::Value>().ok().as_ref().and_then(text_of::file) {
            Some(file) => absolute(file).map(|path| text_of::typed(&path)),
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

/// The scenario with the words that these values change, and the start values among them; no scenario when it stays as it is.
pub(super) fn apply(
    scenario: &Scenario,
    overrides: &Overrides,
    mistakes: &mut Mistakes,
) -> (Option<Scenario>, Overrides) {
    let is_word = |given: &Override| {
        let name = given.name();
        scenario.has_word(&name) || scenario.is_archive(&name, &given.value)
    };
    let (words, starts): (Vec<_>, Vec<_>) = overrides.starts.iter().cloned().partition(is_word);
    let rest = Overrides { starts, ..overrides.clone() };
    if words.is_empty() && overrides.coupling.is_none() {
        return (None, rest);
    }
    let change = |given: &Override| Change { name: given.name(), value: given.value.clone() };
    let changes: Vec<_> = words.iter().map(change).collect();
    let mut changed = scenario.changed(&changes).map_err(|misfits| {
        let told = |it: Misfit| words[it.place].error(&it.message).hint(it.help);
        misfits.into_iter().for_each(|misfit| mistakes.push(told(misfit)));
    });
    if let (Ok(changed), Some(algorithm)) = (&mut changed, overrides.coupling) {
        changed.document.coupling.algorithm = algorithm;
    }
    (changed.ok(), rest)
}

/// Finds the values of nodes that are no FMUs, and of no word of the scenario.
pub(super) fn check_nodes(scenario: &Scenario, overrides: &Overrides) -> Result<(), Error> {
    let document = &scenario.document;
    let fmus: Vec<_> = document.fmu.iter().map(|fmu| fmu.name.get_ref().as_str()).collect();
    let signals: Vec<_> =
        document.signal.iter().filter_map(|part| part.get_ref().name.as_ref()).collect();
    let signals: Vec<_> = signals.into_iter().map(|name| name.get_ref().as_str()).collect();
    let tables: Vec<_> = document.table.iter().map(|table| table.name.get_ref().as_str()).collect();
    let foreign = overrides.all().filter(|given| !fmus.contains(&given.node.as_str()));
    let errors = foreign.map(|given| {
        let sources = signals.iter().filter_map(|name| Some(name.split_once('.')?.0));
        let UnknownName { message, help, .. } = if tables.contains(&given.node.as_str()) {
            return given.error(&format!(
                "`{}` is a table, which has its values from its file",
                given.node
            ));
        } else if sources.clone().any(|node| node == given.node) {
            suggest::unknown("signal", &given.name(), signals.iter().copied())
        } else {
            suggest::unknown("node", &given.node, fmus.iter().copied().chain(sources))
        };
        given.error(&message).hint(help)
    });
    errors.collect::<Mistakes>().finish()
}

/// The largest file with start values [B].
const LARGEST: u64 = 64 << 20;

/// Start values from a TOML file with a table for each node, or with keys `"node.variable"`, such as an
/// identification writes.
fn read(path: &Path) -> Result<Vec<Override>, String> {
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
            let text = text_of::file(value).and_then(beside).map(|path| text_of::typed(&path));
            let text = text.or_else(|| value.as_str().map(str::to_owned));
            let value = text.unwrap_or_else(|| value.to_string());
            starts.push(Override { node, variable, value, place: None });
            Ok(())
        })?;
    }
    Ok(starts)
}
