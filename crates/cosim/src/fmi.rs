//! Reads messages and errors of FMUs without the words of FMI.

use fmu_import::{CallError, Message};
use recording::Level;

/// The status of a message with a warning; all above are errors.
const WARNING: i32 = 1;

/// Whether the call reads values, which belong to the end of a step; all other calls belong to its start.
pub(crate) fn at_end_of_step(error: &CallError) -> bool {
    error.call.starts_with("fmi2Get")
}

/// The error of an output that is NaN.
pub(crate) fn not_a_number(output: &str) -> CallError {
    let what = format!("the output `{output}` is NaN");
    CallError { call: "fmi2GetReal", what, terminated: None }
}

/// The level of a message in recordings.
pub(crate) fn level(message: &Message) -> Level {
    match message.status {
        ..WARNING => Level::Info,
        WARNING => Level::Warning,
        _ => Level::Error,
    }
}
