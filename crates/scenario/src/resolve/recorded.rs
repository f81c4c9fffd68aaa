//! Decides what is recorded.

use diagnostics::{Error, suggest};
use recording::Column;

use crate::pattern::matches;
use crate::words::Scenario;

/// The places of the numbers and of the texts that `[record]` does not except.
pub(super) fn places(
    scenario: &Scenario,
    columns: &[Column],
    texts: &[Column],
) -> Result<(Vec<usize>, Vec<usize>), Error> {
    let except = &scenario.document.record.except;
    for pattern in except {
        if !columns.iter().chain(texts).any(|column| matches(pattern.get_ref(), &column.name())) {
            let names: Vec<_> = columns.iter().chain(texts).map(Column::name).collect();
            let known = names.iter().map(String::as_str);
            let unknown = suggest::unknown("variable", pattern.get_ref(), known);
            return Err(unknown.at(&scenario.source, pattern.span()));
        }
    }
    let kept =
        |column: &Column| !except.iter().any(|pattern| matches(pattern.get_ref(), &column.name()));
    let those = |columns: &[Column]| -> Vec<usize> {
        (0..columns.len()).filter(|&place| kept(&columns[place])).collect()
    };
    Ok((those(columns), those(texts)))
}
