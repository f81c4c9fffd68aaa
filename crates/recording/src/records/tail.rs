//! The two files beside a recording with the messages that are not in a closed chunk: pieces of the form of a chunk, whose first
//! record tells how many messages come before them.

use std::path::{Path, PathBuf};

use ::mcap::records::op;

use super::{McapRecordReader, RecordDamage, RecordFrame, verify_and_visit_chunk};

/// A private record: the number of messages before.
const BEFORE: u8 = 0x80;
/// The length of that record [B].
const BEFORE_LENGTH: usize = 9 + 8;

/// The extensions of the files.
const EXTENSIONS: [&str; 2] = ["tail2", "tail"];

/// The files beside a recording.
pub(crate) fn tail_paths(recording: &Path) -> [PathBuf; 2] {
    EXTENSIONS.map(|extension| add_extension(recording, extension))
}

/// The path with one more extension.
pub(crate) fn add_extension(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    PathBuf::from(name)
}

/// Adds a piece to the contents of a file: a chunk that is not compressed.
pub(crate) fn append_tail_piece(before: u64, messages: &[u8], to: &mut Vec<u8>) {
    let mut first = [0; BEFORE_LENGTH];
    first[0] = BEFORE;
    first[1..9].copy_from_slice(&8_u64.to_le_bytes());
    first[9..].copy_from_slice(&before.to_le_bytes());
    let size = ((BEFORE_LENGTH + messages.len()) as u64).to_le_bytes();
    let mut sum = crc32fast::Hasher::new();
    sum.update(&first);
    sum.update(messages);
    let length = (40 + BEFORE_LENGTH + messages.len()) as u64;
    to.extend_from_slice(&RecordFrame { at: 0, opcode: op::CHUNK, length }.header_bytes());
    // Both times of the messages are left out.
    to.extend_from_slice(&[0; 16]);
    to.extend_from_slice(&size);
    to.extend_from_slice(&sum.finalize().to_le_bytes());
    to.extend_from_slice(&0_u32.to_le_bytes());
    to.extend_from_slice(&size);
    to.extend_from_slice(&first);
    to.extend_from_slice(messages);
}

/// A piece: the number of messages before, and the bodies of its own.
type TailPiece = (u64, Vec<Vec<u8>>);

/// The bodies of the messages in the files beside a recording that follow the `has` messages of the recording itself; none without
/// such files. What an earlier chunk has left behind the pieces of the last one is damaged, or has too low numbers.
pub(crate) fn read_tail_messages(recording: &Path, has: u64) -> Vec<Vec<u8>> {
    let mut pieces: Vec<_> = tail_paths(recording).iter().flat_map(|path| read_tail_pieces(path)).collect();
    pieces.sort_by_key(|(before, _)| *before);
    let mut found: Vec<Vec<u8>> = Vec::new();
    for (before, messages) in pieces {
        // Without all messages before, nobody knows which ones of these are there.
        let Some(known) = (has + found.len() as u64).checked_sub(before) else { break };
        let known = usize::try_from(known).unwrap_or(usize::MAX);
        found.extend(messages.into_iter().skip(known));
    }
    found
}

/// The sound pieces at the start of a file.
fn read_tail_pieces(path: &Path) -> Vec<TailPiece> {
    let Ok(mut records) = McapRecordReader::open(path) else { return Vec::new() };
    let (mut found, mut at) = (Vec::new(), 0);
    while let Ok((piece, end)) = read_tail_piece(&mut records, at) {
        found.extend(piece);
        at = end;
    }
    found
}

/// The piece at a place, if it tells what comes before, and where the next one is.
fn read_tail_piece(
    records: &mut McapRecordReader,
    at: u64,
) -> Result<(Option<TailPiece>, u64), RecordDamage> {
    let frame = records.read_frame(at)?.ok_or(RecordDamage::Cut(at))?;
    let body = records.read_body(&frame)?;
    let (mut before, mut messages) = (None, Vec::new());
    verify_and_visit_chunk(&frame, &body, &mut |opcode, body| {
        match opcode {
            BEFORE => before = body.first_chunk().map(|it| u64::from_le_bytes(*it)),
            _ => messages.push(body.to_vec()),
        }
        Ok::<_, RecordDamage>(true)
    })?;
    let end = frame.end_offset().ok_or(RecordDamage::Cut(at))?;
    Ok((before.map(|before| (before, messages)), end))
}
