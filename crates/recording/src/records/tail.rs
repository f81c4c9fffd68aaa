//! The file beside a recording with the messages that are not in a closed chunk: one chunk, whose first record tells how many messages
//! come before it.

use std::path::{Path, PathBuf};

use ::mcap::records::op;

use super::{Damage, Frame, Records, unpack};

/// A private record: the number of messages before.
const BEFORE: u8 = 0x80;

/// The file beside a recording.
pub(crate) fn beside(recording: &Path) -> PathBuf {
    recording.with_added_extension("tail")
}

/// The contents of the file.
pub(crate) fn record(before: u64, messages: &[u8]) -> Vec<u8> {
    let mut records = vec![BEFORE];
    records.extend_from_slice(&8_u64.to_le_bytes());
    records.extend_from_slice(&before.to_le_bytes());
    records.extend_from_slice(messages);
    let size = (records.len() as u64).to_le_bytes();
    // Both times of the messages are left out.
    let mut body = vec![0; 16];
    body.extend_from_slice(&size);
    body.extend_from_slice(&crc32fast::hash(&records).to_le_bytes());
    body.extend_from_slice(&0_u32.to_le_bytes());
    body.extend_from_slice(&size);
    body.append(&mut records);
    let mut record = Frame { at: 0, opcode: op::CHUNK, length: body.len() as u64 }.head().to_vec();
    record.append(&mut body);
    record
}

/// The bodies of the messages in the file beside a recording, without those that the recording has already; none without such a
/// file, or if it is damaged.
pub(crate) fn messages(recording: &Path, has: u64) -> Vec<Vec<u8>> {
    let read = || {
        let mut records = Records::open(&beside(recording))?;
        let frame = records.frame(0)?.ok_or(Damage::Cut(0))?;
        let body = records.body(&frame)?;
        let (mut before, mut messages) = (None, Vec::new());
        unpack(&frame, &body, &mut |opcode, body| {
            match opcode {
                BEFORE => before = body.first_chunk().map(|it| u64::from_le_bytes(*it)),
                _ => messages.push(body.to_vec()),
            }
            Ok::<_, Damage>(true)
        })?;
        // Without all messages before, nobody knows which ones of these are there.
        let known = before.and_then(|before| has.checked_sub(before));
        let known = known.map_or(messages.len(), |known| messages.len().min(known as usize));
        Ok::<_, Damage>(messages.split_off(known))
    };
    read().unwrap_or_default()
}
