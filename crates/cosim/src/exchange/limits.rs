//! Refuses numbers that would spoil what they reach.

use diagnostics::{Error, rounded};
use fmu_import::{CallError, Version};
use recording::{Columns, Full, NumberIndex, Row};

use super::failure;
use crate::system::{Body, InputChain, NodePlan};

/// A NaN spoils everything that it reaches, so the run ends where it appears.
#[inline]
pub(super) fn check_numbers(
    plan: &NodePlan,
    columns: &Columns<Full>,
    row: &Row<Full>,
    time: impl FnOnce() -> f64,
) -> Result<(), Error> {
    match plan.needed.iter().copied().find(|&output| row[output].is_nan()) {
        None => Ok(()),
        Some(output) => Err(no_number(plan, &columns[output].variable, time())),
    }
}

/// The error of an output that is NaN at a time [s].
#[cold]
pub(super) fn no_number(plan: &NodePlan, output: &str, time: f64) -> Error {
    let version = match &plan.body {
        Body::Fmu { fmu, .. } => fmu.description.version,
        _ => Version::Two,
    };
    failure(plan, CallError::not_a_number(version, output), time)
}

/// Ends the run when a number is no value of the input's type: rounded it would look like a result. `time`
/// is when the source showed it [s].
#[inline]
pub(super) fn accept(
    input_chain: &InputChain,
    columns: &Columns<Full>,
    source: NumberIndex<Full>,
    input: NumberIndex<Full>,
    value: f64,
    time: impl FnOnce() -> f64,
) -> Result<(), Error> {
    if input_chain.accepts.holds(value) {
        return Ok(());
    }
    Err(no_value(input_chain, [columns[input].name(), columns[source].name()], value, time()))
}

#[cold]
fn no_value(input_chain: &InputChain, [to, from]: [String; 2], value: f64, time: f64) -> Error {
    let (time, expected) = (rounded(time), input_chain.accepts.expected());
    let error = Error::input(format!(
        "`{to}` would get {value} from `{from}` at t = {time} s, but it is {expected}"
    ));
    error.help("let the source have such values only; `quantise = 1.0` on the connection rounds to whole numbers")
}
