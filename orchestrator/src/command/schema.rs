//! `trackside schema`: prints the JSON schema of scenario files, or of the configuration of a plugin.

use clap::Args;
use diagnostics::Error;
use scenario::reference;

use super::explain::config_schema;
use super::print_text;

/// Arguments of `trackside schema`.
#[derive(Args)]
pub struct SchemaArguments {
    /// Print the schema of the configuration of this plugin: a library, or a package of the workspace.
    #[arg(long, value_name = "PATH|CRATE")]
    plugin: Option<String>,
}

/// Prints the schema.
///
/// # Errors
/// When the plugin cannot be loaded or does not describe its configuration.
pub fn run_schema_command(arguments: &SchemaArguments) -> Result<u8, Error> {
    match &arguments.plugin {
        Some(plugin) => print_text(&reference::format_schema(&config_schema(plugin)?)),
        None => print_text(&reference::editor_schema_text()),
    }
    Ok(0)
}
