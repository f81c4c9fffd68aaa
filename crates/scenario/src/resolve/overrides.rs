//! Parses and applies values from outside the scenario: `--set node.variable=value`, or a file of them.

use std::path::{Path, PathBuf};

use cosim::system::SourceLocation;
use diagnostics::suggest::{self, UnknownName};
use diagnostics::{Error, ErrorCollector};
use serde::{Deserialize, Serialize};

use super::Overrides;
use super::dotted_keys::flatten_dotted_keys;
use crate::document::{EditError, Scenario, ScenarioEdit};
use crate::override_value::OverrideValue;
use crate::text_of;

/// The most letters of a value that reports repeat: the text of a file is longer.
const LONGEST: usize = 400;

/// A value from the command line, from a sweep, or from the scenario that this one validates: a start value, or a word about a signal, a
/// sensor effect or a fault.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Override {
    /// What it sets: `plant.body.m`, `driver.delta.step.after`. Its first part is the node.
    pub name: String,
    /// The value.
    pub value: OverrideValue,
    /// Its place in a scenario; none when the command line gives it.
    #[serde(skip)]
    pub place: Option<SourceLocation>,
}

impl Override {
    /// A value that the command line or a sweep gives.
    #[must_use]
    pub fn new(name: impl Into<String>, value: OverrideValue) -> Self {
        Override { name: name.into(), value, place: None }
    }

    /// Reads `node.variable=value`, or the file of `@FILE`; `find` turns the name of a file into its path.
    ///
    /// # Errors
    /// In words, when it has another form, or the file cannot be read.
    pub fn parse(entry: &str, find: impl Fn(&str) -> PathBuf) -> Result<Vec<Self>, String> {
        if let Some(file) = entry.strip_prefix('@') {
            return read_file(&find(file));
        }
        match entry.split_once('=') {
            Some((name, value)) if name.contains('.') => {
                Ok(vec![Override::new(name, OverrideValue::parse(value)).with_paths(find)])
            }
            _ => Err(malformed_override_message(entry)),
        }
    }

    /// With the paths of archives and of texts as `find` gives them: they lie where their giver is, not where the scenario is.
    #[must_use]
    pub fn with_paths(self, find: impl Fn(&str) -> PathBuf) -> Self {
        let absolute = |file: &str| std::path::absolute(find(file)).ok();
        let is_archive = self.variable_name() == "path";
        let value = match &self.value {
            OverrideValue::TextOf(file) => file.to_str().and_then(absolute).map(OverrideValue::TextOf),
            OverrideValue::Typed(file) if is_archive && file.ends_with(".fmu") => {
                absolute(file).map(|path| OverrideValue::Typed(path.to_string_lossy().into_owned()))
            }
            _ => None,
        };
        match value {
            Some(value) => Override { value, ..self },
            None => self,
        }
    }

    /// The node that it is about.
    #[must_use]
    pub fn node_name(&self) -> &str {
        self.name.split_once('.').map_or(&self.name, |(node, _)| node)
    }

    /// What it sets of the node: a variable, or keys of a word.
    #[must_use]
    pub fn variable_name(&self) -> &str {
        self.name.split_once('.').map_or("", |(_, variable)| variable)
    }

    /// As it is written on the command line; of a long text, its beginning.
    pub(super) fn command_line_text(&self) -> String {
        let text = self.value.to_string();
        let value: String = text.chars().take(LONGEST).collect();
        let more = if value.len() < text.len() { "..." } else { "" };
        format!("{}={value}{more}", self.name)
    }

    pub(super) fn override_error(&self, message: &str) -> Error {
        let name = &self.name;
        match &self.place {
            Some((source, place)) => source.error_at(place.clone(), format!("{name}: {message}"), ""),
            None => Error::invalid_input(format!("--set {name}: {message}")),
        }
    }
}

/// The error of an entry that is none.
fn malformed_override_message(entry: &str) -> String {
    format!("expected node.variable=value or @FILE, found `{entry}`")
}

/// The name of the seed among the names that vary in a sweep.
pub const SEED: &str = "seed";

impl Overrides {
    /// These overrides with those of a variant of a sweep behind them, among which [`SEED`] is the seed. Files lie in `folder`.
    ///
    /// # Errors
    /// In words, when a value has no form that a scenario takes.
    pub fn with_variant(&self, variant: &[Override], folder: &Path) -> Result<Self, String> {
        let mut overrides = self.clone();
        for value in variant {
            if value.name == SEED {
                let seed = value.value.to_string();
                overrides.seed = Some(
                    seed.parse()
                        .map_err(|_| format!("seed: expected a whole number from 0 on, found {seed}"))?,
                );
            } else if value.name.contains('.') {
                overrides.starts.push(value.clone().with_paths(|file| folder.join(file)));
            } else {
                return Err(malformed_override_message(&format!("{}={}", value.name, value.value)));
            }
        }
        Ok(overrides)
    }
}

/// The scenario with the entries that these values change, and the start values among them; no scenario when it stays as it is.
pub(super) fn apply_overrides(
    scenario: &Scenario,
    overrides: &Overrides,
    mistakes: &mut ErrorCollector,
) -> (Option<Scenario>, Overrides) {
    let is_edit = |entry: &Override| {
        let is_archive =
            matches!(&entry.value, OverrideValue::Typed(path) if scenario.is_archive(&entry.name, path));
        is_archive || scenario.is_editable_name(&entry.name)
    };
    let (edited, starts): (Vec<_>, Vec<_>) = overrides.starts.iter().cloned().partition(is_edit);
    let rest = Overrides { starts, ..overrides.clone() };
    if edited.is_empty() && overrides.coupling.is_none() {
        return (None, rest);
    }
    let edit = |entry: &Override| ScenarioEdit { name: entry.name.clone(), value: entry.value.clone() };
    let edits: Vec<_> = edited.iter().map(edit).collect();
    let mut changed = scenario.with_edits(&edits).map_err(|errors| {
        let located =
            |it: EditError| edited[it.index].override_error(&it.message).with_optional_help(it.help);
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
    let foreign = overrides.all_start_values().filter(|entry| !fmus.contains(&entry.node_name()));
    let errors = foreign.map(|entry| {
        let sources = signals.iter().filter_map(|name| Some(name.split_once('.')?.0));
        let UnknownName { message, help, .. } = if tables.contains(&entry.node_name()) {
            return entry.override_error(&format!(
                "`{}` is a table, which has its values from its file",
                entry.node_name()
            ));
        } else if sources.clone().any(|node| node == entry.node_name()) {
            suggest::unknown_name("signal", &entry.name, signals.iter().copied())
        } else {
            suggest::unknown_name("node", entry.node_name(), fmus.iter().copied().chain(sources))
        };
        entry.override_error(&message).with_optional_help(help)
    });
    errors.collect::<ErrorCollector>().into_result()
}

/// The largest file with start values [B].
const LARGEST: u64 = 64 << 20;

/// Start values from a TOML file with a table for each node, or with keys `"node.variable"`, such as an
/// identification writes.
fn read_file(path: &Path) -> Result<Vec<Override>, String> {
    let wrong = |what: String| format!("{}: {what}", path.display());
    let text = diagnostics::read_text_bounded(path, LARGEST).map_err(|error| wrong(error.to_string()))?;
    let tables: toml::Table = toml::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    let mut starts = Vec::new();
    for (name, value) in &tables {
        flatten_dotted_keys(name, value, &mut |name, value| {
            if !name.contains('.') {
                let found = value.type_str();
                return Err(wrong(format!(
                    "expected a table [{name}] or a key `{name}.variable`, found {found}"
                )));
            }
            let beside =
                |file: &str| std::path::absolute(path.parent().unwrap_or(Path::new("")).join(file)).ok();
            let value = match (text_of::text_file_path(value).and_then(beside), value) {
                (Some(path), _) => OverrideValue::TextOf(path),
                // A quoted number is a number here, as on the command line.
                (None, toml::Value::String(text)) => OverrideValue::parse(text),
                (None, value) => OverrideValue::Toml(value.clone()),
            };
            starts.push(Override::new(name, value));
            Ok(())
        })?;
    }
    Ok(starts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_a_name_and_a_value() {
        let parsed = Override::parse("plant.body.m=800 kg", |file| file.into()).expect("an entry");
        let [mass] = parsed.as_slice() else { panic!("{parsed:?}") };
        assert_eq!((mass.node_name(), mass.variable_name()), ("plant", "body.m"));
        assert_eq!(mass.value, OverrideValue::Typed("800 kg".to_owned()));
        for entry in ["plant.body.m", "mass=3", ""] {
            let message = Override::parse(entry, |file| file.into()).expect_err("no entry");
            assert_eq!(message, format!("expected node.variable=value or @FILE, found `{entry}`"));
        }
    }

    #[test]
    fn files_of_values_lie_where_their_giver_is() {
        let find = |file: &str| Path::new("/variants").join(file);
        let text = Override::new("tire.data", OverrideValue::TextOf("front.tir".into()));
        assert_eq!(text.with_paths(find).value, OverrideValue::TextOf("/variants/front.tir".into()));
        let archive = Override::new("plant.path", OverrideValue::Typed("fast.fmu".to_owned()));
        let path = OverrideValue::Typed("/variants/fast.fmu".to_owned());
        assert_eq!(archive.with_paths(find).value, path);
        let other = Override::new("plant.name", OverrideValue::Typed("fast.fmu".to_owned()));
        assert_eq!(other.clone().with_paths(find).value, other.value);
    }

    #[test]
    fn a_variant_adds_start_values_and_the_seed() {
        let all = Overrides { seed: Some(1), ..Overrides::default() };
        let mass = OverrideValue::Number { value: 0.1 + 0.2, unit: Some("t".to_owned()) };
        let seed = Override::new(SEED, OverrideValue::Integer(7));
        let variant = [Override::new("plant.m", mass.clone()), seed];
        let overrides = all.with_variant(&variant, Path::new("")).expect("a variant");
        assert_eq!(overrides.seed, Some(7));
        assert_eq!(overrides.starts[0].value, mass);
        let wrong = [
            (SEED, OverrideValue::Integer(-1), "seed: expected a whole number from 0 on, found -1"),
            ("mass", OverrideValue::Integer(3), "expected node.variable=value or @FILE, found `mass=3`"),
        ];
        for (name, value, expected) in wrong {
            let message = all.with_variant(&[Override::new(name, value)], Path::new(""));
            assert_eq!(message.expect_err("no variant"), expected);
        }
    }
}
