//! Reads the identification of a file, its first 64 bytes: the version, and what is missing in it.

use crate::bytes::{FileByteReader, block_id_text};
use crate::error::Error;
use crate::layout::FileStructure;
use crate::text::decode_latin1;

/// The most rows of a group whose records have no bytes: channels that are the number of their row.
pub(crate) const EMPTY_ROWS: u64 = 1 << 24;

/// The identification of a file, its first 64 bytes.
pub(crate) struct FileIdentification {
    finalised: bool,
    /// What is missing in a file that was not finalised.
    missing: u16,
    /// Hundred times the version: 330 is 3.30.
    pub version: u16,
    /// In MDF 2 and 3, whether values without an order of bytes of their own have their highest byte first.
    pub big_values: bool,
}

impl FileIdentification {
    /// What a file has whose description is not read yet.
    pub fn empty_structure(&self) -> FileStructure {
        let mut structure = FileStructure { version: self.version, ..FileStructure::default() };
        if !self.finalised {
            // Bit 0: counts of rows; bits 2 and 4: the length of the last block, the end of the lists.
            structure.uncounted = self.missing & 1 != 0;
            structure.open_end = self.missing & 0b1_0100 != 0;
            let note = "the file was not finalised: what was written before its measurement ended is read";
            structure.notes.push(note.to_owned());
        }
        structure
    }

    /// Reads the first bytes of a file.
    pub fn read(bytes: &mut FileByteReader) -> Result<Self, Error> {
        let mut all = [0; 64];
        let there = bytes.size.min(64) as usize;
        bytes.read_at(0, &mut all[..there])?;
        let finalised = match &all[..8] {
            b"MDF     " => true,
            b"UnFinMF " => false,
            other => {
                let found: Vec<_> =
                    other.chunks(4).map(|it| block_id_text([it[0], it[1], it[2], it[3]])).collect();
                let text = format!("expected a file of MDF, `MDF     `, found `{}`", found.concat());
                return Err(Error::new(0, text));
            }
        };
        let number = [all[28], all[29]];
        let versions = [u16::from_le_bytes(number), u16::from_be_bytes(number)];
        let Some(version) = versions.into_iter().find(|it| (200..500).contains(it)) else {
            let named = decode_latin1(&all[8..16]);
            let text = format!("expected MDF 2, 3 or 4, found version {}", named.trim_matches([' ', '\0']));
            return Err(Error::new(8, text));
        };
        let missing = u16::from_le_bytes([all[60], all[61]]);
        Ok(Self { finalised, missing, version, big_values: all[24..26] != [0, 0] })
    }
}

/// Whether these are the first bytes of a file of MDF, of any version.
#[must_use]
pub fn is_mdf(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MDF     ") || bytes.starts_with(b"UnFinMF ")
}
