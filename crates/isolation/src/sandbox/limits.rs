//! Limits memory, processes and files of a process, and takes all capabilities from it.

use std::io;

use rustix::process::{Resource, Rlimit, setrlimit};
use rustix::thread::{
    CapabilitySet, CapabilitySets, clear_ambient_capability_set, remove_capability_from_bounding_set,
    set_capabilities, set_no_new_privs,
};

use super::{ProcessLimits, ProtectionMechanism, mechanism};

pub(super) fn limit_process(limits: &ProcessLimits) -> Vec<ProtectionMechanism> {
    let ProcessLimits { memory, processes, file_size } = *limits;
    let limit = |resource, most| {
        let most = Some(most);
        setrlimit(resource, Rlimit { current: most, maximum: most }).map_err(io::Error::from)
    };
    let count = limit(Resource::Nproc, processes).and_then(|()| match rustix::process::getuid().is_root() {
        true => limit_process_numbers(processes),
        false => Ok(()),
    });
    vec![
        mechanism("RLIMIT_DATA", "memory without end", limit(Resource::Data, memory)),
        mechanism("RLIMIT_NPROC", "processes without end", count),
        mechanism("RLIMIT_FSIZE", "files without end", limit(Resource::Fsize, file_size)),
        mechanism("RLIMIT_CORE", "leaving its memory as a file", limit(Resource::Core, 0)),
        mechanism("capabilities", "rights of the superuser", drop_capabilities()),
    ]
}

/// Limits the processes of root, which the kernel does not count: their numbers end instead, which Linux keeps for each namespace since 6.14.
fn limit_process_numbers(processes: u64) -> io::Result<()> {
    /// When numbers begin again, they begin there.
    const FIRST: u64 = 300;
    let release = rustix::system::uname().release().to_string_lossy().into_owned();
    let mut numbers = release.split(['.', '-']).map_while(|number| number.parse::<u32>().ok());
    let version = [numbers.next().unwrap_or(0), numbers.next().unwrap_or(0)];
    if version < [6, 14] || !super::is_in_own_namespaces() {
        return Err(io::Error::other("the kernel does not count those of root"));
    }
    std::fs::write("/proc/sys/kernel/pid_max", (FIRST + processes.max(1)).to_string())
}

/// Also for the programs that it starts.
fn drop_capabilities() -> io::Result<()> {
    set_no_new_privs(true)?;
    clear_ambient_capability_set()?;
    for capability in CapabilitySet::all().iter() {
        // A process without privileges may not, and has none to lose.
        let _ = remove_capability_from_bounding_set(capability);
    }
    let none = CapabilitySet::empty();
    set_capabilities(None, CapabilitySets { effective: none, permitted: none, inheritable: none })?;
    Ok(())
}
