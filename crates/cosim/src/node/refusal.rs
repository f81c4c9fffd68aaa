//! Says what an FMU refused before the first step.

use diagnostics::Error;
use fmu_import::CallError;
use serde::{Deserialize, Serialize};

use crate::system::StartValue;

/// What an FMU refused before the first step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Refusal {
    /// A call before there is a time.
    Early(CallError),
    /// A call at the first communication point.
    Call(CallError),
    /// A start value, and what it says about that.
    Start(Box<StartValue>, String),
}

impl From<CallError> for Refusal {
    fn from(error: CallError) -> Self {
        Refusal::Call(error)
    }
}

impl Refusal {
    /// The error of the node called `name`, whose first communication point is at `begin` [s].
    #[must_use]
    pub fn into_error(self, name: &str, begin: f64) -> Error {
        match self {
            Refusal::Early(error) => Error::component(name, &error.call, None, error.what),
            Refusal::Call(error) => Error::component(name, &error.call, Some(begin), error.what),
            Refusal::Start(start, what) => start.refused(name, &what),
        }
    }
}
