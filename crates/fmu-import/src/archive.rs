//! Unpacks an archive, and refuses one that would do harm.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use crate::OpenError;

/// An archive may unpack to this many bytes, which is far more than any real one needs.
pub(crate) const LARGEST: u64 = 4 << 30;

pub(crate) fn unpack(path: &Path, bytes: &[u8], into: &Path) -> Result<(), OpenError> {
    let broken = |source| OpenError::Zip { path: path.to_owned(), source };
    let failed = |source| OpenError::Read { path: path.to_owned(), source };
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).map_err(broken)?;
    let different = archive.len();
    if let Some(listed) = listed_entries(bytes).filter(|listed| *listed != different) {
        return Err(OpenError::Ambiguous { path: path.to_owned(), listed, different });
    }
    let mut left = LARGEST;
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(broken)?;
        let Some(inside) = entry.enclosed_name().filter(|_| !entry.is_symlink()) else {
            let entry = String::from_utf8_lossy(entry.name_raw()).into_owned();
            return Err(OpenError::Escapes { path: path.to_owned(), entry });
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
            std::io::copy(&mut entry.by_ref().take(left + 1), &mut file).map_err(failed)?;
        left = left
            .checked_sub(written)
            .ok_or_else(|| OpenError::TooLarge { path: path.to_owned() })?;
    }
    Ok(())
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
