//! Says how an FMU in a process of its own is dealt with.

use std::path::PathBuf;

pub use ::isolation::ProcessLimits;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a failure of an isolated FMU does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FmuFailurePolicy {
    /// It ends the run.
    #[default]
    End,
    /// The outputs keep their values until the end of the run.
    Hold,
    /// The FMU starts again in a new process, with its start values and the inputs of the moment, at the time where it failed. A
    /// second failure in the same step ends the run.
    Restart,
}

/// How an FMU in a process of its own is dealt with.
#[derive(Debug, Clone, PartialEq)]
pub struct FmuIsolation {
    /// What its failure does.
    pub on_failure: FmuFailurePolicy,
    /// A call may last this long [s].
    pub call_limit: Option<f64>,
    /// Whether its process is shut in a sandbox.
    pub sandbox: bool,
    /// What it may read there besides its own files and those of the system.
    pub may_read: Vec<PathBuf>,
    /// How much of the machine it may use there.
    pub limits: ProcessLimits,
}

impl FmuIsolation {
    /// A process of its own and nothing else: what the FMU does there is what it does in this process.
    #[must_use]
    pub fn process_only() -> Self {
        FmuIsolation {
            on_failure: FmuFailurePolicy::End,
            call_limit: None,
            sandbox: false,
            may_read: Vec::new(),
            limits: ProcessLimits::default(),
        }
    }

    /// Tells that a node has such a process, and why.
    #[must_use]
    pub fn isolation_notice(node: &str, why: &str) -> String {
        format!("`{node}` runs in a process of its own, as with `isolate = true`: {why}")
    }
}
