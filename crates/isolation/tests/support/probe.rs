//! Tries to leave a sandbox in all ways that it knows, towards files, sockets and processes that the test itself made.
//!
//! What would change the machine if it succeeded is asked for with arguments that change nothing: the time of now, the name that the host has,
//! a module that is none. It counts as refused only where the kernel says that the caller may not, or that there is no such call.
#![allow(unsafe_code, reason = "system calls with any arguments")]

use std::ffi::CString;
use std::fs;
use std::io::{self, Write as _};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::os::fd::{AsRawFd as _, FromRawFd as _, OwnedFd};
use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _, PermissionsExt as _, symlink};
use std::os::unix::net::{UnixDatagram, UnixListener, UnixStream};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use isolation::{
    ChannelPacket, IsolatedGuest, ProtectionMechanism, Sandbox, connect_to_host_process, enter_sandbox,
    is_host_alive,
};
use libc::{c_long, c_ulong};
use serde::{Deserialize, Serialize};

/// What lies outside of the sandbox.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OutsideTargets {
    /// Folders with a file, a script, and sockets of all kinds.
    pub folders: Vec<PathBuf>,
    /// A process that sleeps.
    pub process: i32,
    /// The process that started the probe.
    pub host: i32,
    /// The number of shared memory (System V), its key, and those of a queue and of semaphores.
    pub memory: i32,
    /// The key of all three.
    pub key: i32,
    /// Where somebody listens at 127.0.0.1.
    pub port: u16,
    /// The other end of a terminal.
    pub terminal: PathBuf,
}

/// Keeps what lies outside.
pub struct Outside {
    pub targets: OutsideTargets,
    process: Child,
    _terminal: OwnedFd,
    _sockets: (Vec<UnixListener>, Vec<UnixDatagram>, TcpListener, UdpSocket),
    queue: i32,
    semaphores: i32,
}

const CONTENT: &str = "of others";

impl Outside {
    /// Makes all targets in folders of this name, below a folder for files and in shared memory.
    pub fn new(folder: &Path) -> io::Result<Self> {
        let name = format!("trackside-probe-{}", std::process::id());
        let folders = vec![folder.join(&name), Path::new("/dev/shm").join(&name)];
        let (mut listeners, mut datagrams) = (Vec::new(), Vec::new());
        for folder in &folders {
            fs::create_dir_all(folder.join("inner"))?;
            fs::write(folder.join("file"), CONTENT)?;
            fs::write(folder.join("script"), "#!/bin/sh\nexit 0\n")?;
            // Whoever the probe is, rights of files do not stop it.
            for (path, mode) in [("", 0o777), ("inner", 0o777), ("file", 0o666), ("script", 0o777)] {
                fs::set_permissions(folder.join(path), fs::Permissions::from_mode(mode))?;
            }
            listeners.push(UnixListener::bind(folder.join("stream"))?);
            datagrams.push(UnixDatagram::bind(folder.join("datagram"))?);
            for socket in ["stream", "datagram"] {
                fs::set_permissions(folder.join(socket), fs::Permissions::from_mode(0o777))?;
            }
        }
        let process = Command::new("sleep").arg("1000").stdin(Stdio::null()).spawn()?;
        let tcp = TcpListener::bind("127.0.0.1:0")?;
        let udp = UdpSocket::bind(("127.0.0.1", tcp.local_addr()?.port()))?;
        let key = 0x5452_0000 | (std::process::id() as i32 & 0xffff);
        // SAFETY: numbers go in and out.
        let (memory, queue, semaphores, terminal) = unsafe {
            (
                libc::shmget(key, 4096, libc::IPC_CREAT | 0o666),
                libc::msgget(key, libc::IPC_CREAT | 0o666),
                libc::semget(key, 1, libc::IPC_CREAT | 0o666),
                libc::posix_openpt(libc::O_RDWR | libc::O_NOCTTY),
            )
        };
        // SAFETY: the descriptor was opened above, and nobody else closes it; the name is read before another is asked for.
        let (terminal, name) = unsafe {
            libc::grantpt(terminal);
            libc::unlockpt(terminal);
            let name = std::ffi::CStr::from_ptr(libc::ptsname(terminal)).to_string_lossy().into_owned();
            (OwnedFd::from_raw_fd(terminal), name)
        };
        let targets = OutsideTargets {
            folders,
            process: process.id() as i32,
            host: std::process::id() as i32,
            memory,
            key,
            port: tcp.local_addr()?.port(),
            terminal: name.into(),
        };
        let sockets = (listeners, datagrams, tcp, udp);
        Ok(Outside { targets, process, _terminal: terminal, _sockets: sockets, queue, semaphores })
    }

    /// Whether who is in no sandbox reaches them, so that a refusal means something.
    fn check_reachable(&self) -> io::Result<()> {
        for folder in &self.targets.folders {
            fs::read(folder.join("file"))?;
            UnixStream::connect(folder.join("stream"))?;
            UnixDatagram::unbound()?.send_to(b"x", folder.join("datagram"))?;
        }
        TcpStream::connect(("127.0.0.1", self.targets.port))?;
        fs::OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_NOCTTY)
            .open(&self.targets.terminal)?;
        system_call(libc::SYS_kill, &[c_long::from(self.targets.process), 0])?;
        system_call(libc::SYS_shmget, &[c_long::from(self.targets.key), 0, 0])?;
        system_call(libc::SYS_msgget, &[c_long::from(self.targets.key), 0])?;
        Ok(())
    }

    /// What is no longer as it was.
    pub fn changes(&mut self) -> Vec<String> {
        let mut changes = Vec::new();
        for folder in &self.targets.folders {
            let mut names: Vec<String> = fs::read_dir(folder)
                .into_iter()
                .flatten()
                .flatten()
                .map(|entry| entry.file_name().to_string_lossy().into_owned())
                .collect();
            names.sort();
            if names != ["datagram", "file", "inner", "script", "stream"] {
                changes.push(format!("{} has {names:?}", folder.display()));
            }
            if fs::read_to_string(folder.join("file")).ok().as_deref() != Some(CONTENT) {
                changes.push(format!("{}: another content", folder.join("file").display()));
            }
            let mode = fs::metadata(folder.join("file")).map(|it| it.permissions().mode() & 0o777);
            if mode.ok() != Some(0o666) {
                changes.push(format!("{}: other rights", folder.join("file").display()));
            }
        }
        if !matches!(self.process.try_wait(), Ok(None)) {
            changes.push("the process has ended".to_owned());
        }
        changes
    }
}

impl Drop for Outside {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        for folder in &self.targets.folders {
            let _ = fs::remove_dir_all(folder);
        }
        // SAFETY: numbers go in, and nothing of this process is in that memory.
        unsafe {
            libc::shmctl(self.targets.memory, libc::IPC_RMID, std::ptr::null_mut());
            libc::msgctl(self.queue, libc::IPC_RMID, std::ptr::null_mut());
            libc::semctl(self.semaphores, 0, libc::IPC_RMID);
        }
    }
}

/// An attempt, and whether it succeeded.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Attempt {
    pub name: String,
    pub succeeded: bool,
}

#[derive(Default)]
struct Attempts(Vec<Attempt>);

impl Attempts {
    fn note(&mut self, name: impl Into<String>, succeeded: bool) {
        self.0.push(Attempt { name: name.into(), succeeded });
    }

    /// Succeeds where it gives something.
    fn works<T, E>(&mut self, name: impl Into<String>, outcome: Result<T, E>) {
        self.note(name, outcome.is_ok());
    }

    /// A system call that succeeds where it does not fail.
    fn call(&mut self, name: impl Into<String>, number: c_long, arguments: &[c_long]) {
        let outcome = system_call(number, arguments);
        self.note(name, outcome.is_ok());
    }

    /// A system call for which only whoever may not, or has no such call, is refused: its arguments are wrong for all others.
    fn privileged_call(&mut self, name: impl Into<String>, number: c_long, arguments: &[c_long]) {
        let refused = [libc::EPERM, libc::EACCES, libc::ENOSYS];
        let outcome = system_call(number, arguments);
        let is_refused =
            outcome.is_err_and(|error| error.raw_os_error().is_some_and(|it| refused.contains(&it)));
        self.note(name, !is_refused);
    }
}

fn system_call(number: c_long, arguments: &[c_long]) -> io::Result<c_long> {
    let at = |place: usize| arguments.get(place).copied().unwrap_or(0);
    // SAFETY: what the arguments point at lives as long as the attempt.
    match unsafe { libc::syscall(number, at(0), at(1), at(2), at(3), at(4), at(5)) } {
        -1 => Err(io::Error::last_os_error()),
        value => Ok(value),
    }
}

fn text(path: impl AsRef<Path>) -> CString {
    use std::os::unix::ffi::OsStrExt as _;
    CString::new(path.as_ref().as_os_str().as_bytes()).expect("no zero in a path")
}

fn address<T: ?Sized>(value: *const T) -> c_long {
    value.cast::<u8>() as c_long
}

/// Makes all attempts; `scratch` is the folder that may be written to.
pub fn try_everything(outside: &OutsideTargets, scratch: &Path) -> Vec<Attempt> {
    let mut attempts = Attempts::default();
    for folder in &outside.folders {
        try_files(&mut attempts, folder, scratch);
        try_routes(&mut attempts, folder, scratch, outside);
        try_local_sockets(&mut attempts, folder);
    }
    try_networks(&mut attempts, outside);
    try_processes(&mut attempts, outside);
    try_namespaces(&mut attempts, scratch);
    try_terminals(&mut attempts, outside);
    try_shared_memory(&mut attempts, outside);
    try_machine(&mut attempts, scratch);
    try_rights(&mut attempts);
    attempts.0
}

fn try_files(attempts: &mut Attempts, folder: &Path, scratch: &Path) {
    let (file, new) = (folder.join("file"), folder.join("new"));
    let (at, made, inner) = (text(&file), text(&new), text(folder.join("inner")));
    let (at, made, inner) = (address(at.as_ptr()), address(made.as_ptr()), address(inner.as_ptr()));
    let place = folder.display();
    attempts.works(format!("read {place}"), fs::read(&file));
    attempts.works(format!("look at {place}"), fs::metadata(&file));
    attempts.works(format!("list {place}"), fs::read_dir(folder));
    attempts.works(format!("enter {place}"), std::env::set_current_dir(folder));
    attempts.works(format!("write {place}"), fs::OpenOptions::new().write(true).open(&file));
    attempts.works(format!("append to {place}"), fs::OpenOptions::new().append(true).open(&file));
    attempts.works(format!("create in {place}"), fs::write(&new, "x"));
    attempts.works(format!("remove from {place}"), fs::remove_file(&file));
    attempts.works(format!("make a folder in {place}"), fs::create_dir(&new));
    attempts.works(format!("remove a folder from {place}"), fs::remove_dir(folder.join("inner")));
    attempts.works(format!("rename in {place}"), fs::rename(&file, &new));
    attempts.works(format!("move from {place}"), fs::rename(&file, scratch.join("moved")));
    let own = scratch.join("own");
    fs::write(&own, "mine").expect("a file in the scratch folder");
    attempts.works(format!("move to {place}"), fs::rename(&own, &new));
    attempts.works(format!("replace in {place}"), fs::rename(&own, &file));
    attempts.works(format!("link from {place}"), fs::hard_link(&file, scratch.join("linked")));
    attempts.works(format!("link to {place}"), fs::hard_link(&own, &new));
    attempts.works(format!("symbolic link in {place}"), symlink(&own, &new));
    attempts.works(format!("copy from {place}"), fs::copy(&file, scratch.join("copied")));
    attempts
        .works(format!("rights of {place}"), fs::set_permissions(&file, fs::Permissions::from_mode(0o600)));
    attempts.works(format!("run from {place}"), Command::new(folder.join("script")).status());
    let cwd = c_long::from(libc::AT_FDCWD);
    let open = |flags: i32| c_long::from(flags | libc::O_CLOEXEC);
    attempts.call(format!("truncate {place}"), libc::SYS_truncate, &[at, 0]);
    attempts.call(format!("owner of {place}"), libc::SYS_fchownat, &[cwd, at, -1, -1, 0]);
    attempts.call(format!("times of {place}"), libc::SYS_utimensat, &[cwd, at, 0, 0]);
    let (name, value) = (c"user.probe", c"x");
    let (name, value) = (address(name.as_ptr()), address(value.as_ptr()));
    attempts.call(format!("attribute of {place}"), libc::SYS_setxattr, &[at, name, value, 1, 0]);
    attempts.call(format!("attributes of {place}"), libc::SYS_listxattr, &[at, 0, 0]);
    attempts.call(format!("path of {place}"), libc::SYS_openat, &[cwd, at, open(libc::O_PATH)]);
    attempts.call(
        format!("unnamed file in {place}"),
        libc::SYS_openat,
        &[cwd, inner, open(libc::O_TMPFILE | libc::O_RDWR), 0o600],
    );
    attempts.call(
        format!("pipe in {place}"),
        libc::SYS_mknodat,
        &[cwd, made, c_long::from(libc::S_IFIFO | 0o600), 0],
    );
    attempts.call(format!("access of {place}"), libc::SYS_faccessat, &[cwd, at, 0]);
    let mut space = [0_u8; 512];
    attempts.call(format!("size of {place}"), libc::SYS_statfs, &[at, address(space.as_mut_ptr())]);
    // SAFETY: it makes a descriptor.
    let watch = unsafe { libc::inotify_init1(libc::IN_CLOEXEC) };
    attempts.call(format!("watch {place}"), libc::SYS_inotify_add_watch, &[c_long::from(watch), at, 0xfff]);
    let mut handle = [0_u8; 256];
    handle[0] = 128;
    let mut mount = 0_i32;
    let handle_of = [cwd, at, address(handle.as_mut_ptr()), address(&raw mut mount), 0];
    attempts.call(format!("handle of {place}"), libc::SYS_name_to_handle_at, &handle_of);
    attempts.privileged_call(format!("swap to {place}"), libc::SYS_swapon, &[made, 0]);
    attempts.privileged_call(format!("accounts in {place}"), libc::SYS_acct, &[inner]);
    attempts.works(format!("socket in {place}"), UnixListener::bind(&new));
}

/// Ways to a file besides its path.
fn try_routes(attempts: &mut Attempts, folder: &Path, scratch: &Path, outside: &OutsideTargets) {
    let inside = folder.strip_prefix("/").unwrap_or(folder).join("file");
    let place = folder.display();
    let link = scratch.join("link");
    let _ = fs::remove_file(&link);
    symlink(folder.join("file"), &link).expect("a link in the scratch folder");
    let mut routes =
        vec![link, scratch.join("../".repeat(20)).join(&inside), Path::new("/.old").join(&inside)];
    for process in ["1".to_owned(), "self".to_owned(), outside.host.to_string(), outside.process.to_string()]
    {
        routes.push(Path::new("/proc").join(&process).join("root").join(&inside));
        routes.push(Path::new("/proc").join(&process).join("cwd").join("../".repeat(20)).join(&inside));
    }
    for route in routes {
        let name = format!("read {place} by {}", route.display());
        attempts.works(name, fs::read(&route));
    }
}

fn try_local_sockets(attempts: &mut Attempts, folder: &Path) {
    let place = folder.display();
    attempts.works(format!("connect to {place}"), UnixStream::connect(folder.join("stream")));
    let datagram = UnixDatagram::unbound().expect("sockets of this machine");
    attempts.works(format!("send to {place}"), datagram.send_to(b"x", folder.join("datagram")));
    attempts.works(format!("connect datagrams to {place}"), datagram.connect(folder.join("datagram")));
    let is_socket = fs::metadata(folder.join("stream")).is_ok_and(|it| it.file_type().is_socket());
    attempts.note(format!("see a socket in {place}"), is_socket);
}

fn try_networks(attempts: &mut Attempts, outside: &OutsideTargets) {
    let kinds = [(libc::SOCK_STREAM, "stream"), (libc::SOCK_DGRAM, "datagram"), (libc::SOCK_RAW, "raw")];
    // By number, as older headers lack some: those of linux/socket.h.
    for family in 2..=45 {
        for (kind, name) in kinds {
            attempts.call(
                format!("{name} socket of family {family}"),
                libc::SYS_socket,
                &[family, c_long::from(kind), 0],
            );
        }
    }
    attempts.works("connect by TCP", TcpStream::connect(("127.0.0.1", outside.port)));
    attempts.works("listen by TCP", TcpListener::bind("127.0.0.1:0"));
    attempts.works("bind by UDP", UdpSocket::bind("127.0.0.1:0"));
    let pair = [0_i32; 2];
    attempts.call("pair of the Internet", libc::SYS_socketpair, &[2, 1, 0, address(pair.as_ptr())]);
}

fn try_processes(attempts: &mut Attempts, outside: &OutsideTargets) {
    for (who, process) in [("a process", outside.process), ("the host", outside.host)] {
        let id = c_long::from(process);
        // Of those that end a process only where that is one of the test's own.
        let signals: &[i32] = match who {
            "a process" => {
                &[0, libc::SIGTERM, libc::SIGKILL, libc::SIGSTOP, libc::SIGINT, libc::SIGHUP, libc::SIGUSR1]
            }
            _ => &[0, libc::SIGCONT],
        };
        for signal in signals {
            attempts.call(format!("signal {signal} to {who}"), libc::SYS_kill, &[id, c_long::from(*signal)]);
        }
        attempts.call(format!("thread signal to {who}"), libc::SYS_tgkill, &[id, id, 0]);
        attempts.call(format!("old thread signal to {who}"), libc::SYS_tkill, &[id, 0]);
        let mut information = [0_i32; 32];
        information[2] = -1;
        let queued = address(information.as_ptr());
        attempts.call(format!("queued signal to {who}"), libc::SYS_rt_sigqueueinfo, &[id, 0, queued]);
        attempts.call(format!("descriptor of {who}"), libc::SYS_pidfd_open, &[id, 0]);
        attempts.call(
            format!("trace {who}"),
            libc::SYS_ptrace,
            &[c_long::from(libc::PTRACE_SEIZE), id, 0, 0],
        );
        let mut byte = 0_u8;
        let vector = libc::iovec { iov_base: (&raw mut byte).cast(), iov_len: 1 };
        let vector = address(&raw const vector);
        attempts.privileged_call(
            format!("read memory of {who}"),
            libc::SYS_process_vm_readv,
            &[id, vector, 1, vector, 1, 0],
        );
        attempts.privileged_call(
            format!("write memory of {who}"),
            libc::SYS_process_vm_writev,
            &[id, vector, 1, vector, 1, 0],
        );
        attempts.call(format!("compare with {who}"), libc::SYS_kcmp, &[id, id, 0, 0, 0]);
        let mut limits = [0_u64; 2];
        let limits = address(limits.as_mut_ptr());
        attempts.call(format!("limits of {who}"), libc::SYS_prlimit64, &[id, 7, 0, limits]);
        attempts.call(format!("see the priority of {who}"), libc::SYS_getpriority, &[0, id]);
        attempts.call(format!("priority of {who}"), libc::SYS_setpriority, &[0, id, 0]);
        let mut set = [u64::MAX; 16];
        let set = address(set.as_mut_ptr());
        attempts.call(format!("processors of {who}"), libc::SYS_sched_setaffinity, &[id, 128, set]);
        attempts.call(format!("see the scheduler of {who}"), libc::SYS_sched_getscheduler, &[id]);
        let priority = 0_i32;
        let priority = address(&raw const priority);
        attempts.call(format!("scheduler of {who}"), libc::SYS_sched_setscheduler, &[id, 0, priority]);
        attempts.call(format!("input and output of {who}"), libc::SYS_ioprio_set, &[1, id, 0]);
        attempts.call(format!("group of {who}"), libc::SYS_getpgid, &[id]);
        attempts.call(format!("move to the group of {who}"), libc::SYS_setpgid, &[0, id]);
        attempts.call(format!("session of {who}"), libc::SYS_getsid, &[id]);
        attempts.call(format!("memory pages of {who}"), libc::SYS_migrate_pages, &[id, 0, 0, 0]);
        let events = [0_u8; 128];
        attempts.call(
            format!("count events of {who}"),
            libc::SYS_perf_event_open,
            &[address(events.as_ptr()), id, -1, -1, 0],
        );
        for file in ["mem", "maps", "environ", "cmdline", "status", "fd", "ns", "stack", "oom_score_adj"] {
            attempts
                .works(format!("/proc of {who}: {file}"), fs::File::open(format!("/proc/{process}/{file}")));
        }
    }
}

fn try_namespaces(attempts: &mut Attempts, scratch: &Path) {
    let spaces = [
        ("user", libc::CLONE_NEWUSER),
        ("mount", libc::CLONE_NEWNS),
        ("PID", libc::CLONE_NEWPID),
        ("IPC", libc::CLONE_NEWIPC),
        ("network", libc::CLONE_NEWNET),
        ("UTS", libc::CLONE_NEWUTS),
        ("cgroup", libc::CLONE_NEWCGROUP),
    ];
    for (name, flag) in spaces {
        attempts.call(format!("unshare a {name} namespace"), libc::SYS_unshare, &[c_long::from(flag)]);
        let flags = c_long::from(flag | libc::SIGCHLD);
        let child = system_call(libc::SYS_clone, &[flags, 0, 0, 0, 0]);
        if child.as_ref().is_ok_and(|it| *it == 0) {
            let _ = system_call(libc::SYS_exit_group, &[0]);
        }
        attempts.works(format!("clone into a {name} namespace"), child);
    }
    for name in ["user", "mnt", "pid", "ipc", "net", "uts", "cgroup"] {
        let Ok(space) = fs::File::open(format!("/proc/1/ns/{name}")) else {
            attempts.note(format!("enter {name}"), false);
            continue;
        };
        attempts.call(format!("enter {name}"), libc::SYS_setns, &[c_long::from(space.as_raw_fd()), 0]);
    }
    let (here, root, kind) = (text(scratch), c"/", c"tmpfs");
    let (here, root, kind) = (address(here.as_ptr()), address(root.as_ptr()), address(kind.as_ptr()));
    attempts.call("mount memory", libc::SYS_mount, &[kind, here, kind, 0, 0]);
    let flags = |flags: c_ulong| flags as c_long;
    attempts.call("mount a folder", libc::SYS_mount, &[root, here, 0, flags(libc::MS_BIND), 0]);
    let writable = flags(libc::MS_REMOUNT | libc::MS_BIND);
    attempts.call("mount the root anew", libc::SYS_mount, &[0, root, 0, writable, 0]);
    attempts.call("unmount", libc::SYS_umount2, &[root, c_long::from(libc::MNT_DETACH)]);
    attempts.call("change the root", libc::SYS_chroot, &[here]);
    attempts.call("turn the root", libc::SYS_pivot_root, &[here, here]);
    attempts.call("open a tree", libc::SYS_open_tree, &[c_long::from(libc::AT_FDCWD), root, 1]);
    attempts.call("open a file system", libc::SYS_fsopen, &[kind, 0]);
    let attributes = [0_u64; 4];
    let set = [c_long::from(libc::AT_FDCWD), root, 0, address(attributes.as_ptr()), 32];
    attempts.call("attributes of a mount", libc::SYS_mount_setattr, &set);
    for path in
        ["/probe", "/usr/probe", "/etc/probe", "/tmp/probe", "/proc/probe", "/sys/probe", "/dev/probe"]
    {
        attempts.works(format!("write {path}"), fs::write(path, "x"));
    }
}

fn try_terminals(attempts: &mut Attempts, outside: &OutsideTargets) {
    let key = b' ';
    for descriptor in 0..3 {
        let typed = [descriptor, libc::TIOCSTI as c_long, address(&raw const key)];
        attempts.call(format!("type into descriptor {descriptor}"), libc::SYS_ioctl, &typed);
        attempts.call(
            format!("take the terminal of descriptor {descriptor}"),
            libc::SYS_ioctl,
            &[descriptor, libc::TIOCSCTTY as c_long, 1],
        );
        let console = [descriptor, libc::TIOCLINUX as c_long, address(&raw const key)];
        attempts.call(format!("console by descriptor {descriptor}"), libc::SYS_ioctl, &console);
    }
    let paths = ["/dev/tty", "/dev/ptmx", "/dev/console", "/dev/tty0", "/dev/tty1", "/dev/ttyS0"];
    for path in paths.into_iter().map(Path::new).chain([outside.terminal.as_path()]) {
        attempts.works(
            format!("open {}", path.display()),
            fs::OpenOptions::new().read(true).write(true).open(path),
        );
    }
}

fn try_shared_memory(attempts: &mut Attempts, outside: &OutsideTargets) {
    let (key, memory) = (c_long::from(outside.key), c_long::from(outside.memory));
    attempts.call("find shared memory", libc::SYS_shmget, &[key, 0, 0]);
    attempts.call("attach shared memory", libc::SYS_shmat, &[memory, 0, 0]);
    let mut state = [0_u8; 256];
    let state = address(state.as_mut_ptr());
    attempts.call("state of shared memory", libc::SYS_shmctl, &[memory, c_long::from(libc::IPC_STAT), state]);
    attempts.call("find a queue", libc::SYS_msgget, &[key, 0]);
    attempts.call("find semaphores", libc::SYS_semget, &[key, 0, 0]);
    // The line to the host, which is mapped in this process.
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let lines: Vec<&str> = maps.lines().filter(|line| line.contains("memfd:trackside")).collect();
    attempts.note("lose the line to the host", lines.is_empty());
    for line in lines {
        let range = line.split(' ').next().unwrap_or_default();
        let path = Path::new("/proc/self/map_files").join(range);
        let truncated = fs::OpenOptions::new().write(true).open(&path).and_then(|file| file.set_len(0));
        attempts.works(format!("truncate {}", path.display()), truncated);
    }
}

fn try_machine(attempts: &mut Attempts, scratch: &Path) {
    // The time of now and the name of now: they change nothing.
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the time is written to memory of this function.
    unsafe { libc::clock_gettime(libc::CLOCK_REALTIME, &raw mut now) };
    attempts.call("set the clock", libc::SYS_clock_settime, &[0, address(&raw const now)]);
    let day = libc::timeval { tv_sec: now.tv_sec, tv_usec: now.tv_nsec / 1000 };
    attempts.call("set the day", libc::SYS_settimeofday, &[address(&raw const day), 0]);
    let mut adjustment = [0_u8; 512];
    let adjustment = address(adjustment.as_mut_ptr());
    attempts.call("adjust the clock", libc::SYS_clock_adjtime, &[0, adjustment]);
    let mut name = [0_u8; 256];
    // SAFETY: the name is written to memory of this function.
    unsafe { libc::gethostname(name.as_mut_ptr().cast(), name.len()) };
    let length = name.iter().position(|byte| *byte == 0).unwrap_or(0) as c_long;
    attempts.call("name the host", libc::SYS_sethostname, &[address(name.as_ptr()), length]);
    attempts.call("name the domain", libc::SYS_setdomainname, &[address(c"(none)".as_ptr()), 6]);
    attempts.call("read the log of the kernel", libc::SYS_syslog, &[10, 0, 0]);
    let nothing = [0_u8; 128];
    let nothing = address(nothing.as_ptr());
    attempts.privileged_call("load a module", libc::SYS_init_module, &[nothing, 0, nothing]);
    attempts.privileged_call("load a module of a file", libc::SYS_finit_module, &[-1, nothing, 0]);
    attempts.privileged_call("unload a module", libc::SYS_delete_module, &[address(c"none".as_ptr()), 0]);
    attempts.privileged_call("load a kernel", libc::SYS_kexec_load, &[0, 0, 0, 0]);
    attempts.privileged_call("program of the kernel", libc::SYS_bpf, &[5, nothing, 128]);
    attempts.call("faults of memory", libc::SYS_userfaultfd, &[0]);
    attempts.privileged_call("rings", libc::SYS_io_uring_setup, &[1, nothing]);
    attempts.privileged_call("keys", libc::SYS_keyctl, &[0, -4, 1]);
    attempts.privileged_call("new key", libc::SYS_add_key, &[nothing, nothing, 0, 0, -4]);
    attempts.privileged_call("wanted key", libc::SYS_request_key, &[nothing, nothing, 0, 0]);
    attempts.privileged_call("quota", libc::SYS_quotactl, &[0, nothing, 0, 0]);
    attempts.privileged_call("hang up", libc::SYS_vhangup, &[]);
    attempts.privileged_call("watch all files", libc::SYS_fanotify_init, &[0x0c, 0]);
    attempts.privileged_call("open by handle", libc::SYS_open_by_handle_at, &[-1, nothing, 0]);
    attempts.privileged_call("no more swap", libc::SYS_swapoff, &[nothing]);
    #[cfg(target_arch = "x86_64")]
    for (name, number, arguments) in
        [("ports", libc::SYS_iopl, [3, 0]), ("some ports", libc::SYS_ioperm, [0x80, 1])]
    {
        attempts.privileged_call(name, number, &arguments);
    }
    for path in [
        "/dev/mem",
        "/dev/kmsg",
        "/dev/port",
        "/dev/kvm",
        "/dev/fuse",
        "/dev/net/tun",
        "/dev/sda",
        "/dev/vda",
        "/dev/loop-control",
        "/dev/cpu_dma_latency",
        "/proc/kcore",
        "/proc/kmsg",
        "/etc/shadow",
        "/root",
        "/home",
        "/run",
        "/var/run/docker.sock",
        "/sys/kernel",
        "/sys/class",
    ] {
        attempts.works(format!("open {path}"), fs::File::open(path));
    }
    for path in [
        "/proc/sysrq-trigger",
        "/proc/sys/kernel/hostname",
        "/proc/sys/kernel/core_pattern",
        "/proc/sys/kernel/pid_max",
        "/proc/sys/vm/drop_caches",
        "/sys/devices/system/cpu/cpu1/online",
        "/proc/self/oom_score_adj",
        "/proc/self/uid_map",
    ] {
        attempts.works(format!("write {path}"), fs::OpenOptions::new().write(true).open(path));
    }
    for (name, kind, device) in
        [("memory", libc::S_IFCHR, 0x101), ("disk", libc::S_IFBLK, 0x800), ("zero", libc::S_IFCHR, 0x105)]
    {
        let path = text(scratch.join(name));
        let node = [c_long::from(libc::AT_FDCWD), address(path.as_ptr()), c_long::from(kind | 0o666), device];
        attempts.call(format!("device for {name}"), libc::SYS_mknodat, &node);
    }
}

fn try_rights(attempts: &mut Attempts) {
    let header = [0x2008_0522_u32, 0];
    let all = [0xffff_ffff_u32; 6];
    attempts.call("all capabilities", libc::SYS_capset, &[address(header.as_ptr()), address(all.as_ptr())]);
    for user in [1, 2, 1000] {
        attempts.call(format!("user {user}"), libc::SYS_setuid, &[user]);
        attempts.call(format!("group {user}"), libc::SYS_setgid, &[user]);
    }
    attempts.call("no groups", libc::SYS_setgroups, &[0, 0]);
    attempts.call("secure bits", libc::SYS_prctl, &[28, 0]);
    for (name, resource) in [("memory", 2), ("processes", 6), ("files", 1), ("cores", 4)] {
        let most = [u64::MAX; 2];
        attempts.call(format!("more {name}"), libc::SYS_setrlimit, &[resource, address(most.as_ptr())]);
    }
    let _ = io::stdout().flush();
}

/// What a probe found.
pub struct ProbeReport {
    /// Mechanisms that this machine lacks.
    pub missing: Vec<String>,
    pub attempts: Vec<Attempt>,
    /// What it changed outside.
    pub changes: Vec<String>,
}

/// The word by which this program is told to be the probe.
pub const PROBE: &str = "probe";

/// Starts this program again as a guest in a sandbox, as the user of this number if there is one, and lets it try everything.
pub fn run_probe(user: Option<u32>) -> io::Result<ProbeReport> {
    let base = std::env::temp_dir();
    let mut outside = Outside::new(&base)?;
    outside.check_reachable()?;
    let scratch = base.join(format!("trackside-scratch-{}", std::process::id()));
    fs::create_dir_all(&scratch)?;
    fs::set_permissions(&scratch, fs::Permissions::from_mode(0o777))?;
    let mut command = Command::new(std::env::current_exe()?);
    command.arg(PROBE).arg(&scratch).arg(serde_json::to_string(&outside.targets)?).current_dir(&scratch);
    if let Some(user) = user {
        command.uid(user).gid(user);
    }
    let mut guest = IsolatedGuest::start(command, 0, Some(|_, _| ()))?;
    let mut answer = ChannelPacket::default();
    let mut ask = |question: &[u8]| match guest.request_answer(&[], question, &mut answer, |_| false) {
        Ok(()) => Ok(std::mem::take(&mut answer.bytes)),
        Err(end) => Err(io::Error::other(format!("the probe: {end}"))),
    };
    let missing = serde_json::from_slice(&ask(b"enter")?)?;
    let attempts = serde_json::from_slice(&ask(b"try")?)?;
    guest.shut_down(b"leave");
    let changes = outside.changes();
    fs::remove_dir_all(&scratch)?;
    Ok(ProbeReport { missing, attempts, changes })
}

/// The life of the probe: it enters the sandbox, and tries everything, when it is told to.
pub fn serve_as_probe(mut words: impl Iterator<Item = String>) {
    let mut word = || words.next().expect("a scratch folder, targets and a host");
    let scratch = PathBuf::from(word());
    let targets: OutsideTargets = serde_json::from_str(&word()).expect("targets");
    let host = word().parse().expect("a number");
    let (channel, _) = connect_to_host_process(host).expect("a host");
    let look = || if is_host_alive(host) { Ok(()) } else { Err("the host is gone") };
    let mut packet = ChannelPacket::default();
    loop {
        channel.receive(&mut packet, look).expect("a question");
        let answer = match packet.bytes.as_slice() {
            b"enter" => {
                let write = vec![scratch.clone()];
                let mechanisms = enter_sandbox(&Sandbox { write, ..Sandbox::default() });
                let missing: Vec<String> =
                    mechanisms.iter().filter_map(ProtectionMechanism::warning).collect();
                serde_json::to_vec(&missing)
            }
            b"try" => serde_json::to_vec(&try_everything(&targets, &scratch)),
            _ => return,
        };
        channel.send(&[], &answer.expect("text"), look).expect("a host");
    }
}
