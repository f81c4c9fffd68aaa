//! Confines this process to a sandbox (Landlock, seccomp): no network, few files, nothing of other processes.

use std::path::PathBuf;

/// Files that a process in a sandbox can use besides those of the system.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SandboxFiles {
    /// Folders and files that it may read, with all that is in them.
    pub read: Vec<PathBuf>,
    /// Folders that it may write to, too.
    pub write: Vec<PathBuf>,
}

/// Shuts this process in, for good; what the kernel does not offer of that, in words.
#[must_use]
pub fn enter_sandbox(sandbox: &SandboxFiles) -> Vec<String> {
    #[cfg(target_os = "linux")]
    return linux::enter_sandbox(sandbox);
    #[cfg(not(target_os = "linux"))]
    {
        let _ = sandbox;
        vec!["this system has no sandbox".to_owned()]
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeMap;
    use std::env;
    use std::path::PathBuf;

    use landlock::{
        ABI, Access as _, AccessFs, AccessNet, CompatLevel, Compatible as _, Ruleset, RulesetAttr as _,
        RulesetCreatedAttr as _, RulesetError, RulesetStatus, Scope, path_beneath_rules,
    };
    use seccompiler::{
        BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter,
        SeccompRule,
    };

    use super::SandboxFiles;

    /// What programs and libraries of the system need: code, settings, and what the kernel says about this process.
    const SYSTEM: [&str; 9] = ["/usr", "/lib", "/lib64", "/bin", "/sbin", "/opt", "/etc", "/proc", "/sys"];
    const DEVICES: [&str; 5] = ["/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"];

    /// The newest that this program knows; an older kernel does what it can.
    const NEWEST: ABI = ABI::V6;

    pub(super) fn enter_sandbox(sandbox: &SandboxFiles) -> Vec<String> {
        let mut absent = Vec::new();
        match restrict_files(sandbox) {
            Ok(RulesetStatus::FullyEnforced) => {}
            Ok(RulesetStatus::PartiallyEnforced) => absent.push(
                "the kernel shuts off a part of the files, of the network and of other processes only (landlock)"
                    .to_owned(),
            ),
            Ok(RulesetStatus::NotEnforced) => {
                absent.push("the kernel does not shut off files (landlock)".to_owned());
            }
            Err(error) => absent.push(format!("files are not shut off: {error}")),
        }
        if let Err(error) = restrict_system_calls() {
            absent.push(format!("the network is not shut off: {error}"));
        }
        absent
    }

    fn restrict_files(sandbox: &SandboxFiles) -> Result<RulesetStatus, RulesetError> {
        // Libraries may be anywhere where the loader is told to look.
        let libraries = env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
        let libraries = env::split_paths(&libraries).filter(|path| path.is_absolute());
        let read = SYSTEM.iter().map(PathBuf::from).chain(libraries);
        let read = read.chain(sandbox.read.iter().cloned());
        let write = DEVICES.iter().map(PathBuf::from).chain(sandbox.write.iter().cloned());
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

    /// System calls that reach into other processes, or around the rules about files.
    const CALLS: [libc::c_long; 16] = [
        libc::SYS_ptrace,
        libc::SYS_process_vm_readv,
        libc::SYS_process_vm_writev,
        libc::SYS_pidfd_getfd,
        libc::SYS_io_uring_setup,
        libc::SYS_bpf,
        libc::SYS_perf_event_open,
        libc::SYS_userfaultfd,
        libc::SYS_mount,
        libc::SYS_umount2,
        libc::SYS_pivot_root,
        libc::SYS_unshare,
        libc::SYS_setns,
        libc::SYS_keyctl,
        libc::SYS_add_key,
        libc::SYS_request_key,
    ];

    /// Refuses those calls, and sockets but those between processes of this machine.
    fn restrict_system_calls() -> Result<(), Box<dyn std::error::Error>> {
        let unix = u64::try_from(libc::AF_UNIX)?;
        let (dword, differs) = (SeccompCmpArgLen::Dword, SeccompCmpOp::Ne);
        let foreign = SeccompRule::new(vec![SeccompCondition::new(0, dword, differs, unix)?])?;
        let mut rules: BTreeMap<_, _> = CALLS.iter().map(|call| (*call, Vec::new())).collect();
        rules.insert(libc::SYS_socket, vec![foreign]);
        let refuse = SeccompAction::Errno(u32::try_from(libc::EACCES)?);
        let machine = env::consts::ARCH.try_into()?;
        let filter = SeccompFilter::new(rules, SeccompAction::Allow, refuse, machine)?;
        let program: BpfProgram = filter.try_into()?;
        Ok(seccompiler::apply_filter_all_threads(&program)?)
    }
}
