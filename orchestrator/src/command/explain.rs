//! `trackside explain`: prints type, unit, default, example and description of a key.

use clap::Args;
use diagnostics::Error;
use diagnostics::suggest::Unknown;
use scenario::{reference, words};

use super::print;

/// Arguments of `trackside explain`.
#[derive(Args)]
pub struct Arguments {
    /// The key: `connect.noise`, `[[connect]]`, or the end of its path, `noise`, when that is unique.
    key: String,
}

/// Prints the entry of the reference.
///
/// # Errors
/// When no key is called so, or several are.
pub fn run(arguments: &Arguments) -> Result<u8, Error> {
    let entry = reference::explain(words::schema(), &arguments.key).map_err(Unknown::input)?;
    print(&entry);
    Ok(0)
}
