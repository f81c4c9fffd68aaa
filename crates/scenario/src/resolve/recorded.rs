//! Decides what is recorded.

use diagnostics::Error;
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
            let message = format!("nothing that is recorded is called `{}`", pattern.get_ref());
            return Err(scenario.error(pattern, message));
        }
    }
    let kept =
        |column: &Column| !except.iter().any(|pattern| matches(pattern.get_ref(), &column.name()));
    let those = |columns: &[Column]| -> Vec<usize> {
        (0..columns.len()).filter(|&place| kept(&columns[place])).collect()
    };
    Ok((those(columns), those(texts)))
}
