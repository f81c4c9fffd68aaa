//! The file format of checkpoints: a file that is truncated, changed or forged is an error.

use std::path::Path;

use assessment::check::CheckState;
use cosim::checkpoint::Checkpoint;
use diagnostics::Error;
use fmu_import::sha256_hex;
use serde::{Deserialize, Serialize};

use crate::nofollow;

/// The first bytes of a file, with the version of what follows.
const HEAD: &[u8] = b"trackside checkpoint 2\n";
/// The first bytes of all versions.
const ANY_HEAD: &[u8] = b"trackside checkpoint ";
/// The hash of the rest follows, as text.
const HASH: usize = 64;
/// More than any memory that a state is in [B].
const LARGEST: u64 = 64 << 30;

/// A run at a communication point: its system, and its checks.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RunCheckpoint {
    pub system: Checkpoint,
    /// What the checks remember.
    pub checks: Vec<CheckState>,
}

/// Writes a checkpoint; a file of that name gives way once the new one is whole.
///
/// # Errors
/// When it cannot be written.
pub(crate) fn write_checkpoint(path: &Path, checkpoint: &RunCheckpoint) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::output_failure(path, error);
    let content =
        postcard::to_stdvec(checkpoint).map_err(|error| failed(std::io::Error::other(error.to_string())))?;
    let bytes = [HEAD, sha256_hex(&content).as_bytes(), &content].concat();
    let beside = path.with_extension("state.partial");
    let written =
        nofollow::write_without_following_links(&beside, bytes).and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|error| {
        let _ = std::fs::remove_file(&beside);
        failed(error)
    })
}

/// Reads a checkpoint.
///
/// # Errors
/// When it cannot be read, or is none.
pub(crate) fn read_checkpoint(path: &Path) -> Result<RunCheckpoint, Error> {
    let place = path.display();
    let bytes = diagnostics::read_bounded(path, LARGEST)
        .map_err(|error| Error::invalid_input(format!("--resume {place}: {error}")))?;
    let wrong = |what: &str| Error::invalid_input(format!("--resume {place}: {what}"));
    let Some(rest) = bytes.strip_prefix(HEAD) else {
        let error = match bytes.starts_with(ANY_HEAD) {
            true => wrong("it is a checkpoint of another version of trackside"),
            false => wrong("it is no checkpoint"),
        };
        return Err(error.with_help(
            "expected a file that `trackside run SCENARIO --checkpoint TIME` of this version wrote",
        ));
    };
    let hash_and_content = rest.split_at_checked(HASH);
    let content = hash_and_content.filter(|(hash, content)| *hash == sha256_hex(content).as_bytes());
    let Some((_, content)) = content else {
        return Err(wrong("it is cut short or changed: its bytes do not have the SHA-256 that it states")
            .with_help("copy it once more, or write it again with --checkpoint"));
    };
    postcard::from_bytes(content)
        .map_err(|error| wrong(&format!("it is no checkpoint that a run wrote: {error}")))
}
