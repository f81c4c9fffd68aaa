//! Resolves `[record]`: selects the recorded variables.

use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use recording::{AllVariables, Column, Columns, RecordedSelection};

use crate::document::Scenario;
use crate::pattern::matches_wildcard;

/// Finds the patterns that no variable fits.
pub(super) fn check_variable_patterns<S>(
    scenario: &Scenario,
    columns: &Columns<S>,
    patterns: &[Spanned<String>],
) -> Result<(), Error> {
    let names: Vec<_> = columns.iter().map(Column::qualified_name).collect();
    let unknown =
        patterns.iter().filter(|pattern| !names.iter().any(|name| matches_wildcard(pattern.get_ref(), name)));
    let errors = unknown.map(|pattern| {
        let known = names.iter().map(String::as_str);
        let unknown = suggest::unknown_name("variable", pattern.get_ref(), known);
        unknown.into_error_at(&scenario.source, pattern.span())
    });
    errors.collect::<ErrorCollector>().into_result()
}

/// The variables that `[record]` does not except.
pub(super) fn recorded_selection(
    scenario: &Scenario,
    columns: &Columns<AllVariables>,
    mistakes: &mut ErrorCollector,
) -> RecordedSelection {
    let except = &scenario.document.record.except;
    mistakes.ok_or_record(check_variable_patterns(scenario, columns, except));
    let kept = |column: &Column| {
        !except.iter().any(|pattern| matches_wildcard(pattern.get_ref(), &column.qualified_name()))
    };
    RecordedSelection::new(columns, kept)
}
