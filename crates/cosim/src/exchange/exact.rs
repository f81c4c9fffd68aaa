//! Carries integers of 64 bits from outputs to inputs, so that none of them is rounded.

use crate::clock::StepBoundary;
use crate::system::{IntegerConnection, NodePlan};
use diagnostics::{Error, rounded_time};
use recording::{AllVariables, Columns, Row, is_exact_in_f64};

/// Checks that the inputs of a node accept the integers of 64 bits that they are about to get. `start` is the row at the start of the
/// step, and `time_of` says when a source showed its value [s].
///
/// # Errors
/// When an input does not accept its integer, or a number on the way does not hold it.
pub(super) fn check_integer_inputs(
    plan: &NodePlan,
    columns: &Columns<AllVariables>,
    start: Option<&Row<AllVariables>>,
    row: &Row<AllVariables>,
    time_of: &dyn Fn(StepBoundary) -> f64,
) -> Result<(), Error> {
    for exact in &plan.exact.connections {
        let IntegerConnection { place, source: Some(source), as_it_is, .. } = exact else {
            continue;
        };
        let link = &plan.connections[*place].source;
        let value = start.filter(|_| link.at == StepBoundary::Start).unwrap_or(row)[*source];
        let (expected, help) = match as_it_is {
            Some(accepts) if accepts.contains_integer(value) => continue,
            Some(accepts) => (format!("but it is {}", accepts.describe_integers()), None),
            None if is_exact_in_f64(value) => continue,
            None => (
                "but no number on the way holds this integer exactly".to_owned(),
                Some("connect it to an integer of 64 bits, without conversion, effects and faults"),
            ),
        };
        let to =
            plan.inputs.nth_index(*place).map(|input| columns[input].qualified_name()).unwrap_or_default();
        let (from, time) = (columns[link.index].qualified_name(), rounded_time(time_of(link.at)));
        let message = format!("`{to}` would get {value} from `{from}` at t = {time} s, {expected}");
        return Err(Error::invalid_input(message).with_optional_help(help.map(str::to_owned)));
    }
    Ok(())
}

/// Puts the inputs of a node that are integers of 64 bits into the row, beside their numbers, which have arrived.
pub(super) fn carry_integer_inputs(
    plan: &NodePlan,
    start: Option<&Row<AllVariables>>,
    row: &mut Row<AllVariables>,
) {
    if plan.exact.connections.is_empty() {
        return;
    }
    for IntegerConnection { place, source, input, as_it_is } in &plan.exact.connections {
        let (Some(input), Some(number)) = (*input, plan.inputs.nth_index(*place)) else { continue };
        let link = &plan.connections[*place].source;
        let from = start.filter(|_| link.at == StepBoundary::Start).unwrap_or(row);
        let value = match (source, as_it_is) {
            (Some(source), Some(_)) => from[*source],
            // The input accepts the number, so this is the same.
            _ => row[number] as i128,
        };
        row.set_integer(input, number, value);
    }
}
