//! `trackside schema`: prints the JSON schema of scenario files.

use diagnostics::Error;
use scenario::reference;

use super::print;

/// Prints the schema.
///
/// # Errors
/// None today.
pub fn run() -> Result<u8, Error> {
    print(&reference::scenario_schema());
    Ok(0)
}
