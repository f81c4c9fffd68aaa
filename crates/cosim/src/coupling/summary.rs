//! Summary of a coupling: how often loops were repeated, how far steps were divided, and the errors of connections.

use serde::{Deserialize, Serialize};

/// What a coupling did.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CouplingSummary {
    /// The loops that it solved.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loops: Vec<LoopSummary>,
    /// The division of communication steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionSummary>,
}

/// The solution of a loop.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LoopSummary {
    /// The inputs that were guessed until they fitted.
    pub inputs: Vec<String>,
    /// Steps that were solved.
    pub steps: u64,
    /// Passes through the loop in all of them.
    pub passes: u64,
    /// Passes in the worst step, and when that began [s].
    pub most: (u32, f64),
}

/// The division of communication steps.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct DivisionSummary {
    /// Parts that were done.
    pub parts: u64,
    /// Parts that were done again in halves: for their error, because an FMU discarded them, or because a loop was not solved.
    pub repeated: u64,
    /// The shortest part, and when it began [s].
    pub shortest: (f64, f64),
    /// The error of each connection, or of each bond.
    pub errors: Vec<ConnectionError>,
}

/// The error that the coupling makes at a connection, estimated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ConnectionError {
    /// The input, or the inputs of a bond.
    pub name: String,
    /// The largest error of a part, in the unit of the input; of a bond in the unit of its energy.
    pub largest: f64,
    /// When that part began [s].
    pub at: f64,
    /// The largest one relative to the largest value until then [-].
    pub relative: f64,
}

impl ConnectionError {
    /// Takes the error of a part that began at a time [s].
    pub(super) fn record_error(&mut self, error: f64, relative: f64, begin: f64) {
        if error > self.largest {
            (self.largest, self.at) = (error, begin);
        }
        self.relative = self.relative.max(relative);
    }
}
