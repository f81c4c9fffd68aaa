//! Iterates over the records of an MCAP file, also of one whose writer was killed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::read::ChannelAccumulator;
use mcap::records::{MessageHeader, op};
use mcap::{Channel, MAGIC, McapError};

use super::{RecordingError, TableError};
use crate::records::{
    self, ChecksumStatus, LARGEST, McapRecordReader, McapStatistics, RecordContent, RecordDamage, RecordFrame,
};

/// The channels by their numbers, which is the order in which most writers add them.
pub type ChannelsById = BTreeMap<u16, Arc<Channel<'static>>>;

/// Takes a message and says whether it wants more.
pub type MessageCallback<'a> = dyn FnMut(&MessageHeader, &[u8]) -> Result<bool, TableError> + 'a;
/// Takes the opcode and the content of a record and says whether it wants more.
type TableRecordCallback<'a> = records::RecordCallback<'a, TableError>;

/// An MCAP file.
#[derive(Debug)]
pub struct McapReader {
    /// Where it is.
    pub path: PathBuf,
    /// Whether its writer came to the end: otherwise what is behind the last whole chunk is lost.
    pub finished: bool,
}

/// Why a walk through the records ended early.
enum RecordVisitError {
    Damage(RecordDamage),
    /// The taker wants no more, for this reason.
    Taker(TableError),
}

impl From<RecordDamage> for RecordVisitError {
    fn from(damage: RecordDamage) -> Self {
        RecordVisitError::Damage(damage)
    }
}

impl From<std::io::Error> for RecordVisitError {
    fn from(error: std::io::Error) -> Self {
        RecordVisitError::Damage(RecordDamage::Io(error))
    }
}

impl McapReader {
    /// Looks at how the file ends.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let finished = McapRecordReader::open(path).and_then(|mut records| records.is_file_complete());
        let finished = finished.map_err(|source| read_error(path, source))?;
        Ok(McapReader { path: path.to_owned(), finished })
    }

    /// The channels, from the summary at the end of the file if there is one with them.
    pub fn read_channels(&self) -> Result<ChannelsById, TableError> {
        let summary = if self.finished { self.read_summary_channels()? } else { BTreeMap::new() };
        if !summary.is_empty() {
            return Ok(summary);
        }
        let mut known = ChannelRegistry::default();
        self.visit_records(&mut |opcode, data| {
            known.add_record(opcode, data).map_err(|error| self.damage_error(error))?;
            Ok(true)
        })?;
        Ok(known.into_channels())
    }

    /// What the summary at the end of a finished file counts, if it has counts.
    pub fn read_statistics(&self) -> Result<Option<McapStatistics>, RecordingError> {
        let mut statistics = None;
        self.visit_summary(&mut |opcode, data| {
            if let RecordContent::Statistics(it) =
                RecordContent::parse(opcode, data).ok_or(RecordDamage::Form(opcode))?
            {
                statistics = Some(it);
            }
            Ok(true)
        })?;
        Ok(statistics)
    }

    fn read_summary_channels(&self) -> Result<ChannelsById, RecordingError> {
        let mut known = ChannelRegistry::default();
        self.visit_summary(&mut |opcode, data| known.add_record(opcode, data).map(|()| true))?;
        Ok(known.into_channels())
    }

    /// Hands over the records of the summary at the end.
    fn visit_summary(&self, take: &mut records::RecordCallback<RecordDamage>) -> Result<(), RecordingError> {
        let mut read = || {
            let mut records = McapRecordReader::open(&self.path)?;
            let at = records.length;
            let none = RecordDamage::Expected { expected: "a footer at the end of the file", at };
            let ending = records.read_trailer()?.ok_or(none)?;
            let (summary, _) = records.read_summary(&ending)?;
            records::for_each_record(ending.data_end, &summary, take)
        };
        read().map(|_| ()).map_err(|error: RecordDamage| self.damage_error(error))
    }

    /// Hands over the messages, in the order of the file, until `take` says that it has enough.
    pub fn visit_messages(&self, take: &mut MessageCallback) -> Result<(), TableError> {
        self.visit_records(&mut |opcode, data| {
            if opcode != op::MESSAGE {
                return Ok(true);
            }
            match RecordContent::parse(opcode, data) {
                Some(RecordContent::Message(header, data)) => take(&header, data),
                _ => Err(self.damage_error(RecordDamage::Form(opcode)).into()),
            }
        })
    }

    /// Hands over all records of the data. The checksums of chunks and attachments are compared before, that of all data at the
    /// end.
    pub fn visit_records(&self, take: &mut TableRecordCallback) -> Result<(), TableError> {
        self.visit_data_records(take).map_err(|stop| match stop {
            RecordVisitError::Damage(damage) => self.damage_error(damage).into(),
            RecordVisitError::Taker(error) => error,
        })
    }

    fn visit_data_records(&self, take: &mut TableRecordCallback) -> Result<(), RecordVisitError> {
        let mut records = McapRecordReader::open(&self.path)?;
        let (mut sum, mut ours, mut at) = (crc32fast::Hasher::new(), false, MAGIC.len() as u64);
        if !records.has_magic(0)? {
            return Err(RecordDamage::Expected { expected: "an MCAP file", at: 0 }.into());
        }
        sum.update(MAGIC);
        while let Some(frame) = records.read_frame(at)? {
            if !self.finished && is_truncated_record(&records, &frame) {
                return Ok(());
            }
            if frame.opcode == op::DATA_END && records.contains_record(&frame) {
                let proof = records.compare_data_checksum(at, sum.finalize())?;
                return Ok(require_own_checksum(ours, "data", at, proof)?);
            }
            let end = frame
                .end_offset()
                .filter(|_| records.contains_record(&frame))
                .ok_or(RecordDamage::Cut(at))?;
            if frame.opcode == op::ATTACHMENT && frame.length > LARGEST {
                records.update_checksum(at..end, &mut sum)?;
            } else {
                let body = records.read_body(&frame)?;
                sum.update(&frame.header_bytes());
                sum.update(&body);
                ours |= frame.opcode == op::HEADER && records::is_own_file_header(&body);
                if !visit_record_or_chunk(&frame, &body, ours, take)? {
                    return Ok(());
                }
            }
            at = end;
        }
        if self.finished { Err(RecordDamage::Cut(at).into()) } else { Ok(()) }
    }

    pub fn damage_error(&self, error: impl Into<RecordDamage>) -> RecordingError {
        let path = self.path.clone();
        match error.into() {
            RecordDamage::Io(source) => RecordingError::Read { path, source },
            RecordDamage::Chunk { source: McapError::UnsupportedCompression(compression), .. } => {
                RecordingError::Compression { path, compression }
            }
            source => RecordingError::Damaged { path, source },
        }
    }
}

/// Hands over a record, or the records of a chunk, after comparing its checksum.
fn visit_record_or_chunk(
    frame: &RecordFrame,
    body: &[u8],
    ours: bool,
    take: &mut TableRecordCallback,
) -> Result<bool, RecordVisitError> {
    let form = || RecordVisitError::from(RecordDamage::Form(frame.opcode));
    match frame.opcode {
        op::CHUNK => {
            let (header, _) = records::ChunkHeader::parse(body).ok_or_else(form)?;
            require_own_checksum(ours, "chunk", frame.at, header.checksum_status())?;
            records::verify_and_visit_chunk(frame, body, &mut |opcode, data| {
                take(opcode, data).map_err(RecordVisitError::Taker)
            })
        }
        op::ATTACHMENT => {
            let content = RecordContent::parse(frame.opcode, body);
            let Some(RecordContent::Attachment(attachment)) = content else { return Err(form()) };
            require_own_checksum(ours, "attachment", frame.at, attachment.verify_checksum(frame.at)?)?;
            take(frame.opcode, body).map_err(RecordVisitError::Taker)
        }
        opcode => take(opcode, body).map_err(RecordVisitError::Taker),
    }
}

/// What this program writes has checksums.
fn require_own_checksum(
    ours: bool,
    what: &'static str,
    at: u64,
    proof: ChecksumStatus,
) -> Result<(), RecordDamage> {
    let missing = ours && proof == ChecksumStatus::Missing;
    if missing { Err(RecordDamage::Unproven { what, at }) } else { Ok(()) }
}

/// How a file ends whose writer was killed: within a record, or in a chunk that has no length yet.
fn is_truncated_record(records: &McapRecordReader, frame: &RecordFrame) -> bool {
    let open = frame.length == u64::MAX && frame.opcode == op::CHUNK;
    !records.contains_record(frame) && frame.has_known_opcode() && (open || frame.length <= LARGEST)
}

/// Schemas and channels that have been read.
#[derive(Default)]
struct ChannelRegistry {
    known: ChannelAccumulator<'static>,
    numbers: Vec<u16>,
}

impl ChannelRegistry {
    fn add_record(&mut self, opcode: u8, data: &[u8]) -> Result<(), RecordDamage> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL) {
            return Ok(());
        }
        match RecordContent::parse(opcode, data).ok_or(RecordDamage::Form(opcode))? {
            RecordContent::Schema(header, data) => self.known.add_schema_from_slice(header, data)?,
            RecordContent::Channel(channel) => {
                self.numbers.push(channel.id);
                self.known.add_channel(channel)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn into_channels(self) -> ChannelsById {
        let channel = |id| Some((id, self.known.get(id)?));
        self.numbers.into_iter().filter_map(channel).collect()
    }
}

fn read_error(path: &Path, source: std::io::Error) -> RecordingError {
    RecordingError::Read { path: path.to_owned(), source }
}
