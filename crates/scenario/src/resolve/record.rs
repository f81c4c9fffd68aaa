//! Resolves `[record]`: selects the recorded variables.

use diagnostics::{Error, Mistakes, suggest};
use recording::{Column, Columns, Full, Selection};

use crate::document::Scenario;
use crate::pattern::matches;

/// Finds the patterns of `[record]` that no variable fits.
fn check(scenario: &Scenario, columns: &Columns<Full>) -> Result<(), Error> {
    let names: Vec<_> = columns.iter().map(Column::name).collect();
    let except = scenario.document.record.except.iter();
    let unknown =
        except.filter(|pattern| !names.iter().any(|name| matches(pattern.get_ref(), name)));
    let errors = unknown.map(|pattern| {
        let known = names.iter().map(String::as_str);
        let unknown = suggest::unknown("variable", pattern.get_ref(), known);
        unknown.at(&scenario.source, pattern.span())
    });
    errors.collect::<Mistakes>().finish()
}

/// The variables that `[record]` does not except.
pub(super) fn selection(
    scenario: &Scenario,
    columns: &Columns<Full>,
    mistakes: &mut Mistakes,
) -> Selection {
    mistakes.take(check(scenario, columns));
    let except = &scenario.document.record.except;
    let kept =
        |column: &Column| !except.iter().any(|pattern| matches(pattern.get_ref(), &column.name()));
    Selection::new(columns, kept)
}
