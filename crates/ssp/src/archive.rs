//! Unpacks an archive, and refuses one that would do harm.

use std::fs::File;
use std::io::{Cursor, Read as _};
use std::path::Path;

use crate::Error;

/// Unpacks the archive `path` into a folder; `left` is how many bytes all archives together may still unpack to.
pub(crate) fn unpack(path: &Path, shown: &Path, into: &Path, left: &mut u64) -> Result<(), Error> {
    let broken = |source| Error::Zip { path: shown.to_owned(), source };
    let failed = |source| Error::Read { path: shown.to_owned(), source };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(failed)?;
    // No archive of use is longer than what it may unpack to.
    file.take(*left + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > *left {
        return Err(Error::TooLarge { path: shown.to_owned() });
    }
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes.as_slice())).map_err(broken)?;
    let different = archive.len();
    if let Some(listed) = listed_entries(&bytes).filter(|listed| *listed != different) {
        return Err(Error::Ambiguous { path: shown.to_owned(), listed, different });
    }
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(broken)?;
        let Some(inside) = entry.enclosed_name().filter(|_| !entry.is_symlink()) else {
            let entry = String::from_utf8_lossy(entry.name_raw()).into_owned();
            return Err(Error::Escapes { path: shown.to_owned(), entry });
        };
        let target = into.join(inside);
        if entry.is_dir() {
            std::fs::create_dir_all(&target).map_err(failed)?;
            continue;
        }
        if let Some(parent) = target.parent() {
            std::fs::create_dir_all(parent).map_err(failed)?;
        }
        let mut file = File::create(&target).map_err(failed)?;
        // What the entry claims about its size is not believed: one byte over the limit is enough.
        let written =
            std::io::copy(&mut entry.by_ref().take(*left + 1), &mut file).map_err(failed)?;
        *left =
            left.checked_sub(written).ok_or_else(|| Error::TooLarge { path: shown.to_owned() })?;
    }
    Ok(())
}

/// One file of an archive, at most `limit` and one bytes of it.
pub(crate) fn entry(path: &Path, name: &str, limit: u64) -> Result<Vec<u8>, Error> {
    let broken = |source| Error::Zip { path: path.to_owned(), source };
    let failed = |source| Error::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
    let mut archive = zip::ZipArchive::new(file).map_err(broken)?;
    let entry = archive.by_name(name).map_err(broken)?;
    let mut bytes = Vec::new();
    entry.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// Whether the file begins as archives do.
pub(crate) fn is_archive(path: &Path) -> std::io::Result<bool> {
    let mut start = Vec::new();
    File::open(path)?.take(4).read_to_end(&mut start)?;
    Ok(start.starts_with(b"PK\x03\x04") || start.starts_with(b"PK\x05\x06"))
}

/// How many entries the archive says it has. The zip library keeps the last one of each name without
/// a word. Nothing is known of archives with more entries than the field can hold.
fn listed_entries(bytes: &[u8]) -> Option<usize> {
    const END: &[u8] = b"PK\x05\x06";
    let end = bytes.windows(END.len()).rposition(|window| window == END)?;
    let count = bytes.get(end + 10..end + 12)?;
    let count = u16::from_le_bytes([count[0], count[1]]);
    (count != u16::MAX).then_some(count.into())
}
