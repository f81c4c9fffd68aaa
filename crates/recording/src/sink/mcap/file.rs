//! Writes an MCAP file chunk by chunk. The writer of the crate `mcap` takes one message after the other, which costs more than to
//! compress them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;

use ::mcap::MAGIC;
use ::mcap::records::op;

use super::messages;
use super::record::RecordBuilder;

const COMPRESSION: &str = "lz4";
/// How a frame of lz4 begins whose blocks of 64 KiB at most stand for themselves, without checksums: the chunk has one. The last
/// byte proves the two before.
const FRAME: [u8; 7] = [0x04, 0x22, 0x4d, 0x18, 0x60, 0x40, 0x82];
const BLOCK: usize = 64 << 10;
/// Says of a block that it is as it was.
const UNPACKED: u32 = 1 << 31;

/// An MCAP file, at any time readable up to its last record.
pub(super) struct McapFile {
    file: File,
    /// Where the next record begins [B].
    position: u64,
    /// The checksum of all data so far.
    sum: crc32fast::Hasher,
    /// Schemas and channels, as the summary repeats them; and those that no chunk has yet.
    schemas: SummaryRecords,
    channels: SummaryRecords,
    undefined: Vec<u8>,
    chunks: SummaryRecords,
    attachments: SummaryRecords,
    metadata: SummaryRecords,
    /// Messages of each channel, and all times [ns].
    counts: BTreeMap<u16, u64>,
    times: Option<[u64; 2]>,
    /// The chunk at hand, and its index: times and places of the messages of each channel. Both are kept for their memory.
    chunk: Vec<u8>,
    indices: BTreeMap<u16, Vec<u8>>,
}

/// Records of the summary.
#[derive(Default)]
struct SummaryRecords {
    bytes: Vec<u8>,
    count: u32,
}

impl SummaryRecords {
    fn add_record(&mut self, record: &[u8]) {
        self.bytes.extend_from_slice(record);
        self.count += 1;
    }

    /// The next number of a schema or a channel.
    fn next_id(&self) -> io::Result<u16> {
        let many = || io::Error::other("more than 65535 sides of nodes, which MCAP cannot number");
        u16::try_from(self.count + 1).map_err(|_| many())
    }
}

impl McapFile {
    /// Begins a file; `library` is who writes it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path, library: &str) -> io::Result<Self> {
        let mut file = McapFile {
            file: File::create(path)?,
            position: 0,
            sum: crc32fast::Hasher::new(),
            schemas: SummaryRecords::default(),
            channels: SummaryRecords::default(),
            undefined: Vec::new(),
            chunks: SummaryRecords::default(),
            attachments: SummaryRecords::default(),
            metadata: SummaryRecords::default(),
            counts: BTreeMap::new(),
            times: None,
            chunk: Vec::new(),
            indices: BTreeMap::new(),
        };
        let header = RecordBuilder::new(op::HEADER).with_text("").with_text(library).into_bytes();
        file.write_bytes(&[MAGIC, &header].concat())?;
        Ok(file)
    }

    fn write_bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.sum.update(bytes);
        self.position += bytes.len() as u64;
        Ok(())
    }

    /// Adds a channel of protobuf messages, and returns its number. `name` is the message's name.
    ///
    /// # Errors
    /// When there are too many.
    pub fn add_channel(
        &mut self,
        topic: &str,
        name: &str,
        descriptor: &[u8],
        metadata: &BTreeMap<String, String>,
    ) -> io::Result<u16> {
        let id = self.channels.next_id()?;
        let schema = RecordBuilder::new(op::SCHEMA).with_u16(id).with_text(name).with_text("protobuf");
        let schema = schema.with_u32_length_bytes(descriptor).into_bytes();
        let channel =
            RecordBuilder::new(op::CHANNEL).with_u16(id).with_u16(id).with_text(topic).with_text("protobuf");
        let channel = channel.with_text_map(metadata).into_bytes();
        self.schemas.add_record(&schema);
        self.channels.add_record(&channel);
        self.undefined.extend([schema, channel].concat());
        Ok(id)
    }

    /// Writes the channels that were added in a chunk of their own: whatever happens to the rest, they stay known.
    ///
    /// # Errors
    /// When that fails.
    pub fn write_channel_definitions(&mut self) -> io::Result<()> {
        let defined = std::mem::take(&mut self.undefined);
        if defined.is_empty() { Ok(()) } else { self.write_chunk(&defined, [0; 2]) }
    }

    /// Writes a chunk of the records that [`messages`] makes.
    ///
    /// # Errors
    /// When that fails.
    pub fn write_messages(&mut self, records: &[u8]) -> io::Result<()> {
        let (mut place, mut times) = (0_u64, None);
        for (header, data) in messages::iter_message_records(records) {
            let index = self.indices.entry(header.channel_id).or_default();
            index.extend_from_slice(&header.log_time.to_le_bytes());
            index.extend_from_slice(&place.to_le_bytes());
            place += (messages::HEAD + data.len()) as u64;
            let [first, last] = times.unwrap_or([header.log_time; 2]);
            times = Some([first.min(header.log_time), last.max(header.log_time)]);
        }
        let Some([first, last]) = times else { return Ok(()) };
        let [begin, end] = self.times.unwrap_or([first, last]);
        self.times = Some([begin.min(first), end.max(last)]);
        self.write_chunk(records, [first, last])
    }

    /// Writes a chunk, behind it the indices of its messages, and notes all in the summary.
    fn write_chunk(&mut self, records: &[u8], [first, last]: [u64; 2]) -> io::Result<()> {
        let size = records.len() as u64;
        let head = RecordBuilder::new(op::CHUNK).with_u64(first).with_u64(last).with_u64(size);
        let head = head.with_u32(crc32fast::hash(records)).with_text(COMPRESSION).with_u64(0).into_bytes();
        let mut bytes = std::mem::take(&mut self.chunk);
        bytes.clear();
        bytes.extend_from_slice(&head);
        lz4_compress(records, &mut bytes)?;
        let (length, packed) = (bytes.len() as u64, (bytes.len() - head.len()) as u64);
        bytes[1..9].copy_from_slice(&(length - 9).to_le_bytes());
        bytes[head.len() - 8..head.len()].copy_from_slice(&packed.to_le_bytes());
        let mut places = Vec::new();
        for (channel, index) in self.indices.iter_mut().filter(|(_, index)| !index.is_empty()) {
            places.push((*channel, self.position + bytes.len() as u64));
            bytes.extend(
                RecordBuilder::new(op::MESSAGE_INDEX)
                    .with_u16(*channel)
                    .with_u32_length_bytes(index)
                    .into_bytes(),
            );
            // A time and a place each.
            *self.counts.entry(*channel).or_default() += index.len() as u64 / 16;
            index.clear();
        }
        let index = RecordBuilder::new(op::CHUNK_INDEX)
            .with_u64(first)
            .with_u64(last)
            .with_u64(self.position)
            .with_u64(length);
        let index = index.with_channel_map(places.into_iter()).with_u64(bytes.len() as u64 - length);
        self.chunks.add_record(&index.with_text(COMPRESSION).with_u64(packed).with_u64(size).into_bytes());
        self.write_bytes(&bytes)?;
        self.chunk = bytes;
        Ok(())
    }

    /// Writes a file within the file.
    ///
    /// # Errors
    /// When that fails.
    pub fn write_attachment(&mut self, name: &str, media_type: &str, data: &[u8]) -> io::Result<()> {
        // Both times, of the record and of the file, are the beginning.
        let record =
            RecordBuilder::new(op::ATTACHMENT).with_u64(0).with_u64(0).with_text(name).with_text(media_type);
        let mut record = record.with_u64_length_bytes(data).with_u32(0).into_bytes();
        if let Some((covered, sum)) = record[9..].split_last_chunk_mut::<4>() {
            *sum = crc32fast::hash(covered).to_le_bytes();
        }
        let index =
            RecordBuilder::new(op::ATTACHMENT_INDEX).with_u64(self.position).with_u64(record.len() as u64);
        let index =
            index.with_u64(0).with_u64(0).with_u64(data.len() as u64).with_text(name).with_text(media_type);
        self.attachments.add_record(&index.into_bytes());
        self.write_bytes(&record)
    }

    /// Writes texts by texts.
    ///
    /// # Errors
    /// When that fails.
    pub fn write_metadata(&mut self, name: &str, entries: &BTreeMap<String, String>) -> io::Result<()> {
        let record = RecordBuilder::new(op::METADATA).with_text(name).with_text_map(entries).into_bytes();
        let index =
            RecordBuilder::new(op::METADATA_INDEX).with_u64(self.position).with_u64(record.len() as u64);
        self.metadata.add_record(&index.with_text(name).into_bytes());
        self.write_bytes(&record)
    }

    /// Completes the file.
    ///
    /// # Errors
    /// When that fails.
    pub fn finish(&mut self) -> io::Result<()> {
        let sum = self.sum.clone().finalize();
        self.write_bytes(&RecordBuilder::new(op::DATA_END).with_u32(sum).into_bytes())?;
        let start = self.position;
        let [first, last] = self.times.unwrap_or_default();
        let statistics = RecordBuilder::new(op::STATISTICS).with_u64(self.counts.values().sum());
        let statistics = statistics.with_u16(self.schemas.count as u16).with_u32(self.channels.count);
        let statistics = statistics.with_u32(self.attachments.count).with_u32(self.metadata.count);
        let statistics = statistics.with_u32(self.chunks.count).with_u64(first).with_u64(last);
        let counts = self.counts.iter().map(|(channel, count)| (*channel, *count));
        let statistics = statistics.with_channel_map(counts).into_bytes();
        let (mut summary, mut offsets) = (Vec::new(), Vec::new());
        for (opcode, group) in [
            (op::SCHEMA, &self.schemas.bytes),
            (op::CHANNEL, &self.channels.bytes),
            (op::STATISTICS, &statistics),
            (op::CHUNK_INDEX, &self.chunks.bytes),
            (op::ATTACHMENT_INDEX, &self.attachments.bytes),
            (op::METADATA_INDEX, &self.metadata.bytes),
        ] {
            if group.is_empty() {
                continue;
            }
            let offset = RecordBuilder::new(op::SUMMARY_OFFSET).with_u8(opcode);
            let offset = offset.with_u64(start + summary.len() as u64).with_u64(group.len() as u64);
            offsets.extend(offset.into_bytes());
            summary.extend_from_slice(group);
        }
        let offset_start = start + summary.len() as u64;
        summary.extend(offsets);
        let footer =
            RecordBuilder::new(op::FOOTER).with_u64(start).with_u64(offset_start).with_u32(0).into_bytes();
        summary.extend(footer);
        if let Some((covered, sum)) = summary.split_last_chunk_mut::<4>() {
            *sum = crc32fast::hash(covered).to_le_bytes();
        }
        summary.extend_from_slice(MAGIC);
        self.write_bytes(&summary)
    }
}

/// Packs records as a frame of lz4.
fn lz4_compress(records: &[u8], to: &mut Vec<u8>) -> io::Result<()> {
    to.extend_from_slice(&FRAME);
    for block in records.chunks(BLOCK) {
        let start = to.len() + 4;
        to.resize(start + lz4::block::compress_bound(block.len())?, 0);
        let mut length = lz4::block::compress_to_buffer(block, None, false, &mut to[start..])?;
        let mut size = length as u32;
        if length >= block.len() {
            to[start..start + block.len()].copy_from_slice(block);
            length = block.len();
            size = UNPACKED | length as u32;
        }
        to[start - 4..start].copy_from_slice(&size.to_le_bytes());
        to.truncate(start + length);
    }
    to.extend_from_slice(&[0; 4]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::{BLOCK, lz4_compress};

    #[test]
    fn the_reader_of_lz4_itself_unpacks_what_was_packed() {
        let mut state = 1_u64;
        let noise = (0..3 * BLOCK + 5).map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 56) as u8
        });
        let noise: Vec<u8> = noise.collect();
        for records in [&[][..], &[7; 100], &[7; 2 * BLOCK + 1], &noise] {
            let mut packed = Vec::new();
            lz4_compress(records, &mut packed).expect("it can be packed");
            let mut unpacked = Vec::new();
            let mut decoder = lz4::Decoder::new(packed.as_slice()).expect("a frame");
            decoder.read_to_end(&mut unpacked).expect("it is sound");
            assert_eq!(unpacked, records);
        }
    }
}
