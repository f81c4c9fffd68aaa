//! Writes files without following symbolic links: a link in the place of the file is replaced, its target stays.

use std::io;
use std::path::Path;

/// Writes the file.
///
/// # Errors
/// Those of the system.
pub fn write_without_following_links(path: &Path, contents: impl AsRef<[u8]>) -> io::Result<()> {
    if std::fs::symlink_metadata(path).is_ok_and(|it| it.is_symlink()) {
        std::fs::remove_file(path)?;
    }
    std::fs::write(path, contents)
}
