//! Finds archives that list a name twice with different contents: what is in them depends on who reads them.

use std::collections::BTreeMap;
use std::path::Path;

use crate::Error;

/// Checks an archive in which the zip library found `different` names. It keeps the last entry of each name without a word.
///
/// # Errors
/// When entries of one name differ.
pub(crate) fn check_names(path: &Path, bytes: &[u8], different: usize) -> Result<(), Error> {
    let listed = listed_entry_count(bytes);
    match listed.filter(|listed| *listed != different && !has_identical_duplicates(bytes, *listed)) {
        Some(listed) => Err(Error::Ambiguous { path: path.to_owned(), listed, different }),
        None => Ok(()),
    }
}

/// Whether entries of the same name have the same contents, by their checksums and sizes: some tools write an entry twice.
fn has_identical_duplicates(bytes: &[u8], listed: usize) -> bool {
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
            let [name, extra, comment] = [number(at + 28, 2)?, number(at + 30, 2)?, number(at + 32, 2)?];
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

/// How many entries the archive says it has. Nothing is known of archives with more entries than
/// the field can hold.
fn listed_entry_count(bytes: &[u8]) -> Option<usize> {
    const END: &[u8] = b"PK\x05\x06";
    let end = bytes.windows(END.len()).rposition(|window| window == END)?;
    let count = bytes.get(end + 10..end + 12)?;
    let count = u16::from_le_bytes([count[0], count[1]]);
    (count != u16::MAX).then_some(count.into())
}
