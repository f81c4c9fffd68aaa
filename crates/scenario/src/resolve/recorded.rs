//! Selects the recorded variables.

use diagnostics::{Error, suggest};
use recording::{Column, Columns, Full, Selection};

use crate::pattern::matches;
use crate::words::Scenario;

/// The variables that `[record]` does not except.
pub(super) fn selection(scenario: &Scenario, columns: &Columns<Full>) -> Result<Selection, Error> {
    let except = &scenario.document.record.except;
    for pattern in except {
        if !columns.iter().any(|column| matches(pattern.get_ref(), &column.name())) {
            let names: Vec<_> = columns.iter().map(Column::name).collect();
            let known = names.iter().map(String::as_str);
            let unknown = suggest::unknown("variable", pattern.get_ref(), known);
            return Err(unknown.at(&scenario.source, pattern.span()));
        }
    }
    let kept =
        |column: &Column| !except.iter().any(|pattern| matches(pattern.get_ref(), &column.name()));
    Ok(Selection::new(columns, kept))
}
