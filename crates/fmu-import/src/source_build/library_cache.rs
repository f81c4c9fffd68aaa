//! Keeps compiled libraries in the user's cache folder: one process compiles, others wait for it and take what it made.

use std::fs::{File, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use crate::cache_folder::cache_folder;
use crate::sha256_hex;

/// A folder of libraries.
pub(super) struct LibraryCache(PathBuf);

impl LibraryCache {
    /// Makes the folder if it is not there.
    ///
    /// # Errors
    /// In words, when the user has none, or it cannot be written to.
    pub fn open() -> Result<Self, String> {
        let folder = cache_folder()?.join("fmu-libraries");
        let cannot = |error: io::Error| format!("cannot write to {}: {error}", folder.display());
        // What lies in it is code that will run.
        std::fs::DirBuilder::new().recursive(true).mode(0o700).create(&folder).map_err(cannot)?;
        let probe = unique_name(&folder.join("probe"));
        File::create(&probe).and_then(|_| std::fs::remove_file(&probe)).map_err(cannot)?;
        Ok(LibraryCache(folder))
    }

    /// The library of this key, and whether `build` has just made it.
    ///
    /// # Errors
    /// Of `build`, or of the folder.
    pub fn find_or_build<E: From<io::Error>>(
        &self,
        key: &str,
        build: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(PathBuf, bool), E> {
        if let Some(library) = self.find(key) {
            return Ok((library, false));
        }
        let lock_path = self.0.join(format!("{key}.lock"));
        let lock = File::create(&lock_path)?;
        // A folder on a network may have no locks: then two processes make the same library, and the later one stays.
        let _ = lock.lock();
        if let Some(library) = self.find(key) {
            return Ok((library, false));
        }
        let fresh = unique_name(&self.0.join(key));
        let built = build(&fresh).and_then(|()| Ok(self.move_into_place(&fresh, key)?));
        let _ = std::fs::remove_file(&fresh);
        let _ = std::fs::remove_file(&lock_path);
        built.map(|library| (library, true))
    }

    /// The library of a key whose contents are those that its name tells: a damaged one would end the process that loads it.
    fn find(&self, key: &str) -> Option<PathBuf> {
        let paths = std::fs::read_dir(&self.0).ok()?.flatten().map(|entry| entry.path());
        let mut own = paths.filter(|path| {
            path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(key.as_bytes()))
        });
        own.find(|path| library_name(key, path).is_ok_and(|name| path.ends_with(name)))
    }

    /// Gives a library that is complete its name: whoever finds it there finds all of it.
    fn move_into_place(&self, fresh: &Path, key: &str) -> io::Result<PathBuf> {
        std::fs::set_permissions(fresh, Permissions::from_mode(0o700))?;
        File::open(fresh)?.sync_all()?;
        let library = self.0.join(library_name(key, fresh)?);
        std::fs::rename(fresh, &library)?;
        Ok(library)
    }
}

/// The name of the library at `path`, by its key and its contents.
fn library_name(key: &str, path: &Path) -> io::Result<String> {
    let digest = sha256_hex(&std::fs::read(path)?);
    Ok(format!("{key}-{}.{}", &digest[..16], std::env::consts::DLL_EXTENSION))
}

/// Makes a library that is not kept where the loader takes it from.
///
/// # Errors
/// Of `build`, or of the folder.
pub(super) fn make_library<E: From<io::Error>>(
    library: &Path,
    build: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    if let Some(folder) = library.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let fresh = unique_name(library);
    build(&fresh)?;
    Ok(std::fs::rename(fresh, library)?)
}

/// Copies a library to where the loader takes it from.
///
/// # Errors
/// Of the folder.
pub(super) fn copy_library(from: &Path, to: &Path) -> io::Result<()> {
    make_library(to, |fresh| std::fs::copy(from, fresh).map(drop))
}

/// A name beside that of a file, which no other process or thread uses.
fn unique_name(path: &Path) -> PathBuf {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}.{}", std::process::id(), COUNT.fetch_add(1, Relaxed)));
    name.into()
}
