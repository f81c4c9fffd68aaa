//! Reads start values that do not stand in the scenario: `node.variable=value`, or a file of them.

use std::ops::Range;
use std::path::{Path, PathBuf};

use diagnostics::{Error, Source};

use super::starts::flatten;

/// A start value from the command line, or from the scenario that this one validates.
#[derive(Debug, Clone)]
pub struct StartOverride {
    /// The node.
    pub node: String,
    /// Its variable.
    pub variable: String,
    /// The value as typed.
    pub value: String,
    /// Its place in a scenario; none when the command line gives it.
    pub place: Option<(Source, Range<usize>)>,
}

impl StartOverride {
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
        let (node, variable, value) = (node.to_owned(), variable.to_owned(), value.to_owned());
        Ok(vec![StartOverride { node, variable, value, place: None }])
    }

    /// As it is written on the command line.
    pub(super) fn text(&self) -> String {
        format!("{}.{}={}", self.node, self.variable, self.value)
    }

    pub(super) fn error(&self, message: &str) -> Error {
        let StartOverride { node, variable, .. } = self;
        match &self.place {
            Some((source, place)) => {
                source.error(place.clone(), format!("{node}.{variable}: {message}"), "")
            }
            None => Error::input(format!("--set {node}.{variable}: {message}")),
        }
    }
}

/// Start values from a TOML file with a table for each node, or with keys `"node.variable"`, such as an
/// identification writes.
fn read(path: &Path) -> Result<Vec<StartOverride>, String> {
    let wrong = |what: String| format!("{}: {what}", path.display());
    let text = std::fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
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
            let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            starts.push(StartOverride { node, variable, value, place: None });
            Ok(())
        })?;
    }
    Ok(starts)
}
