//! `trackside explain`: lists the tables of a scenario, explains a key with type, unit, default and example, or prints the whole reference.

use std::path::Path;

use clap::Args;
use diagnostics::Error;
use diagnostics::suggest::UnknownName;
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
    /// The key: `connect.noise`, `[[connect]]`, or the end of its path, `noise`; also of the configuration of `identify`; a list of the
    /// tables without it.
    key: Option<String>,
    /// Print the whole reference in Markdown.
    #[arg(long, conflicts_with = "key")]
    all: bool,
    /// Explain a key of the configuration of this plugin: a library, or a package of the workspace.
    #[arg(long, value_name = "PATH|CRATE")]
    plugin: Option<String>,
}

/// Prints the entry of the reference.
///
/// # Errors
/// When no key is called so, or too many are; when the plugin cannot be loaded or does not describe its configuration.
pub fn run_explain_command(arguments: &ExplainArguments) -> Result<u8, Error> {
    let scenario = document::scenario_schema_value();
    let identification = || serde_json::from_str::<Value>(IDENTIFICATION).unwrap_or_default();
    let text = match (&arguments.plugin, &arguments.key) {
        (Some(plugin), key) => {
            let schema = config_schema(plugin)?;
            match key {
                Some(key) => reference::explain_key(&schema, key).map_err(UnknownName::into_error)?,
                None if arguments.all => {
                    reference::schema_to_markdown(&schema, &format!("Configuration of `{plugin}`"))
                }
                None => plugin_keys(plugin, &schema),
            }
        }
        (None, None) if arguments.all => reference::schema_to_markdown(scenario, "Scenario reference"),
        (None, None) => format!(
            "Keys of a scenario:\n{}\n`trackside explain KEY` explains a key or the keys of a table, `trackside explain {PLUGIN}` lists \
             those of the\nidentification, `trackside explain --all` prints all in Markdown.\n",
            reference::list_top_keys(scenario)
        ),
        (None, Some(key)) if key == PLUGIN => plugin_keys(PLUGIN, &identification()),
        (None, Some(key)) => {
            explain_anywhere(scenario, &identification(), key).map_err(UnknownName::into_error)?
        }
    };
    print_text(&text);
    Ok(0)
}

/// The keys of the configuration of a plugin, a line for each.
fn plugin_keys(plugin: &str, schema: &Value) -> String {
    format!(
        "Keys of [analysis.config] of an [[analysis]] by the plugin `{plugin}`:\n{}\n`trackside explain --plugin {plugin} KEY` explains one, \
         `trackside explain --plugin {plugin} --all` prints all in Markdown.\n",
        reference::list_top_keys(schema)
    )
}

/// The key of a scenario, and of the configuration of the plugin that came with the program.
fn explain_anywhere(scenario: &Value, config: &Value, key: &str) -> Result<String, UnknownName> {
    let below = key.trim().trim_start_matches("analysis.config.");
    let of_scenario = reference::matching_paths(scenario, key);
    let of_plugin = reference::matching_paths(config, below);
    let explain_plugin_key = || {
        let text = reference::explain_key(config, below)?;
        Ok(format!("In [analysis.config] of an [[analysis]] by the plugin `{PLUGIN}`:\n\n{text}"))
    };
    match (of_scenario.len(), of_plugin.len()) {
        (0, 0) => Err(closest_unknown_key(scenario, config, key)),
        (_, 0) => reference::explain_key(scenario, key),
        (0, _) => explain_plugin_key(),
        (own, others) if own + others <= reference::MOST_EXPLAINED => {
            Ok(reference::explain_key(scenario, key)? + "\n" + &explain_plugin_key()?)
        }
        _ => {
            let others = of_plugin.iter().map(|path| format!("{path} (of `{PLUGIN}`)"));
            let paths: Vec<_> = of_scenario.into_iter().chain(others).collect();
            Err(reference::ambiguous_key(below, &paths))
        }
    }
}

/// What is said of a key that neither has: the better of the two suggestions.
fn closest_unknown_key(scenario: &Value, config: &Value, key: &str) -> UnknownName {
    let is_close = |it: &UnknownName| it.help.as_ref().is_some_and(|help| help.starts_with("did you mean"));
    let own = reference::unknown_key(scenario, key);
    let other = reference::unknown_key(config, key.trim().trim_start_matches("analysis.config."));
    if is_close(&other) && !is_close(&own) { other } else { own }
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
            ("name", &["keys are called `name`", "fmu.name"]),
        ] {
            let text = explain(key);
            for part in parts {
                assert!(text.contains(part), "{key}: {text}");
            }
        }
    }
}
