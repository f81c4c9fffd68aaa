//! Names the call after which the rest of a step waits.

use super::FmiStatus;

/// Why the calls of a step are not all made in a row.
#[derive(Debug)]
pub(super) enum Interruption {
    /// A status that is not OK.
    Status(FmiStatus),
    /// More values than these were written.
    Overrun(usize),
}

/// The call in which that happened. The rest waits for `Instance::execute_step_calls`.
#[derive(Debug)]
pub(super) struct InterruptedCall {
    /// Its number among all calls of the step.
    pub number: usize,
    /// What happened in it.
    pub why: Interruption,
}
