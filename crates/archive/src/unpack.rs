//! Unpacks an archive, and refuses one that would do harm.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use crate::Error;

/// Unpacks the bytes of the archive `path`, which is of a kind such as `.fmu`, into a folder; `left` is how many bytes may still be
/// unpacked.
///
/// # Errors
/// When it is no archive, or one that would do harm.
pub fn unpack(
    path: &Path,
    kind: &'static str,
    bytes: &[u8],
    into: &Path,
    left: &mut u64,
) -> Result<(), Error> {
    let broken = |source| Error::Zip { path: path.to_owned(), kind, source };
    let failed = |source| Error::Read { path: path.to_owned(), source };
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).map_err(broken)?;
    let different = archive.len();
    let listed = listed_entries(bytes);
    if let Some(listed) = listed.filter(|listed| *listed != different && !repeats(bytes, *listed)) {
        return Err(Error::Ambiguous { path: path.to_owned(), listed, different });
    }
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(broken)?;
        let Some(inside) = entry.enclosed_name().filter(|_| !entry.is_symlink()) else {
            let entry = String::from_utf8_lossy(entry.name_raw()).into_owned();
            return Err(Error::Escapes { path: path.to_owned(), entry });
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
            left.checked_sub(written).ok_or_else(|| Error::TooLarge { path: path.to_owned() })?;
    }
    Ok(())
}

/// Whether entries of the same name have the same contents, by their checksums and sizes: some tools write an entry twice.
fn repeats(bytes: &[u8], listed: usize) -> bool {
    const ENTRY: &[u8] = b"PK\x01\x02";
    const FIXED: usize = 46;
    let number = |at: usize, size: usize| -> Option<usize> {
        let field = bytes.get(at..at + size)?;
        Some(field.iter().rev().fold(0, |sum, byte| 256 * sum + usize::from(*byte)))
    };
    let end = bytes.windows(4).rposition(|window| window == b"PK\x05\x06");
    let Some(mut at) = end.and_then(|end| number(end + 16, 4)) else { return false };
    let mut contents: BTreeMap<&[u8], &[u8]> = BTreeMap::new();
    for _ in 0..listed {
        let entry = || -> Option<(&[u8], &[u8], usize)> {
            bytes.get(at..)?.starts_with(ENTRY).then_some(())?;
            let [name, extra, comment] =
                [number(at + 28, 2)?, number(at + 30, 2)?, number(at + 32, 2)?];
            let text = bytes.get(at + FIXED..at + FIXED + name)?;
            // Checksum, and the sizes before and after compression.
            Some((text, bytes.get(at + 16..at + 28)?, at + FIXED + name + extra + comment))
        };
        let Some((name, content, next)) = entry() else { return false };
        if contents.insert(name, content).is_some_and(|other| other != content) {
            return false;
        }
        at = next;
    }
    true
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

/// Whether the file begins as archives do.
///
/// # Errors
/// When it cannot be read.
pub fn is_archive(path: &Path) -> std::io::Result<bool> {
    let mut start = Vec::new();
    File::open(path)?.take(4).read_to_end(&mut start)?;
    Ok(start.starts_with(b"PK\x03\x04") || start.starts_with(b"PK\x05\x06"))
}
