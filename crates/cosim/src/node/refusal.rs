//! Says what an FMU refused before the first step.

use diagnostics::Error;
use fmu_import::CallError;
use serde::{Deserialize, Serialize};

use crate::system::StartValue;

/// What an FMU refused before the first step.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[non_exhaustive]
pub enum FmuRefusal {
    /// A call before there is a time.
    Early(CallError),
    /// A call at the first communication point.
    Call(CallError),
    /// A start value, and what it says about that.
    Start(Box<StartValue>, String),
}

impl From<CallError> for FmuRefusal {
    fn from(error: CallError) -> Self {
        FmuRefusal::Call(error)
    }
}

impl FmuRefusal {
    /// The error of the node called `name`, whose first communication point is at `begin` [s].
    #[must_use]
    pub fn into_error(self, name: &str, begin: f64) -> Error {
        match self {
            FmuRefusal::Early(error) => Error::node_failure(name, &error.call, None, error.what),
            FmuRefusal::Call(error) => Error::node_failure(name, &error.call, Some(begin), error.what),
            FmuRefusal::Start(start, what) => start.refusal_error(name, &what),
        }
    }
}
