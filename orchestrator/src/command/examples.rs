//! `trackside examples`: lists the scenarios that came with the program, or copies one with all that it needs.

use std::path::PathBuf;

use clap::Args;
use diagnostics::Error;
use orchestrator::examples::ExampleFolder;

use super::print_text;

/// Arguments of `trackside examples`.
#[derive(Args)]
pub struct ExamplesArguments {
    /// The scenario that is copied, with all files that it needs; a list of all without it.
    name: Option<String>,
    /// The folder that it is copied into.
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    out: PathBuf,
}

/// Lists or copies.
///
/// # Errors
/// When no scenarios came with the program, none is called so, or a file is there already.
pub fn run_examples_command(arguments: &ExamplesArguments) -> Result<u8, Error> {
    let folder = ExampleFolder::of_current_program()?;
    let Some(name) = &arguments.name else {
        let examples = folder.list_examples()?;
        let width = examples.keys().map(String::len).max().unwrap_or(0);
        let lines = examples.values().map(|it| format!("{:width$}  {}\n", it.name, it.title));
        print_text(&lines.collect::<String>());
        print_text(
            "\n`trackside examples NAME` copies one with all that it needs into the current folder.\n",
        );
        return Ok(0);
    };
    let copied = folder.copy_example(&folder.find_example(name)?, &arguments.out)?;
    let lines = copied.iter().map(|path| path.strip_prefix(".").unwrap_or(path).display().to_string() + "\n");
    print_text(&lines.collect::<String>());
    let first = copied.first().map(|path| path.strip_prefix(".").unwrap_or(path).display().to_string());
    print_text(&format!("\ntrackside run {}\n", first.unwrap_or_default()));
    Ok(0)
}
