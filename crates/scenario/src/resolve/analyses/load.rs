//! Loads the plugin or the Python script of an analysis, with the signals that it wants.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use diagnostics::{Error, ErrorCollector, Spanned};
use fmu_import::call_plugin;
use isolation::Sandbox;
use plugin::{OwnedInputSignal, Plugin};

use crate::build_request::BuildRequest;
use crate::document::{Analysis, Scenario, SignalAliases};
use crate::plan::{Analyser, SANDBOX_HINT, load_script_in_sandbox};
use crate::resolve::IsolationPolicy;
use crate::resolve::isolation::existing_path;

/// Who does an analysis, and what it wants.
pub(super) struct LoadedAnalyser {
    pub analyser: Analyser,
    /// The library or the script.
    pub path: PathBuf,
    pub needs: Vec<OwnedInputSignal>,
}

impl LoadedAnalyser {
    /// The plugin, if it is one.
    pub fn as_plugin(&self) -> Option<&Plugin> {
        match &self.analyser {
            Analyser::Plugin(plugin) => Some(plugin),
            Analyser::Python(_) | Analyser::Manoeuvre(_) => None,
        }
    }
}

/// The sandbox of a script, which may read its own file besides what the scenario allows; none of a script that does what the user may.
///
/// # Errors
/// When the keys of it are wrong, or stand beside a plugin.
pub(super) fn analysis_sandbox(
    scenario: &Scenario,
    analysis: &Analysis,
    policy: IsolationPolicy,
) -> Result<Option<Sandbox>, Error> {
    let written = analysis.isolate.as_ref().map(|word| *word.get_ref());
    let Some(script) = &analysis.python else {
        let words = analysis.isolate.iter().filter(|word| *word.get_ref()).map(Spanned::span);
        return match words.chain(analysis.may_read.iter().map(Spanned::span)).next() {
            None => Ok(None),
            Some(span) => {
                let message = "expected a Python script to isolate: a plugin runs in this process";
                Err(scenario.source.error_at(span, message, ""))
            }
        };
    };
    if let Some(word) = analysis.may_read.first().filter(|_| written != Some(true)) {
        let message = "`may_read` is for a script in a sandbox";
        return Err(scenario.error_at(word, message).with_help("add `isolate = true`"));
    }
    if !written.unwrap_or(policy == IsolationPolicy::Everything) {
        return Ok(None);
    }
    let may_read = analysis.may_read.iter().map(|word| existing_path(scenario, word));
    let mut read = ErrorCollector::collect_all(may_read)?;
    read.push(absolute_path(&scenario.source.resolve_path(script)));
    Ok(Some(Sandbox { read, ..Sandbox::default() }))
}

pub(super) fn load_analyser(
    scenario: &Scenario,
    analysis: &Analysis,
    plugins: &BTreeMap<BuildRequest, PathBuf>,
    aliases: Option<&SignalAliases>,
    sandbox: Option<&Sandbox>,
) -> Result<LoadedAnalyser, Error> {
    let (word, path) = match (&analysis.path, &analysis.package, analysis.build_request()) {
        (None, None, _) if analysis.example.is_none() && analysis.python.is_some() => {
            let word = analysis.python.as_ref().ok_or_else(Error::already_reported)?;
            return load_script(scenario, analysis, aliases, word, sandbox);
        }
        _ if analysis.python.is_some() => return Err(ambiguous_analyser_error(scenario, analysis)),
        (Some(path), None, _) if analysis.example.is_none() => (path, scenario.source.resolve_path(path)),
        (None, Some(package), Some(product)) => match plugins.get(&product) {
            Some(path) => (package, path.clone()),
            // Whoever builds it has told why there is none.
            None => return Err(Error::already_reported()),
        },
        _ => return Err(ambiguous_analyser_error(scenario, analysis)),
    };
    let path = absolute_path(&path);
    let who = format!("the plugin {}", path.display());
    let loaded = call_plugin(&who, c"loading its library", || Plugin::load(&path));
    let plugin = loaded.map_err(|error| scenario.error_at(word, error.to_string()))?;
    let needs = plugin.input_signals().to_vec();
    Ok(LoadedAnalyser { analyser: Analyser::Plugin(plugin), path, needs })
}

fn ambiguous_analyser_error(scenario: &Scenario, analysis: &Analysis) -> Error {
    let name = analysis.name.get_ref();
    let message = format!(
        "the analysis `{name}` needs either `path` or `crate` or `python`, and `example` goes with `crate`"
    );
    scenario.error_at(&analysis.name, message)
}

/// A path without a folder would be looked up among the libraries of the system.
fn absolute_path(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Loads a script, which takes the signals that it lists, or any.
fn load_script(
    scenario: &Scenario,
    analysis: &Analysis,
    aliases: Option<&SignalAliases>,
    word: &Spanned<String>,
    sandbox: Option<&Sandbox>,
) -> Result<LoadedAnalyser, Error> {
    let path = absolute_path(&scenario.source.resolve_path(word));
    if !path.is_file() {
        let message = format!("expected a Python script, and {} is no file", path.display());
        return Err(scenario.error_at(word, message));
    }
    let loaded = load_script_in_sandbox(&path, sandbox).map_err(|failure| {
        let error = scenario.error_at(word, format!("the script does not load: {failure}"));
        error.with_help(match sandbox {
            Some(_) => SANDBOX_HINT,
            None => "another Python is named by the environment variable TRACKSIDE_PYTHON",
        })
    })?;
    let need = |name: &str, unit: &str, required| OwnedInputSignal {
        name: name.to_owned(),
        unit: unit.to_owned(),
        description: "the script lists it in `signals`".to_owned(),
        required,
    };
    let needs = match loaded.requested_units() {
        Some(units) => units.iter().map(|(name, unit)| need(name, unit, true)).collect(),
        None => {
            let columns = analysis.table.iter().flat_map(|table| table.columns.keys());
            let aliases = aliases.into_iter().flat_map(SignalAliases::alias_names);
            let aliases = aliases.filter(|name| name.get_ref() != "time");
            let given = analysis.signals.keys().chain(columns).chain(aliases);
            let given: BTreeSet<&String> = given.map(Spanned::get_ref).collect();
            given.into_iter().map(|name| need(name, "", false)).collect()
        }
    };
    Ok(LoadedAnalyser { analyser: Analyser::Python(Mutex::new(Some(loaded))), path, needs })
}
