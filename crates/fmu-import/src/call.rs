//! Says what a call to an FMU did instead of succeeding, and what the FMU logged.

/// What a call to a node did instead of succeeding.
#[derive(Debug, Clone, PartialEq)]
pub struct CallError {
    /// The function: `fmi2DoStep`.
    pub call: &'static str,
    /// What it returned, and what the node says about it.
    pub what: String,
    /// The node ended the simulation on purpose, having come to this time [s].
    pub terminated: Option<f64>,
}

/// A message that a node logged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// The FMI status that it came with.
    pub status: i32,
    /// The category that it came with.
    pub category: String,
    /// What it says.
    pub text: String,
}
