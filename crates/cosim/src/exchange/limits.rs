//! Refuses numbers that would spoil what they reach.

use diagnostics::{Error, rounded_time};
use fmu_import::{CallError, FmiVersion};
use recording::{AllVariables, Columns, NumberIndex, Row};

use super::call_failure_error;
use crate::system::{InputChain, NodeBody, NodePlan};

/// A NaN spoils everything that it reaches, so the run ends where it appears.
#[inline]
pub(super) fn check_outputs_not_nan(
    plan: &NodePlan,
    columns: &Columns<AllVariables>,
    row: &Row<AllVariables>,
    time: impl FnOnce() -> f64,
) -> Result<(), Error> {
    match plan.needed.iter().copied().find(|&output| row[output].is_nan()) {
        None => Ok(()),
        Some(output) => Err(nan_output_error(plan, &columns[output].variable, time())),
    }
}

/// The error of an output that is NaN at a time [s].
#[cold]
pub(super) fn nan_output_error(plan: &NodePlan, output: &str, time: f64) -> Error {
    let version = match &plan.body {
        NodeBody::Fmu { fmu, .. } => fmu.description.version,
        _ => FmiVersion::Two,
    };
    call_failure_error(plan, CallError::nan_output(version, output), time)
}

/// Ends the run when a number is no value of the input's type: rounded it would look like a result. `time`
/// is when the source showed it [s].
#[inline]
pub(super) fn check_accepted_value(
    input_chain: &InputChain,
    columns: &Columns<AllVariables>,
    source: NumberIndex<AllVariables>,
    input: NumberIndex<AllVariables>,
    value: f64,
    time: impl FnOnce() -> f64,
) -> Result<(), Error> {
    if input_chain.accepts.contains(value) {
        return Ok(());
    }
    Err(unaccepted_value_error(
        input_chain,
        [columns[input].qualified_name(), columns[source].qualified_name()],
        value,
        time(),
    ))
}

#[cold]
fn unaccepted_value_error(input_chain: &InputChain, [to, from]: [String; 2], value: f64, time: f64) -> Error {
    let (time, expected) = (rounded_time(time), input_chain.accepts.describe_values());
    let error = Error::invalid_input(format!(
        "`{to}` would get {value} from `{from}` at t = {time} s, but it is {expected}"
    ));
    error.with_help(
        "let the source have such values only; `quantise = 1.0` on the connection rounds to whole numbers",
    )
}
