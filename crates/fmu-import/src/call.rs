//! Results of calls to an FMU: failures and ends of steps.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::FmiVersion;

/// What a call to an FMU did instead of succeeding.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[error("{call} {what}")]
pub struct CallError {
    /// The function, by its name in the FMU's version of FMI.
    pub call: Cow<'static, str>,
    /// What it returned, and what the FMU says about it.
    pub what: String,
    /// The FMU ended the simulation on purpose, having come to this time [s].
    pub terminated: Option<f64>,
    /// The FMU discarded a step, and may do a shorter one.
    pub discarded: bool,
}

impl CallError {
    /// The error `what` of the function `call`.
    #[must_use]
    pub fn new(call: impl Into<Cow<'static, str>>, what: impl Into<String>) -> Self {
        CallError { call: call.into(), what: what.into(), terminated: None, discarded: false }
    }

    /// The error of an output that is NaN.
    #[must_use]
    pub fn nan_output(version: FmiVersion, output: &str) -> Self {
        let call = version.function("fmi2GetReal", "fmi3GetFloat64");
        CallError::new(call, format!("the output `{output}` is NaN"))
    }

    /// Whether the call reads values, and so belongs to the end of a step; all others belong to its start.
    #[must_use]
    pub fn is_at_step_end(&self) -> bool {
        // Those of model exchange are within a step.
        let within = ["GetDerivatives", "StateDerivatives", "EventIndicators", "ContinuousStates"];
        ["fmiGet", "fmi2Get", "fmi3Get"].iter().any(|get| self.call.starts_with(get))
            && !within.iter().any(|values| self.call.ends_with(values))
    }
}

/// How a step ended that did not fail.
#[derive(Debug, Clone, PartialEq)]
#[must_use = "a step may end early"]
pub enum StepStatus {
    /// At its end.
    Done,
    /// Early: the FMU cannot do a step of this length.
    Discarded {
        /// The time that the FMU came to [s].
        reached: f64,
        /// What the FMU says about it.
        what: String,
    },
    /// Early: the FMU wants the simulation to end.
    Terminated {
        /// The time that the FMU came to [s].
        reached: f64,
        /// What the FMU says about it.
        what: String,
    },
}

/// How far a step came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepResult {
    /// The time that the FMU came to [s].
    pub reached: f64,
    /// Whether there is an event to handle.
    pub event: bool,
}

/// What an FMU says about the interval of a clock: `fmi3IntervalQualifier`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntervalQualifier {
    /// It is not known yet.
    Unknown,
    /// It is the same as before.
    Same,
    /// It is another one, or known for the first time.
    Changed,
}

/// What an update of the discrete states says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscreteStatesUpdate {
    /// Whether the event has to be iterated on.
    pub discrete_states_need_update: bool,
    /// Whether nominal values of continuous states are others now.
    pub nominals_changed: bool,
    /// Whether values of continuous states are others now.
    pub states_changed: bool,
    /// When the next event is due, if the FMU knows it [s].
    pub next_event_time: Option<f64>,
}

/// Real inputs, by their value references.
#[derive(Debug, Clone, Copy)]
pub struct RealInputs<'a> {
    /// The value references.
    pub references: &'a [u32],
    /// A value for each of them.
    pub values: &'a [f64],
}

/// What an FMU says about a completed step of the integrator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct CompletedStep {
    /// Whether there is an event to handle: a step event.
    pub event: bool,
}

impl StepStatus {
    /// Makes an early end an error.
    pub(crate) fn into_result(self, version: FmiVersion) -> Result<(), CallError> {
        let call = version.function("fmi2DoStep", "fmi3DoStep");
        let error = |what| CallError::new(call, what);
        match self {
            StepStatus::Done => Ok(()),
            StepStatus::Discarded { what, .. } => Err(CallError { discarded: true, ..error(what) }),
            StepStatus::Terminated { reached, what } => {
                Err(CallError { terminated: Some(reached), ..error(what) })
            }
        }
    }
}
