//! `trackside explain`: prints type, unit, default, example and description of a key, or the reference of all keys.

use std::path::Path;

use clap::Args;
use diagnostics::Error;
use diagnostics::suggest::{UnknownName, join_shortened};
use orchestrator::package::{self, BuildProgress};
use plugin::Plugin;
use scenario::{document, reference};
use serde_json::Value;

use super::print_text;
use super::progress::BuildLine;

/// The plugin that comes with the program.
const PLUGIN: &str = "identify";

/// The schema of its configuration, so that nothing is built or loaded for an explanation; a test compares it with that of the code.
const IDENTIFICATION: &str = include_str!("../../../docs/reference/identify.schema.json");

/// Arguments of `trackside explain`.
#[derive(Args)]
pub struct ExplainArguments {
    /// The key: `connect.noise`, `[[connect]]`, or the end of its path, `noise`, when that is unique; also of the configuration of
    /// `identify`; all keys of scenarios in Markdown without it.
    key: Option<String>,
    /// Explain a key of the configuration of this plugin: a library, or a package of the workspace.
    #[arg(long, value_name = "PATH|CRATE")]
    plugin: Option<String>,
}

/// Prints the entry of the reference.
///
/// # Errors
/// When no key is called so, or several are; when the plugin cannot be loaded or does not describe its configuration.
pub fn run_explain_command(arguments: &ExplainArguments) -> Result<u8, Error> {
    let scenario = document::scenario_schema_value();
    let text = match (&arguments.plugin, &arguments.key) {
        (Some(plugin), key) => {
            let schema = config_schema(plugin)?;
            match key {
                Some(key) => reference::explain_key(&schema, key).map_err(UnknownName::into_error)?,
                None => reference::schema_to_markdown(&schema, &format!("Configuration of `{plugin}`")),
            }
        }
        (None, None) => reference::schema_to_markdown(scenario, "Scenario reference"),
        (None, Some(key)) => {
            let config: Value = serde_json::from_str(IDENTIFICATION).unwrap_or_default();
            explain_anywhere(scenario, &config, key).map_err(UnknownName::into_error)?
        }
    };
    print_text(&text);
    Ok(0)
}

/// The key of a scenario, or of the configuration of the plugin that came with the program, whichever has one that is called so.
fn explain_anywhere(scenario: &Value, config: &Value, key: &str) -> Result<String, UnknownName> {
    let below = key.trim().trim_start_matches("analysis.config.");
    let of_scenario = reference::matching_paths(scenario, key);
    let of_plugin = reference::matching_paths(config, below);
    match (of_scenario.as_slice(), of_plugin.as_slice()) {
        ([_], []) => reference::explain_key(scenario, key),
        ([_], _) => {
            let note = format!(
                "\nAlso a key of [analysis.config] of `{PLUGIN}`: trackside explain --plugin {PLUGIN} {below}\n"
            );
            Ok(reference::explain_key(scenario, key)? + &note)
        }
        ([], [_]) => {
            let text = reference::explain_key(config, below)?;
            Ok(format!("In [analysis.config] of an [[analysis]] by the plugin `{PLUGIN}`:\n\n{text}"))
        }
        ([], []) => {
            let unknown = reference::explain_key(scenario, key);
            let is_close =
                |it: &UnknownName| it.help.as_ref().is_some_and(|help| help.starts_with("did you mean"));
            match reference::explain_key(config, below) {
                Err(close) if is_close(&close) && unknown.as_ref().is_err_and(|it| !is_close(it)) => {
                    Err(close)
                }
                _ => unknown,
            }
        }
        (scenario_paths, plugin_paths) => {
            let own = scenario_paths.iter().cloned();
            let others = plugin_paths.iter().map(|path| format!("{path} (of `{PLUGIN}`)"));
            let paths: Vec<_> = own.chain(others).collect();
            let help = Some(format!("known: {}", join_shortened(&paths)));
            Err(UnknownName {
                message: format!("several keys are called `{below}`"),
                help,
                name: below.to_owned(),
            })
        }
    }
}

/// The JSON schema of the configuration of a plugin.
pub(super) fn config_schema(name: &str) -> Result<serde_json::Value, Error> {
    let wrong = |what: String| Error::invalid_input(format!("--plugin {name}: {what}"));
    let path = match Path::new(name) {
        path if path.is_file() => path.to_owned(),
        _ => {
            let mut building = BuildLine::default();
            let mut progress = |progress: BuildProgress| building.show(&progress);
            let library = package::build_or_find_library(name, &[Path::new(".")], &mut progress);
            library.map_err(|error| wrong(error.to_string()))?
        }
    };
    let path = std::path::absolute(&path).unwrap_or(path);
    let plugin = Plugin::load(&path).map_err(|error| wrong(error.to_string()))?;
    let schema = plugin
        .config_schema()
        .ok_or_else(|| wrong("the plugin does not describe its configuration".to_owned()))?;
    let schema =
        serde_json::from_str(schema).map_err(|error| wrong(format!("its schema is no JSON: {error}")))?;
    Ok(scenario::schema::normalize_schema(&schema))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_of_the_plugin_is_found_without_its_name() {
        let config: Value = serde_json::from_str(IDENTIFICATION).expect("JSON");
        let explain = |key: &str| match explain_anywhere(document::scenario_schema_value(), &config, key) {
            Ok(text) => text,
            Err(unknown) => unknown.to_string(),
        };
        for (key, parts) in [
            ("axle_coupling", &["plugin `identify`", "axle_coupling: a number"][..]),
            ("analysis.config.lateral.bounds", &["plugin `identify`", "lateral.bounds"]),
            ("noise.std", &["connect.noise.std: a number"]),
            ("axle_couplin", &["did you mean `axle_coupling`?"]),
            ("conect.noise", &["did you mean `connect.noise`?"]),
            ("name", &["several keys are called `name`", "fmu.name"]),
        ] {
            let text = explain(key);
            for part in parts {
                assert!(text.contains(part), "{key}: {text}");
            }
        }
    }
}
