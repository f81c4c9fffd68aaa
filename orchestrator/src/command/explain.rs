//! `trackside explain`: prints type, unit, default, example and description of a key, or the reference of all keys.

use std::path::Path;

use clap::Args;
use diagnostics::Error;
use diagnostics::suggest::UnknownName;
use orchestrator::package::{self, BuildProgress};
use plugin::Plugin;
use scenario::{document, reference};

use super::print_text;
use super::progress::BuildLine;

/// Arguments of `trackside explain`.
#[derive(Args)]
pub struct ExplainArguments {
    /// The key: `connect.noise`, `[[connect]]`, or the end of its path, `noise`, when that is unique; all keys in Markdown
    /// without it.
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
    let (schema, title) = match &arguments.plugin {
        Some(plugin) => (config_schema(plugin)?, format!("Configuration of `{plugin}`")),
        None => (document::scenario_schema_value().clone(), "Scenario reference".to_owned()),
    };
    match &arguments.key {
        Some(key) => print_text(&reference::explain_key(&schema, key).map_err(UnknownName::into_error)?),
        None => print_text(&reference::schema_to_markdown(&schema, &title)),
    }
    Ok(0)
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
