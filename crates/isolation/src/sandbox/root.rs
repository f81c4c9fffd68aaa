//! Gives a process a root of its own, in which there is what it may read, and nothing else: what is not there has no sockets and no attributes.
#![expect(unsafe_code, reason = "mounting attributes")]

use std::ffi::CString;
use std::fs;
use std::io::{self, Error};
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Component, Path, PathBuf};

use rustix::mount::{
    MountFlags, MountPropagationFlags, UnmountFlags, mount, mount_bind_recursive, mount_change,
    mount_remount, unmount,
};
use rustix::process::{chdir, pivot_root};

use super::Sandbox;
use super::files::{CODE, DEVICES, SHARED_MEMORY, library_folders};

/// A folder of every system, on which the new root lies until it is the root.
const PLACE: &str = "/tmp";
/// The old root while the new one is built.
const OLD: &str = "/.old";

/// Settings that libraries ask for: none of them has a secret.
const SETTINGS: [&str; 14] = [
    "/etc/alternatives",
    "/etc/fonts",
    "/etc/group",
    "/etc/host.conf",
    "/etc/hosts",
    "/etc/ld.so.cache",
    "/etc/ld.so.conf",
    "/etc/ld.so.conf.d",
    "/etc/localtime",
    "/etc/mime.types",
    "/etc/nsswitch.conf",
    "/etc/os-release",
    "/etc/passwd",
    "/etc/timezone",
];
/// What the kernel says of processors.
const PROCESSORS: &str = "/sys/devices/system/cpu";

/// Whether what lies there may be changed, and whether devices work there.
#[derive(Clone, Copy, PartialEq)]
enum MountAccess {
    Read,
    Write,
    Device,
}

pub(super) fn enter_own_root(sandbox: &Sandbox) -> io::Result<()> {
    let here = std::env::current_dir()?;
    // Nothing that is mounted from here on is seen elsewhere.
    mount_change("/", MountPropagationFlags::REC | MountPropagationFlags::PRIVATE)?;
    let plain = MountFlags::NOSUID | MountFlags::NODEV;
    mount("tmpfs", PLACE, "tmpfs", plain, c"size=1m,mode=755")?;
    let old = format!("{PLACE}{OLD}");
    fs::create_dir(&old)?;
    pivot_root(PLACE, &old)?;
    chdir("/")?;
    // Before the files, which may lie in the folder of that name.
    fs::create_dir_all(SHARED_MEMORY)?;
    mount("tmpfs", SHARED_MEMORY, "tmpfs", plain, c"size=256m,mode=1777")?;
    let code = CODE.iter().map(PathBuf::from).chain(library_folders());
    let settings = SETTINGS.iter().copied().chain([PROCESSORS]).map(PathBuf::from);
    for path in code.chain(settings).chain(sandbox.read.iter().cloned()) {
        show(&path, MountAccess::Read)?;
    }
    DEVICES.iter().try_for_each(|path| show(Path::new(path), MountAccess::Device))?;
    sandbox.write.iter().try_for_each(|path| show(path, MountAccess::Write))?;
    fs::create_dir("/proc")?;
    mount("proc", "/proc", "proc", plain | MountFlags::NOEXEC, None::<&std::ffi::CStr>)?;
    fs::create_dir_all(PLACE)?;
    unmount(OLD, UnmountFlags::DETACH)?;
    fs::remove_dir(OLD)?;
    mount_remount("/", plain | MountFlags::RDONLY, c"size=1m,mode=755")?;
    // What is not shown cannot be the working folder.
    chdir(&here).or_else(|_| chdir("/"))?;
    Ok(())
}

/// Where a path of the old root is now.
fn old_path(path: &Path) -> PathBuf {
    Path::new(OLD).join(path.strip_prefix("/").unwrap_or(path))
}

/// Shows in the new root what lies at a path of the old one; what is not there is not shown. A link is shown as one, with what it leads to.
fn show(path: &Path, access: MountAccess) -> io::Result<()> {
    let mut done = PathBuf::from("/");
    let mut rest: Vec<_> = path.components().skip(1).collect();
    rest.reverse();
    while let Some(part) = rest.pop() {
        let Component::Normal(name) = part else {
            // Links were followed up to here, so `..` leads back.
            if part == Component::ParentDir {
                done.pop();
            }
            continue;
        };
        let next = done.join(name);
        let Ok(found) = old_path(&next).symlink_metadata() else { return Ok(()) };
        if found.is_symlink() {
            let target = fs::read_link(old_path(&next))?;
            match std::os::unix::fs::symlink(&target, &next) {
                // What is shown with a folder has its links.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                made => made?,
            }
            let there = rest.iter().rev().fold(done.join(target), |path, part| path.join(part));
            return show(&there, access);
        }
        if next.symlink_metadata().is_err() {
            match (rest.is_empty(), found.is_dir()) {
                (true, false) => drop(fs::File::create_new(&next)?),
                _ => fs::create_dir(&next)?,
            }
        }
        done = next;
    }
    if done == Path::new("/") {
        let all = fs::read_dir(OLD)?;
        return all.flatten().try_for_each(|found| show(&Path::new("/").join(found.file_name()), access));
    }
    mount_bind_recursive(old_path(&done), &done)?;
    restrict_mount(&done, access)
}

/// Sets what may be done with a mount and all below it.
fn restrict_mount(path: &Path, access: MountAccess) -> io::Result<()> {
    let mut attributes = libc::MOUNT_ATTR_NOSUID;
    if access == MountAccess::Read {
        attributes |= libc::MOUNT_ATTR_RDONLY;
    }
    if access != MountAccess::Device {
        attributes |= libc::MOUNT_ATTR_NODEV;
    }
    let set = libc::mount_attr { attr_set: attributes, attr_clr: 0, propagation: 0, userns_fd: 0 };
    let path = CString::new(path.as_os_str().as_bytes())?;
    // SAFETY: the path and the attributes live until the call returns.
    let outcome = unsafe {
        libc::syscall(
            libc::SYS_mount_setattr,
            libc::AT_FDCWD,
            path.as_ptr(),
            libc::AT_RECURSIVE,
            &raw const set,
            size_of::<libc::mount_attr>(),
        )
    };
    match outcome {
        0 => Ok(()),
        _ => Err(Error::last_os_error()),
    }
}
