//! Says how an FMU in a process of its own is dealt with.

use std::path::PathBuf;

use crate::document::OnFailure;

/// How an FMU in a process of its own is dealt with.
#[derive(Debug, Clone, PartialEq)]
pub struct Isolation {
    /// What its failure does.
    pub on_failure: OnFailure,
    /// A call may last this long [s].
    pub call_limit: Option<f64>,
    /// Whether its process is shut in a sandbox.
    pub sandbox: bool,
    /// What it may read there besides its own files and those of the system.
    pub may_read: Vec<PathBuf>,
}

impl Isolation {
    /// A process of its own and nothing else: what the FMU does there is what it does in this process.
    #[must_use]
    pub fn plain() -> Self {
        Isolation {
            on_failure: OnFailure::End,
            call_limit: None,
            sandbox: false,
            may_read: Vec::new(),
        }
    }

    /// Tells that a node has such a process, and why.
    #[must_use]
    pub fn notice(node: &str, why: &str) -> String {
        format!("`{node}` runs in a process of its own, as with `isolate = true`: {why}")
    }
}
