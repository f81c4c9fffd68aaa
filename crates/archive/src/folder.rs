//! Makes temporary folders, such as those of unpacked archives, and removes those that a process left behind when it died.

use std::fs::Permissions;
use std::fs::{DirEntry, File};
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::sync::Once;
use std::time::Duration;

use tempfile::{Builder, TempDir};

/// What all of them are called at the beginning.
const PREFIX: &str = "trackside-unpacked-";
/// The file in each of them that its process holds locked: the system lets go of it however the process ends.
const LOCK: &str = ".in-use";
/// A folder is locked as soon as it is made: one without a lock that is older was left by a process that died in between.
const YOUNG: Duration = Duration::from_secs(60);

/// A folder that is removed when it is dropped, or by another process after this one died.
#[derive(Debug)]
pub struct TemporaryFolder {
    folder: TempDir,
    _lock: File,
}

impl TemporaryFolder {
    /// A new folder; those that nobody uses any more are removed the first time.
    ///
    /// # Errors
    /// When the system does not make one.
    pub fn new() -> io::Result<Self> {
        static SWEPT: Once = Once::new();
        let parent = std::env::temp_dir();
        SWEPT.call_once(|| remove_stale_folders(&parent));
        Self::new_in(&parent).map_err(|error| temporary_write_error(&parent, error))
    }

    fn new_in(parent: &Path) -> io::Result<Self> {
        // Nobody else has a business in it; the temporary folder is everybody's.
        let private = Permissions::from_mode(0o700);
        let folder = Builder::new().prefix(PREFIX).permissions(private).tempdir_in(parent)?;
        // It gets its name once it is locked: until then nobody else can tell whether the folder is in use.
        let (fresh, name) = (folder.path().join(".locking"), folder.path().join(LOCK));
        let lock = File::create(&fresh)?;
        lock.lock()?;
        std::fs::rename(fresh, name)?;
        Ok(TemporaryFolder { folder, _lock: lock })
    }

    /// Where it is.
    #[must_use]
    pub fn folder_path(&self) -> &Path {
        self.folder.path()
    }
}

/// A temporary file without a name, which vanishes when it is closed.
///
/// # Errors
/// When the system does not make one.
pub fn unnamed_temporary_file() -> io::Result<File> {
    tempfile::tempfile().map_err(|error| temporary_write_error(&std::env::temp_dir(), error))
}

/// An error of writing to a temporary folder or below, with what to do about it.
#[must_use]
pub fn temporary_write_error(folder: &Path, error: io::Error) -> io::Error {
    let cure = match error.kind() {
        ErrorKind::NotFound => "name a folder that exists",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "make room there, or name a folder on a larger disk"
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "name a folder that you may write to",
        ErrorKind::NotADirectory if !folder.is_dir() => "name a folder",
        // It may be the archive's fault, such as a name that is too long.
        _ => "",
    };
    let cure = match std::env::var_os("TMPDIR") {
        _ if cure.is_empty() => String::new(),
        Some(_) => format!("; the environment variable TMPDIR names it: {cure}"),
        None => format!("; {cure} in the environment variable TMPDIR"),
    };
    let folder = folder.display();
    let text = format!("cannot write to the temporary folder {folder}: {error}{cure}");
    io::Error::new(error.kind(), text)
}

/// Removes the folders of dead processes. What cannot be removed, since it is somebody else's for example, stays.
fn remove_stale_folders(parent: &Path) {
    for entry in std::fs::read_dir(parent).into_iter().flatten().flatten() {
        let ours = entry.file_name().to_string_lossy().starts_with(PREFIX);
        // Not through a link, which may lead anywhere.
        if !ours || !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let unused = match File::open(entry.path().join(LOCK)) {
            Ok(lock) => lock.try_lock().is_ok(),
            Err(error) => error.kind() == ErrorKind::NotFound && is_stale(&entry),
        };
        if unused {
            drop(std::fs::remove_dir_all(entry.path()));
        }
    }
}

fn is_stale(entry: &DirEntry) -> bool {
    let modified = entry.metadata().and_then(|metadata| metadata.modified());
    modified.is_ok_and(|time| time.elapsed().is_ok_and(|age| age > YOUNG))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_the_dead_are_removed_and_no_others() {
        let parent = TempDir::new().expect("a folder");
        let alive = TemporaryFolder::new_in(parent.path()).expect("a folder");
        let mode = std::fs::metadata(alive.folder_path()).expect("a folder").permissions().mode();
        assert_eq!(mode & 0o777, 0o700);
        let TemporaryFolder { folder, _lock: lock } =
            TemporaryFolder::new_in(parent.path()).expect("a folder");
        let dead = folder.keep();
        drop(lock);
        let unlocked = parent.path().join(format!("{PREFIX}young"));
        let forgotten = parent.path().join(format!("{PREFIX}old"));
        let foreign = parent.path().join("trackside-notes");
        for path in [&unlocked, &forgotten, &foreign] {
            std::fs::create_dir(path).expect("a folder");
        }
        for path in [&forgotten, &foreign] {
            let long_ago = std::time::SystemTime::now() - 2 * YOUNG;
            File::open(path).and_then(|folder| folder.set_modified(long_ago)).expect("its time");
        }
        remove_stale_folders(parent.path());
        assert!(!dead.exists() && !forgotten.exists());
        assert!([alive.folder_path(), &unlocked, &foreign].iter().all(|path| path.is_dir()));
    }
}
