//! Reads archives: a whole one, or one file of it.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use archive::Error;

/// Unpacks the archive `path` into a folder; `left` is how many bytes all archives together may still unpack to.
pub(crate) fn unpack_archive(
    path: &Path,
    display_path: &Path,
    into: &Path,
    left: &mut u64,
) -> Result<(), crate::Error> {
    let failed = |source| crate::Error::Read { path: display_path.to_owned(), source };
    let bytes = archive::read_archive(path).map_err(failed)?;
    // No archive of use is longer than what it may unpack to.
    if bytes.len() as u64 > *left {
        return Err(Error::TooLarge { path: display_path.to_owned() }.into());
    }
    archive::unpack_archive(display_path, ".ssp", &bytes, into, left)?;
    Ok(())
}

/// One file of an archive, at most `limit` and one bytes of it.
pub(crate) fn read_archive_entry(path: &Path, name: &str, limit: u64) -> Result<Vec<u8>, Error> {
    let broken = |source| Error::Zip { path: path.to_owned(), kind: ".fmu", source };
    let failed = |source| Error::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
    let mut archive = zip::ZipArchive::new(file).map_err(broken)?;
    let entry = archive.by_name(name).map_err(broken)?;
    let mut bytes = Vec::new();
    entry.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}
