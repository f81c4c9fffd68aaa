//! Tracks the state of an instance in the state machine of the standard, for messages about refused calls.

use std::fmt;

/// What an instance went through, as far as its calls succeeded (FMI 2.0, section 4.2.4; FMI 3.0, section 4.2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum InstancePhase {
    #[default]
    Instantiated,
    Initialization,
    Event,
    Step,
    ContinuousTime,
    Terminated,
    /// This call returned an error.
    Failed(&'static str),
    /// A state came from bytes, which say nothing about it.
    Restored,
}

impl fmt::Display for InstancePhase {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            InstancePhase::Instantiated => out.write_str("before the initialization"),
            InstancePhase::Initialization => out.write_str("in initialization mode"),
            InstancePhase::Event => out.write_str("in event mode"),
            InstancePhase::Step => out.write_str("between two steps"),
            InstancePhase::ContinuousTime => out.write_str("in continuous-time mode"),
            InstancePhase::Terminated => out.write_str("after the end of the simulation"),
            InstancePhase::Failed(call) => write!(out, "after an error of {call}"),
            InstancePhase::Restored => out.write_str("with a state that was bytes"),
        }
    }
}
