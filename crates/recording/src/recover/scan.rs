//! Searches damaged bytes for the next record that its checksum confirms.

use std::ops::Range;

use ::mcap::records::op;

use crate::records::{
    ChecksumStatus, ChunkHeader, LARGEST, McapRecordReader, RecordContent, RecordDamage, RecordFrame,
    verify_and_visit_chunk, verify_metadata,
};

/// How much is looked at together [B].
const WINDOW: u64 = 1 << 18;
/// What of a record is looked at before its checksum [B]: its head and the fixed part of a chunk's header.
const GLANCE: usize = 9 + 32;
/// All records that turn out to be none may have this many bytes for each byte of the file: a hostile file would take for ever.
const PATIENCE: u64 = 16;

/// A search through a file.
pub(super) struct RecordScanner {
    /// The bytes that may still be looked at in vain.
    left: u64,
}

impl RecordScanner {
    /// A search through a file of this length [B].
    pub fn new(length: u64) -> Self {
        RecordScanner { left: length.saturating_mul(PATIENCE) }
    }

    /// The place of the next chunk, attachment or metadata record whose checksum is right.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn find_verified_record(
        &mut self,
        records: &mut McapRecordReader,
        bytes: Range<u64>,
    ) -> Result<Option<u64>, RecordDamage> {
        let mut start = bytes.start;
        while start < bytes.end {
            start = records.skip_sparse_hole(start)?;
            let window = records.read_at(start, WINDOW + GLANCE as u64)?;
            let places = window.len().min(WINDOW as usize);
            let mut begin = 0;
            // Searched in one go: there may be gigabytes without any.
            while let Some(next) = window[begin..places].iter().position(|it| can_have_checksum(*it)) {
                let place = begin + next;
                begin = place + 1;
                let at = start + place as u64;
                let Some(frame) = candidate_frame(&window[place..], at) else { continue };
                if at >= bytes.end || !records.contains_record(&frame) {
                    continue;
                }
                match is_checksum_valid(records, &frame) {
                    Ok(true) => return Ok(Some(at)),
                    Err(RecordDamage::Io(error)) => return Err(RecordDamage::Io(error)),
                    _ => {}
                }
                match self.left.checked_sub(frame.length) {
                    Some(left) => self.left = left,
                    None => return Ok(None),
                }
            }
            start += WINDOW;
        }
        Ok(None)
    }
}

/// Whether a record of this opcode can have a checksum.
fn can_have_checksum(opcode: u8) -> bool {
    matches!(opcode, op::CHUNK | op::ATTACHMENT | op::METADATA)
}

/// Whether bytes look like the beginning of a record that can have a checksum.
fn candidate_frame(bytes: &[u8], at: u64) -> Option<RecordFrame> {
    let opcode = *bytes.first()?;
    let length = u64::from_le_bytes(*bytes[1..].first_chunk()?);
    if length > LARGEST {
        return None;
    }
    // The length of a text: the compression of a chunk, or the name.
    let (place, texts) = match opcode {
        op::CHUNK => (37, 4),
        op::ATTACHMENT => (25, length),
        _ => (9, length),
    };
    let text = u32::from_le_bytes(*bytes.get(place..)?.first_chunk()?);
    (u64::from(text) <= texts).then_some(RecordFrame { at, opcode, length })
}

/// Whether the checksum of a record is right.
fn is_checksum_valid(records: &mut McapRecordReader, frame: &RecordFrame) -> Result<bool, RecordDamage> {
    if frame.opcode == op::CHUNK {
        // The header alone says whether the lengths fit each other.
        let header = records.read_at(frame.body_offset(), 64)?;
        let fixed = ChunkHeader::header_and_data_length(&header);
        if fixed.is_none_or(|(head, packed)| head.checked_add(packed) != Some(frame.length)) {
            return Ok(false);
        }
    }
    let body = records.read_body(frame)?;
    let form = || RecordDamage::Form(frame.opcode);
    if frame.opcode == op::CHUNK {
        let (header, _) = ChunkHeader::parse(&body).ok_or_else(form)?;
        verify_and_visit_chunk(frame, &body, &mut |_, _| Ok::<_, RecordDamage>(true))?;
        return Ok(header.checksum_status() == ChecksumStatus::Valid);
    }
    let proof = match RecordContent::parse(frame.opcode, &body).ok_or_else(form)? {
        RecordContent::Attachment(attachment) => attachment.verify_checksum(frame.at)?,
        RecordContent::Metadata(metadata) => verify_metadata(&metadata)?,
        _ => return Ok(false),
    };
    Ok(proof == ChecksumStatus::Valid)
}
