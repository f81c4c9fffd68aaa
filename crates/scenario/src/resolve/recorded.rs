//! Decides what is recorded.

use diagnostics::Error;
use recording::{Column, Columns, Full, Selection};

use crate::pattern::matches;
use crate::words::Scenario;

/// The variables that `[record]` does not except.
pub(super) fn selection(scenario: &Scenario, columns: &Columns<Full>) -> Result<Selection, Error> {
    let except = &scenario.document.record.except;
    for pattern in except {
        if !columns.iter().any(|column| matches(pattern.get_ref(), &column.name())) {
            let message = format!("nothing that is recorded is called `{}`", pattern.get_ref());
            return Err(scenario.error(pattern, message));
        }
    }
    let kept =
        |column: &Column| !except.iter().any(|pattern| matches(pattern.get_ref(), &column.name()));
    Ok(Selection::new(columns, kept))
}
