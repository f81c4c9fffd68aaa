//! Makes the folder that Wine keeps its Windows in, once for each Wine, and gives each process of this program a copy of its registry.
//!
//! Wine has one server for a prefix. With a prefix of its own a run has a server of its own, which nobody else ends, and what FMUs write
//! into the registry is gone after it.

use std::fs::{self, File};
use std::io::{self, Write as _, stderr};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::UNIX_EPOCH;

use archive::TemporaryFolder;

use super::{has_libraries_of_32_bits, wine_command};
use crate::cache_folder::cache_folder;

/// The file that says that a prefix is whole.
const COMPLETE: &str = "trackside-complete";

/// A prefix with a registry of its own and the files of the one in the cache folder.
#[derive(Debug)]
pub(super) struct SessionPrefix {
    folder: TemporaryFolder,
}

impl SessionPrefix {
    /// The one of this process, as long as somebody uses it.
    ///
    /// # Errors
    /// In a sentence, when it cannot be made.
    pub fn of_process(wine: &Path) -> Result<Arc<Self>, String> {
        static CURRENT: Mutex<Weak<SessionPrefix>> = Mutex::new(Weak::new());
        let mut current = CURRENT.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(session) = current.upgrade() {
            return Ok(session);
        }
        let whole = find_or_make(wine)?;
        let failed =
            |error: io::Error| format!("the Wine prefix {} cannot be copied: {error}", whole.display());
        let session = Self::copy_registry(&whole).map(Arc::new).map_err(failed)?;
        *current = Arc::downgrade(&session);
        Ok(session)
    }

    fn copy_registry(whole: &Path) -> io::Result<Self> {
        let session = SessionPrefix { folder: TemporaryFolder::new()? };
        let to = session.path();
        for file in ["system.reg", "user.reg", "userdef.reg", ".update-timestamp"] {
            fs::copy(whole.join(file), to.join(file))?;
        }
        symlink(whole.join("drive_c"), to.join("drive_c"))?;
        let drives = to.join("dosdevices");
        fs::create_dir(&drives)?;
        symlink("../drive_c", drives.join("c:"))?;
        symlink("/", drives.join("z:"))?;
        Ok(session)
    }

    pub fn path(&self) -> &Path {
        self.folder.folder_path()
    }
}

/// The prefix for this Wine in the cache folder.
fn find_or_make(wine: &Path) -> Result<PathBuf, String> {
    let cache = cache_folder()?;
    // Another Wine would change its contents at its first start.
    let changed = fs::metadata(wine).and_then(|file| file.modified()).unwrap_or(UNIX_EPOCH);
    let version = changed.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let wide = if has_libraries_of_32_bits() { "-with-32-bits" } else { "" };
    let prefix = cache.join(format!("wine-{version:x}{wide}"));
    let complete = prefix.join(COMPLETE);
    if complete.is_file() {
        return Ok(prefix);
    }
    let failed = |what: String| format!("the Wine prefix {} cannot be made: {what}", prefix.display());
    // Another run may be about to make it.
    let lock = File::create(cache.join("wine.lock")).map_err(|error| failed(error.to_string()))?;
    lock.lock().map_err(|error| failed(error.to_string()))?;
    if complete.is_file() {
        return Ok(prefix);
    }
    // Where nobody takes it, the prefix is made all the same.
    let _ = writeln!(stderr(), "makes the Wine prefix {}, once: this takes some seconds", prefix.display());
    let mut boot = wine_command(wine, &prefix, "winemenubuilder.exe=d;mscoree,mshtml=");
    boot.args(["wineboot.exe", "--init"]).stdin(Stdio::null()).stdout(Stdio::null());
    let made = boot.output().map_err(|error| failed(error.to_string()))?;
    if !made.status.success() {
        let said = String::from_utf8_lossy(&made.stderr);
        let said = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("Wine says nothing");
        return Err(failed(format!("{}: {}", made.status, said.trim())));
    }
    File::create(&complete).map_err(|error| failed(error.to_string()))?;
    Ok(prefix)
}
