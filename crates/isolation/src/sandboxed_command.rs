//! Starts commands of others in a sandbox, by way of this program, which enters it and goes on as the command.

use std::ffi::OsString;
use std::io;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use crate::sandbox::{ProtectionMechanism, Sandbox, enter_sandbox};

/// The words of this program before a [`Sandbox`] in JSON and a command.
static ENTRANCE: OnceLock<Vec<OsString>> = OnceLock::new();

/// Says how this program is started to call [`become_sandboxed_command`]: `program` with these arguments, a [`Sandbox`] in JSON, `--`, and the command.
pub fn set_sandbox_entrance(program: PathBuf, arguments: &[&str]) {
    let arguments = arguments.iter().map(OsString::from);
    // Another one cannot come: a program has one entrance.
    let _ = ENTRANCE.set([program.into_os_string()].into_iter().chain(arguments).collect());
}

/// The words before those of a command that put it into the sandbox.
///
/// # Errors
/// When this process is not of a program that called [`set_sandbox_entrance`].
pub fn sandbox_entrance(sandbox: &Sandbox) -> io::Result<Vec<OsString>> {
    let missing =
        || io::Error::new(io::ErrorKind::Unsupported, "this program cannot put others into a sandbox");
    let entrance = ENTRANCE.get().ok_or_else(missing)?;
    let sandbox = serde_json::to_string(sandbox)?;
    Ok(entrance.iter().cloned().chain([sandbox.into(), "--".into()]).collect())
}

/// Enters the sandbox, hands over the mechanisms of it, and goes on as the command; returns when that does not start.
///
/// # Errors
/// Why it does not start, or the sandbox has no meaning.
pub fn become_sandboxed_command(
    sandbox: &str,
    command: &[OsString],
    entered: impl FnOnce(&[ProtectionMechanism]),
) -> io::Error {
    let sandbox: Sandbox = match serde_json::from_str(sandbox) {
        Ok(sandbox) => sandbox,
        Err(error) => return error.into(),
    };
    let Some((program, arguments)) = command.split_first() else {
        return io::Error::new(io::ErrorKind::InvalidInput, "expected a command, found none");
    };
    entered(&enter_sandbox(&sandbox));
    Command::new(program).args(arguments).exec()
}
