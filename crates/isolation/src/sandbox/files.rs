//! Shuts off files, abstract sockets and signals by Landlock.

use std::env;
use std::path::PathBuf;

use landlock::{
    ABI, Access as _, AccessFs, AccessNet, CompatLevel, Compatible as _, Ruleset, RulesetAttr as _,
    RulesetCreatedAttr as _, RulesetError, RulesetStatus, Scope, path_beneath_rules,
};

use super::{ProtectionMechanism, Sandbox, mechanism};

/// Code of the system.
pub(super) const CODE: [&str; 6] = ["/usr", "/lib", "/lib64", "/bin", "/sbin", "/opt"];
/// What programs ask for besides: settings, and what the kernel says about this process.
const INFORMATION: [&str; 3] = ["/etc", "/proc", "/sys"];
pub(super) const DEVICES: [&str; 5] = ["/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"];
/// Where named semaphores and shared memory of a process live.
pub(super) const SHARED_MEMORY: &str = "/dev/shm";

/// The newest that this program knows; an older kernel does what it can.
const NEWEST: ABI = ABI::V6;

/// Folders of libraries where the loader is told to look.
pub(super) fn library_folders() -> Vec<PathBuf> {
    let libraries = env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    env::split_paths(&libraries).filter(|path| path.is_absolute()).collect()
}

pub(super) fn restrict_files(sandbox: &Sandbox) -> ProtectionMechanism {
    let outcome = apply_rules(sandbox).map_err(|error| error.to_string()).and_then(|status| match status {
        RulesetStatus::FullyEnforced => Ok(()),
        RulesetStatus::PartiallyEnforced => Err("the kernel knows a part of it".to_owned()),
        RulesetStatus::NotEnforced => Err("the kernel does not know it".to_owned()),
    });
    mechanism("Landlock", "files, TCP and abstract sockets of others", outcome)
}

fn apply_rules(sandbox: &Sandbox) -> Result<RulesetStatus, RulesetError> {
    let read = CODE.iter().chain(&INFORMATION).map(PathBuf::from).chain(library_folders());
    let read = read.chain(sandbox.read.iter().cloned());
    let write = DEVICES.iter().copied().chain(super::is_in_own_namespaces().then_some(SHARED_MEMORY));
    let write = write.map(PathBuf::from).chain(sandbox.write.iter().cloned());
    let status = Ruleset::default()
        .set_compatibility(CompatLevel::BestEffort)
        .handle_access(AccessFs::from_all(NEWEST))?
        .handle_access(AccessNet::from_all(NEWEST))?
        .scope(Scope::from_all(NEWEST))?
        .create()?
        .add_rules(path_beneath_rules(read, AccessFs::from_read(NEWEST)))?
        .add_rules(path_beneath_rules(write, AccessFs::from_all(NEWEST)))?
        .restrict_self()?;
    Ok(status.ruleset)
}
