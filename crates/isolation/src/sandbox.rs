//! Confines this process to a sandbox: namespaces with a root of its own, Landlock, a list of system calls, limits.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

#[cfg(target_os = "linux")]
mod files;
#[cfg(target_os = "linux")]
mod limits;
#[cfg(target_os = "linux")]
mod namespaces;
#[cfg(target_os = "linux")]
mod root;
mod state;
#[cfg(target_os = "linux")]
mod system_calls;

pub(crate) use state::is_in_own_namespaces;

/// What a process in a sandbox can use besides what all programs need of the system.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sandbox {
    /// Folders and files that it may read, with all that is in them.
    pub read: Vec<PathBuf>,
    /// Folders that it may write to, too.
    pub write: Vec<PathBuf>,
    /// How much of the machine.
    pub limits: ProcessLimits,
}

/// How much a process in a sandbox may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessLimits {
    /// Memory that is its own [B].
    pub memory: u64,
    /// Processes and threads.
    pub processes: u64,
    /// Length of a file that it writes [B].
    pub file_size: u64,
}

impl Default for ProcessLimits {
    fn default() -> Self {
        ProcessLimits { memory: 8_000_000_000, processes: 256, file_size: 2_000_000_000 }
    }
}

/// One mechanism of a sandbox, and whether it holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProtectionMechanism {
    /// How the kernel calls it.
    pub name: &'static str,
    /// What it keeps a process from.
    pub protects: &'static str,
    /// Why it does not hold on this machine.
    pub failure: Option<String>,
}

impl ProtectionMechanism {
    /// A warning about a mechanism that does not hold.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let Self { name, protects, failure } = self;
        failure.as_ref().map(|why| format!("{name} is missing, which keeps it from {protects}: {why}"))
    }
}

/// Shuts this process in, for good, with the processes that it starts; the mechanisms of which that is made. It has to have one thread. Where the
/// kernel has namespaces for processes, this goes on in a process that it started, and the process that called waits for the end of that one and
/// ends as it does.
#[must_use]
pub fn enter_sandbox(sandbox: &Sandbox) -> Vec<ProtectionMechanism> {
    #[cfg(target_os = "linux")]
    {
        let mut mechanisms = namespaces::enter_namespaces(sandbox);
        mechanisms.extend(limits::limit_process(&sandbox.limits));
        mechanisms.push(files::restrict_files(sandbox));
        mechanisms.push(system_calls::restrict_system_calls());
        mechanisms
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = sandbox;
        let failure = Some("it is for Linux".to_owned());
        vec![ProtectionMechanism { name: "sandbox", protects: "what you may do", failure }]
    }
}

/// A mechanism with the outcome of its set-up.
#[cfg(target_os = "linux")]
fn mechanism<E: std::fmt::Display>(
    name: &'static str,
    protects: &'static str,
    outcome: Result<(), E>,
) -> ProtectionMechanism {
    ProtectionMechanism { name, protects, failure: outcome.err().map(|error| error.to_string()) }
}
