//! Gives a process names of its own for users, files, processes, shared memory, networks and hosts, and a process that ends with all others.
//!
//! Three processes share the work. The one that the host started waits outside, and ends as the last one does. The first of the new
//! namespace adopts what is orphaned there; with its end the kernel ends all the others. The second one is that which goes on.
#![expect(unsafe_code, reason = "forking, and mounting attributes")]

use std::fs;
use std::io::{self, Error};
use std::os::fd::{AsFd, OwnedFd};

use rustix::process::{
    Pid, Resource, Rlimit, Signal, getgid, getuid, set_parent_process_death_signal, setrlimit, setsid,
};
use rustix::thread::UnshareFlags;

use super::{ProtectionMechanism, Sandbox, mechanism, root, state};

const SPACES: UnshareFlags = UnshareFlags::NEWUSER
    .union(UnshareFlags::NEWNS)
    .union(UnshareFlags::NEWPID)
    .union(UnshareFlags::NEWIPC)
    .union(UnshareFlags::NEWUTS)
    .union(UnshareFlags::NEWNET)
    .union(UnshareFlags::NEWCGROUP);

/// Only the process that goes on returns.
pub(super) fn enter_namespaces(sandbox: &Sandbox) -> Vec<ProtectionMechanism> {
    // That of the host is a session of its own already when it leads one.
    let session = match setsid() {
        Err(error) if rustix::process::getsid(None) != Ok(rustix::process::getpid()) => Err(error),
        _ => Ok(()),
    };
    let mut mechanisms = vec![
        mechanism("session", "keys and signals of your terminal", session),
        mechanism("descriptors", "files that other programs left open", close_other_descriptors()),
    ];
    let spaces = make_namespaces();
    if spaces.is_ok() {
        state::note_own_namespaces();
    }
    let same = |name, protects| mechanism(name, protects, spaces.as_ref().copied());
    mechanisms.extend([
        same("user namespace", "rights that you have"),
        same("PID namespace", "other processes, and outliving the run"),
        same("IPC namespace", "shared memory and queues of others"),
        same("network namespace", "the network"),
        same("UTS namespace", "the name of the host"),
    ]);
    let root = spaces.and_then(|()| root::enter_own_root(sandbox));
    mechanisms.push(mechanism("mount namespace", "sockets and attributes of files of others", root));
    mechanisms
}

/// All but standard input, output and error.
fn close_other_descriptors() -> io::Result<()> {
    // SAFETY: nothing of this process needs one; it runs code of others only after this.
    match unsafe { libc::syscall(libc::SYS_close_range, 3_u32, u32::MAX, 0_u32) } {
        0 => Ok(()),
        _ => Err(Error::last_os_error()),
    }
}

fn make_namespaces() -> io::Result<()> {
    if fs::read_dir("/proc/self/task")?.count() != 1 {
        return Err(Error::other("this process has threads"));
    }
    let (user, group) = (getuid().as_raw(), getgid().as_raw());
    // SAFETY: no thread shares files or memory with another one, as there is one.
    unsafe { rustix::thread::unshare_unsafe(SPACES) }?;
    fs::write("/proc/self/setgroups", "deny")?;
    fs::write("/proc/self/uid_map", format!("{user} {user} 1"))?;
    fs::write("/proc/self/gid_map", format!("{group} {group} 1"))?;
    // New rights have taken the signal away.
    set_parent_process_death_signal(Some(Signal::KILL))?;
    let (status, end) = rustix::pipe::pipe()?;
    match fork()? {
        Some(first) => relay_end(first, end, &status),
        None => drop(status),
    }
    set_parent_process_death_signal(Some(Signal::KILL))?;
    match fork()? {
        Some(second) => adopt_processes(second, &end),
        None => drop(end),
    }
    set_parent_process_death_signal(Some(Signal::KILL))?;
    Ok(())
}

/// The new process in the old one, and none in the new one.
fn fork() -> io::Result<Option<Pid>> {
    // SAFETY: this process has one thread, so that all of its state is whole in the new one.
    match unsafe { libc::fork() } {
        -1 => Err(Error::last_os_error()),
        number => Ok(Pid::from_raw(number)),
    }
}

/// Waits for the end of a process, and gives its status; with orphans it is done at once.
fn wait_for(process: Pid) -> io::Result<i32> {
    loop {
        let mut status = 0;
        // SAFETY: the status is written to memory of this function.
        match unsafe { libc::waitpid(-1, &raw mut status, 0) } {
            -1 if Error::last_os_error().kind() != io::ErrorKind::Interrupted => {
                return Err(Error::last_os_error());
            }
            number if number == process.as_raw_nonzero().get() => return Ok(status),
            _ => {}
        }
    }
}

/// The life of the first process of a namespace.
fn adopt_processes(second: Pid, end: &OwnedFd) -> ! {
    let status = wait_for(second).unwrap_or_default();
    let _ = rustix::io::write(end, &status.to_ne_bytes());
    leave(0)
}

/// The life of the process that the host knows: it ends as the one does that went on.
fn relay_end(first: Pid, end: OwnedFd, status: &OwnedFd) -> ! {
    drop(end);
    let _ = close_output();
    let mut bytes = [0; 4];
    let known = matches!(rustix::io::read(status.as_fd(), &mut bytes), Ok(4));
    let _ = wait_for(first);
    let status = if known { i32::from_ne_bytes(bytes) } else { libc::SIGKILL };
    if libc::WIFSIGNALED(status) {
        let signal = libc::WTERMSIG(status);
        let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) });
        // SAFETY: the signal gets back what it does by itself, and ends this process.
        unsafe {
            libc::signal(signal, libc::SIG_DFL);
            libc::raise(signal);
        }
    }
    leave(libc::WEXITSTATUS(status))
}

/// So that whoever reads what the others write sees their end.
fn close_output() -> io::Result<()> {
    let nothing = fs::OpenOptions::new().read(true).write(true).open("/dev/null")?;
    rustix::stdio::dup2_stdout(&nothing)?;
    rustix::stdio::dup2_stderr(&nothing)?;
    Ok(())
}

/// Ends at once: what is to be done at an end is that of the process that goes on.
fn leave(code: i32) -> ! {
    // SAFETY: it does not return, and runs nothing of this program, which has an `_exit` of its own.
    unsafe { libc::syscall(libc::SYS_exit_group, code) };
    unreachable!("the kernel has ended this process")
}
