//! Makes one stream of bytes of the data blocks of a group: plain, compressed, and lists of them.

use std::collections::HashSet;
use std::io::Read as _;
use std::sync::Arc;

use flate2::read::ZlibDecoder;

use crate::bytes::{FileByteReader, HEAD, block_id_text};
use crate::error::Error;

/// The most bytes of a plain block that are held at once.
const WINDOW: u64 = 1 << 20;
/// The most bytes of a compressed block when it is unpacked, which are held at once. The standard wants at most 4 MiB.
const UNPACKED: u64 = 256 << 20;
/// Deflate makes a byte of at most so many.
const RATIO: u64 = 1032;

/// The blocks of a stream, in their order.
#[derive(Debug)]
pub(crate) struct StreamParts {
    all: Vec<StreamPart>,
    /// Bytes of all parts.
    pub length: u64,
}

/// A part of a stream.
#[derive(Clone, Copy, Debug)]
struct StreamPart {
    /// Where it begins in the stream.
    begin: u64,
    length: u64,
    source: PartSource,
}

#[derive(Clone, Copy, Debug)]
enum PartSource {
    /// Bytes of the file, from a place on.
    Plain(u64),
    /// So many packed bytes from a place on; with a length of rows they are transposed.
    Packed { at: u64, packed: u64, rows: Option<u64> },
    /// Zeros: no invalidation bit is set.
    Zeros,
}

/// Reads the parts of a stream.
pub(crate) struct DataStream {
    parts: Arc<StreamParts>,
    /// Where the bytes at hand begin in the stream.
    begin: u64,
    at_hand: Vec<u8>,
}

/// What a list of blocks is read for.
pub(crate) struct BlockListOptions {
    /// Whether the length of a last plain block may be missing, as in a file that nobody finalised.
    pub open_end: bool,
    /// Bytes of a record and of its invalidation bits, where these have blocks of their own.
    pub apart: Option<(u64, u64)>,
}

/// The values of a group, and its invalidation bits where these have blocks of their own.
pub(crate) struct GroupDataParts {
    pub values: StreamParts,
    pub invalid: Option<StreamParts>,
}

impl StreamParts {
    fn new() -> Self {
        Self { all: Vec::new(), length: 0 }
    }

    /// So many bytes of the file from a place on.
    pub fn from_file_range(at: u64, length: u64) -> Result<Self, Error> {
        let mut parts = Self::new();
        parts.add_part(at, length, PartSource::Plain(at))?;
        Ok(parts)
    }

    fn add_part(&mut self, at: u64, length: u64, source: PartSource) -> Result<(), Error> {
        let begin = self.length;
        self.length = begin
            .checked_add(length)
            .ok_or_else(|| Error::new(at, "expected data that can be counted, found more"))?;
        if length > 0 {
            self.all.push(StreamPart { begin, length, source });
        }
        Ok(())
    }

    /// Adds a data block.
    fn add_data_block(
        &mut self,
        bytes: &mut FileByteReader,
        at: u64,
        seen: &mut HashSet<u64>,
        open_end: bool,
    ) -> Result<(), Error> {
        // Twice the same block would make a small file endless.
        if !seen.insert(at) {
            return Err(Error::new(at, "expected each data block once, found it twice"));
        }
        let head = bytes.read_block_header(at)?;
        match &head.id {
            b"##DZ" => return self.add_packed_block(bytes, at),
            b"##DT" | b"##DV" | b"##DI" | b"##SD" | b"##RD" => {}
            _ => {
                let text = format!("expected a data block, found {}", block_id_text(head.id));
                return Err(Error::new(at, text));
            }
        }
        let begin = at + HEAD;
        let there = bytes.size.saturating_sub(begin);
        let stated = head.length.saturating_sub(HEAD);
        let length = if open_end && (stated == 0 || stated > there) { there } else { stated };
        if length > there {
            let text = format!(
                "expected {length} bytes of data, found the end of the file after {there}; was it copied in full?"
            );
            return Err(Error::new(at, text));
        }
        self.add_part(at, length, PartSource::Plain(begin))
    }

    fn add_packed_block(&mut self, bytes: &mut FileByteReader, at: u64) -> Result<(), Error> {
        let mut head = [0; 24];
        bytes.read_at(at + HEAD, &mut head)?;
        let number = |at: usize| u64::from_le_bytes([0, 1, 2, 3, 4, 5, 6, 7].map(|it: usize| head[at + it]));
        let kind = head[2];
        let row = u64::from(u32::from_le_bytes([head[4], head[5], head[6], head[7]]));
        let (length, packed) = (number(8), number(16));
        let there = bytes.size - at - HEAD - 24;
        if kind > 1 {
            let text = format!(
                "expected data packed by deflate, type 0 or 1, found type {kind} (2 to 5 are Zstandard and LZ4 of MDF 4.3): \
                 save it with deflate or unpacked, `asammdf` can"
            );
            return Err(Error::new(at, text));
        }
        if packed > there || length > UNPACKED || length / RATIO > packed {
            let text = format!("expected packed data that fits the file, found {packed} bytes for {length}");
            return Err(Error::new(at, text));
        }
        let rows = (kind == 1 && row > 1).then_some(row);
        self.add_part(at, length, PartSource::Packed { at: at + HEAD + 24, packed, rows })
    }

    /// The part that has this byte.
    fn part_at(&self, at: u64) -> Option<StreamPart> {
        let behind = self.all.partition_point(|it| it.begin <= at);
        let part = self.all.get(behind.checked_sub(1)?)?;
        (at - part.begin < part.length).then_some(*part)
    }
}

/// Finds the data blocks that a link leads to.
pub(crate) fn list_data_blocks(
    bytes: &mut FileByteReader,
    at: u64,
    listing: &BlockListOptions,
) -> Result<GroupDataParts, Error> {
    let mut found = GroupDataParts { values: StreamParts::new(), invalid: None };
    if at == 0 {
        return Ok(found);
    }
    let (mut seen, mut at) = (HashSet::new(), at);
    if &bytes.read_block_header(at)?.id == b"##HL" {
        at = bytes.read_block(at, &[b"##HL"])?.link_at(0);
    }
    while at != 0 {
        let head = bytes.read_block_header(at)?;
        match &head.id {
            b"##DL" => {
                if !seen.insert(at) {
                    return Err(Error::new(at, "expected lists of data that end, found a circle"));
                }
                let list = bytes.read_block(at, &[b"##DL"])?;
                // A place for a block that was never written.
                for link in list.links().iter().skip(1).filter(|it| **it != 0) {
                    found.values.add_data_block(bytes, *link, &mut seen, listing.open_end)?;
                }
                at = list.link_at(0);
            }
            b"##LD" => at = add_values_and_validity(bytes, at, listing, &mut seen, &mut found)?,
            _ => {
                found.values.add_data_block(bytes, at, &mut seen, listing.open_end)?;
                at = 0;
            }
        }
    }
    Ok(found)
}

/// Adds a list of values with their invalidation bits beside them, and says where the next one is.
fn add_values_and_validity(
    bytes: &mut FileByteReader,
    at: u64,
    listing: &BlockListOptions,
    seen: &mut HashSet<u64>,
    found: &mut GroupDataParts,
) -> Result<u64, Error> {
    if !seen.insert(at) {
        return Err(Error::new(at, "expected lists of data that end, found a circle"));
    }
    let list = bytes.read_block(at, &[b"##LD"])?;
    let (flags, count) = (list.u32_at(0)?, list.u32_at(4)? as usize);
    let with_bits = flags & 1 << 31 != 0;
    if count > list.links().len() {
        let text = format!("expected {count} links of a list, found {}", list.links().len());
        return Err(Error::new(at, text));
    }
    for place in 0..count {
        let before = found.values.length;
        let link = list.link_at(1 + place);
        if link == 0 {
            continue;
        }
        found.values.add_data_block(bytes, link, seen, listing.open_end)?;
        let Some((record, bits)) = listing.apart.filter(|(record, _)| *record > 0) else {
            continue;
        };
        let invalid = found.invalid.get_or_insert_with(StreamParts::new);
        let link = if with_bits { list.link_at(1 + count + place) } else { 0 };
        if link == 0 {
            let rows = (found.values.length - before) / record;
            invalid.add_part(at, rows.saturating_mul(bits), PartSource::Zeros)?;
        } else {
            invalid.add_data_block(bytes, link, seen, listing.open_end)?;
        }
    }
    Ok(list.link_at(0))
}

impl DataStream {
    pub fn new(parts: Arc<StreamParts>) -> Self {
        Self { parts, begin: 0, at_hand: Vec::new() }
    }

    /// The bytes of the stream [B].
    pub fn stream_length(&self) -> u64 {
        self.parts.length
    }

    /// Fills a buffer with bytes of the stream from a place on.
    pub fn read_at(&mut self, bytes: &mut FileByteReader, at: u64, buffer: &mut [u8]) -> Result<(), Error> {
        let (mut at, mut left) = (at, buffer);
        while !left.is_empty() {
            let held = self.bytes_at(bytes, at)?;
            let count = held.len().min(left.len());
            let (now, later) = left.split_at_mut(count);
            now.copy_from_slice(&held[..count]);
            (at, left) = (at + count as u64, later);
        }
        Ok(())
    }

    /// Some bytes of the stream from a place on, at least one.
    fn bytes_at(&mut self, bytes: &mut FileByteReader, at: u64) -> Result<&[u8], Error> {
        let there = at.checked_sub(self.begin).filter(|it| *it < self.at_hand.len() as u64);
        if there.is_none() {
            self.load_part_at(bytes, at)?;
        }
        let there = (at - self.begin) as usize;
        Ok(&self.at_hand[there..])
    }

    fn load_part_at(&mut self, bytes: &mut FileByteReader, at: u64) -> Result<(), Error> {
        let Some(part) = self.parts.part_at(at) else {
            let text = format!(
                "expected more data, found the end of the group's data after {} bytes",
                self.parts.length
            );
            return Err(Error::without_offset(text));
        };
        let inside = at - part.begin;
        match part.source {
            PartSource::Plain(from) => {
                let count = (part.length - inside).min(WINDOW);
                self.at_hand.resize(count as usize, 0);
                bytes.read_at(from + inside, &mut self.at_hand)?;
                self.begin = at;
            }
            PartSource::Zeros => {
                let count = (part.length - inside).min(WINDOW);
                self.at_hand.clear();
                self.at_hand.resize(count as usize, 0);
                self.begin = at;
            }
            PartSource::Packed { at, packed, rows } => {
                self.at_hand = inflate_file_bytes(bytes, at, packed, part.length)?;
                if let Some(rows) = rows {
                    self.at_hand = undo_transposition(&self.at_hand, rows as usize);
                }
                self.begin = part.begin;
            }
        }
        Ok(())
    }
}

/// Unpacks bytes of the file.
fn inflate_file_bytes(
    bytes: &mut FileByteReader,
    at: u64,
    packed: u64,
    length: u64,
) -> Result<Vec<u8>, Error> {
    let mut from = vec![0; packed as usize];
    bytes.read_at(at, &mut from)?;
    let mut all = Vec::new();
    let read = ZlibDecoder::new(&from[..]).take(length).read_to_end(&mut all);
    let wrong = |text: String| Error::new(at, format!("expected packed data, found {text}"));
    read.map_err(|error| wrong(error.to_string()))?;
    if all.len() as u64 != length {
        return Err(wrong(format!("{} of {length} bytes in it", all.len())));
    }
    Ok(all)
}

/// Undoes the transposition of whole rows; what is left over at the end stayed as it was.
fn undo_transposition(bytes: &[u8], row: usize) -> Vec<u8> {
    let rows = bytes.len() / row;
    let mut all = bytes.to_vec();
    for (column, values) in bytes[..rows * row].chunks_exact(rows.max(1)).enumerate() {
        for (place, value) in values.iter().enumerate() {
            all[place * row + column] = *value;
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transposition_leaves_the_rest_behind_its_rows() {
        assert_eq!(undo_transposition(b"acebdfx", 2), b"abcdefx");
        assert_eq!(undo_transposition(b"ab", 3), b"ab");
    }
}
