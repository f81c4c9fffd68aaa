//! Parses the bodies of MCAP records.

use std::collections::BTreeMap;

use ::mcap::records::{Channel, MessageHeader, Metadata, SchemaHeader, op};

use super::{ChecksumStatus, RecordDamage};

/// The key of the checksum that this program adds to its metadata.
const CHECKSUM: &str = "checksum";

/// What a record says.
#[derive(Debug)]
pub(crate) enum RecordContent<'a> {
    Schema(SchemaHeader, &'a [u8]),
    Channel(Channel),
    Message(MessageHeader, &'a [u8]),
    Attachment(McapAttachment<'a>),
    Metadata(Metadata),
    /// Where and when the messages of a chunk are: the chunk's place, and its first and last time [ns].
    ChunkIndex(u64, [u64; 2]),
    Statistics(McapStatistics),
    /// Nothing that is read.
    Other,
}

/// What a writer counted.
#[derive(Debug, Default)]
pub(crate) struct McapStatistics {
    /// The number of all messages.
    pub messages: u64,
    /// The first and the last time of a message [ns].
    pub times: [u64; 2],
    /// The messages of each channel.
    pub by_channel: BTreeMap<u16, u64>,
}

/// A file within the file.
#[derive(Debug)]
pub(crate) struct McapAttachment<'a> {
    pub log_time: u64,
    pub create_time: u64,
    pub name: String,
    pub media_type: String,
    pub data: &'a [u8],
    covered: &'a [u8],
    crc: u32,
}

impl<'a> RecordContent<'a> {
    /// What a body says; none if it has not the form of its opcode.
    pub fn parse(opcode: u8, body: &'a [u8]) -> Option<Self> {
        let mut it = RecordBodyReader(body);
        let content = match opcode {
            op::SCHEMA => {
                let header =
                    SchemaHeader { id: it.read_u16()?, name: it.read_text()?, encoding: it.read_text()? };
                let length = it.read_u32()?;
                RecordContent::Schema(header, it.take_bytes(u64::from(length))?)
            }
            op::CHANNEL => RecordContent::Channel(Channel {
                id: it.read_u16()?,
                schema_id: it.read_u16()?,
                topic: it.read_text()?,
                message_encoding: it.read_text()?,
                metadata: it.read_text_map()?,
            }),
            op::MESSAGE => {
                let header = MessageHeader {
                    channel_id: it.read_u16()?,
                    sequence: it.read_u32()?,
                    log_time: it.read_u64()?,
                    publish_time: it.read_u64()?,
                };
                RecordContent::Message(header, it.0)
            }
            op::ATTACHMENT => RecordContent::Attachment(McapAttachment::parse(body)?),
            op::METADATA => {
                RecordContent::Metadata(Metadata { name: it.read_text()?, metadata: it.read_text_map()? })
            }
            op::CHUNK_INDEX => {
                let times = [it.read_u64()?, it.read_u64()?];
                RecordContent::ChunkIndex(it.read_u64()?, times)
            }
            op::STATISTICS => RecordContent::Statistics(McapStatistics::parse(&mut it)?),
            _ => RecordContent::Other,
        };
        Some(content)
    }
}

impl McapStatistics {
    fn parse(it: &mut RecordBodyReader) -> Option<Self> {
        let messages = it.read_u64()?;
        // The numbers of schemas, channels, attachments, metadata and chunks.
        it.take_bytes(2 + 4 * 4)?;
        let times = [it.read_u64()?, it.read_u64()?];
        let bytes = it.read_u32()?;
        let mut counts = RecordBodyReader(it.take_bytes(u64::from(bytes))?);
        let mut by_channel = BTreeMap::new();
        while !counts.0.is_empty() {
            by_channel.insert(counts.read_u16()?, counts.read_u64()?);
        }
        Some(Self { messages, times, by_channel })
    }
}

impl<'a> McapAttachment<'a> {
    fn parse(body: &'a [u8]) -> Option<Self> {
        let (covered, crc) = body.split_last_chunk()?;
        let mut it = RecordBodyReader(covered);
        let (log_time, create_time) = (it.read_u64()?, it.read_u64()?);
        let (name, media_type) = (it.read_text()?, it.read_text()?);
        let length = it.read_u64()?;
        let data = it.take_bytes(length)?;
        let crc = u32::from_le_bytes(*crc);
        let exact = it.0.is_empty();
        exact.then_some(McapAttachment { log_time, create_time, name, media_type, data, covered, crc })
    }

    /// Compares the checksum of the attachment, which is at this place of the file.
    ///
    /// # Errors
    /// When it differs.
    pub fn verify_checksum(&self, at: u64) -> Result<ChecksumStatus, RecordDamage> {
        ChecksumStatus::compare_checksums("attachment", at, crc32fast::hash(self.covered), self.crc)
    }
}

/// What stands before the records of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ChunkHeader {
    /// The length of its records [B].
    pub size: u64,
    /// Their checksum; 0 for none.
    pub crc: u32,
    pub compression: String,
}

impl ChunkHeader {
    /// The header and the packed records.
    pub fn parse(body: &[u8]) -> Option<(Self, &[u8])> {
        let mut it = RecordBodyReader(body);
        let _times = (it.read_u64()?, it.read_u64()?);
        let header = ChunkHeader { size: it.read_u64()?, crc: it.read_u32()?, compression: it.read_text()? };
        let packed = it.read_u64()?;
        Some((header, it.take_bytes(packed)?))
    }

    /// The lengths of the header that begins with these bytes and of the packed records [B], if the compression is a known one.
    pub fn header_and_data_length(begin: &[u8]) -> Option<(u64, u64)> {
        let mut it = RecordBodyReader(begin);
        it.take_bytes(28)?;
        let compression = it.read_text()?;
        let packed = it.read_u64()?;
        let known = ["", "lz4", "zstd"].contains(&compression.as_str());
        known.then_some((40 + compression.len() as u64, packed))
    }

    /// Whether it has a checksum; whether that is right, unpacking tells.
    pub fn checksum_status(&self) -> ChecksumStatus {
        if self.crc == 0 { ChecksumStatus::Missing } else { ChecksumStatus::Valid }
    }
}

/// Whether the header of a file, which is this body, names this program as the writer.
pub(crate) fn is_own_file_header(body: &[u8]) -> bool {
    let mut it = RecordBodyReader(body);
    it.read_text().and_then(|_profile| it.read_text()).is_some_and(|it| it.starts_with("trackside"))
}

/// The checksum of a metadata record of this program: over its name and its entries, each text after its length.
pub(crate) fn metadata_checksum_entry(name: &str, entries: &BTreeMap<String, String>) -> (String, String) {
    let mut hasher = crc32fast::Hasher::new();
    let mut add = |text: &str| {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    };
    add(name);
    for (key, value) in entries.iter().filter(|(key, _)| *key != CHECKSUM) {
        add(key);
        add(value);
    }
    (CHECKSUM.to_owned(), format!("{:08x}", hasher.finalize()))
}

/// Compares the checksum of a metadata record.
///
/// # Errors
/// When it differs.
pub(crate) fn verify_metadata(metadata: &Metadata) -> Result<ChecksumStatus, RecordDamage> {
    let (key, found) = metadata_checksum_entry(&metadata.name, &metadata.metadata);
    match metadata.metadata.get(&key) {
        None => Ok(ChecksumStatus::Missing),
        Some(expected) if *expected == found => Ok(ChecksumStatus::Valid),
        Some(_) => Err(RecordDamage::Metadata(metadata.name.clone())),
    }
}

/// The rest of a body.
struct RecordBodyReader<'a>(&'a [u8]);

impl<'a> RecordBodyReader<'a> {
    fn take_bytes(&mut self, length: u64) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(taken)
    }

    fn read_array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*taken)
    }

    fn read_u16(&mut self) -> Option<u16> {
        self.read_array().map(u16::from_le_bytes)
    }

    fn read_u32(&mut self) -> Option<u32> {
        self.read_array().map(u32::from_le_bytes)
    }

    fn read_u64(&mut self) -> Option<u64> {
        self.read_array().map(u64::from_le_bytes)
    }

    fn read_text(&mut self) -> Option<String> {
        let length = self.read_u32()?;
        let text = std::str::from_utf8(self.take_bytes(u64::from(length))?).ok()?;
        Some(text.to_owned())
    }

    /// Texts by texts, no key twice.
    fn read_text_map(&mut self) -> Option<BTreeMap<String, String>> {
        let length = self.read_u32()?;
        let mut entries = RecordBodyReader(self.take_bytes(u64::from(length))?);
        let mut map = BTreeMap::new();
        while !entries.0.is_empty() {
            if map.insert(entries.read_text()?, entries.read_text()?).is_some() {
                return None;
            }
        }
        Some(map)
    }
}
