//! Carries integers of 64 bits from outputs to inputs, so that none of them is rounded.

use crate::clock::At;
use crate::system::{IntegerConnection, NodePlan};
use diagnostics::{Error, rounded};
use recording::{Columns, Full, Row, fits_number};

/// Checks that the inputs of a node accept the integers of 64 bits that they are about to get. `start` is the row at the start of the
/// step, and `time_of` says when a source showed its value [s].
///
/// # Errors
/// When an input does not accept its integer, or a number on the way does not hold it.
pub(super) fn check(
    plan: &NodePlan,
    columns: &Columns<Full>,
    start: Option<&Row<Full>>,
    row: &Row<Full>,
    time_of: &dyn Fn(At) -> f64,
) -> Result<(), Error> {
    for exact in &plan.exact.connections {
        let IntegerConnection { place, source: Some(source), as_it_is, .. } = exact else {
            continue;
        };
        let link = &plan.connections[*place].source;
        let value = start.filter(|_| link.at == At::Start).unwrap_or(row)[*source];
        let (expected, help) = match as_it_is {
            Some(accepts) if accepts.holds_integer(value) => continue,
            Some(accepts) => (format!("but it is {}", accepts.expected_integers()), None),
            None if fits_number(value) => continue,
            None => (
                "but no number on the way holds this integer exactly".to_owned(),
                Some("connect it to an integer of 64 bits, without conversion, effects and faults"),
            ),
        };
        let to = plan.inputs.index(*place).map(|input| columns[input].name()).unwrap_or_default();
        let (from, time) = (columns[link.index].name(), rounded(time_of(link.at)));
        let message = format!("`{to}` would get {value} from `{from}` at t = {time} s, {expected}");
        return Err(Error::input(message).hint(help.map(str::to_owned)));
    }
    Ok(())
}

/// Puts the inputs of a node that are integers of 64 bits into the row, beside their numbers, which have arrived.
pub(super) fn carry(plan: &NodePlan, start: Option<&Row<Full>>, row: &mut Row<Full>) {
    if plan.exact.connections.is_empty() {
        return;
    }
    for IntegerConnection { place, source, input, as_it_is } in &plan.exact.connections {
        let (Some(input), Some(number)) = (*input, plan.inputs.index(*place)) else { continue };
        let link = &plan.connections[*place].source;
        let from = start.filter(|_| link.at == At::Start).unwrap_or(row);
        let value = match (source, as_it_is) {
            (Some(source), Some(_)) => from[*source],
            // The input accepts the number, so this is the same.
            _ => row[number] as i128,
        };
        row.put((input, number), value);
    }
}
