//! Iterates over the records of an MCAP file, also of one whose writer was killed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::read::ChannelAccumulator;
use mcap::records::{MessageHeader, op};
use mcap::{Channel, MAGIC, McapError};

use super::{RecordingError, TableError};
use crate::records::{self, ChecksumStatus, Content, Damage, Frame, LARGEST, Records};

/// The channels by their numbers, which is the order in which most writers add them.
pub type Channels = BTreeMap<u16, Arc<Channel<'static>>>;

/// Takes a message and says whether it wants more.
pub type TakeMessage<'a> = dyn FnMut(&MessageHeader, &[u8]) -> Result<bool, TableError> + 'a;
/// Takes the opcode and the content of a record and says whether it wants more.
type TakeRecord<'a> = records::RecordCallback<'a, TableError>;

/// An MCAP file.
#[derive(Debug)]
pub struct Mcap {
    /// Where it is.
    pub path: PathBuf,
    /// Whether its writer came to the end: otherwise what is behind the last whole chunk is lost.
    pub finished: bool,
}

/// Why a walk through the records ended early.
enum RecordVisitError {
    Damage(Damage),
    /// The taker wants no more, for this reason.
    Taker(TableError),
}

impl From<Damage> for RecordVisitError {
    fn from(damage: Damage) -> Self {
        RecordVisitError::Damage(damage)
    }
}

impl From<std::io::Error> for RecordVisitError {
    fn from(error: std::io::Error) -> Self {
        RecordVisitError::Damage(Damage::Io(error))
    }
}

impl Mcap {
    /// Looks at how the file ends.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let finished = Records::open(path).and_then(|mut records| records.is_finished());
        let finished = finished.map_err(|source| unreadable(path, source))?;
        Ok(Mcap { path: path.to_owned(), finished })
    }

    /// The channels, from the summary at the end of the file if there is one with them.
    pub fn channels(&self) -> Result<Channels, TableError> {
        let summary = if self.finished { self.summary()? } else { BTreeMap::new() };
        if !summary.is_empty() {
            return Ok(summary);
        }
        let mut known = ChannelRegistry::default();
        self.records(&mut |opcode, data| {
            known.add(opcode, data).map_err(|error| self.damaged(error))?;
            Ok(true)
        })?;
        Ok(known.channels())
    }

    fn summary(&self) -> Result<Channels, RecordingError> {
        let read = || {
            let mut records = Records::open(&self.path)?;
            let at = records.length;
            let none = Damage::Expected { expected: "a footer at the end of the file", at };
            let ending = records.ending()?.ok_or(none)?;
            let (summary, _) = records.summary(&ending)?;
            let mut known = ChannelRegistry::default();
            records::each(ending.data_end, &summary, &mut |opcode, data| {
                known.add(opcode, data).map(|()| true)
            })?;
            Ok(known.channels())
        };
        read().map_err(|error: Damage| self.damaged(error))
    }

    /// Hands over the messages, in the order of the file, until `take` says that it has enough.
    pub fn messages(&self, take: &mut TakeMessage) -> Result<(), TableError> {
        self.records(&mut |opcode, data| {
            if opcode != op::MESSAGE {
                return Ok(true);
            }
            match Content::parse(opcode, data) {
                Some(Content::Message(header, data)) => take(&header, data),
                _ => Err(self.damaged(Damage::Form(opcode)).into()),
            }
        })
    }

    /// Hands over all records of the data. The checksums of chunks and attachments are compared before, that of all data at the
    /// end.
    pub fn records(&self, take: &mut TakeRecord) -> Result<(), TableError> {
        self.walk(take).map_err(|stop| match stop {
            RecordVisitError::Damage(damage) => self.damaged(damage).into(),
            RecordVisitError::Taker(error) => error,
        })
    }

    fn walk(&self, take: &mut TakeRecord) -> Result<(), RecordVisitError> {
        let mut records = Records::open(&self.path)?;
        let (mut sum, mut ours, mut at) = (crc32fast::Hasher::new(), false, MAGIC.len() as u64);
        if !records.has_magic(0)? {
            return Err(Damage::Expected { expected: "an MCAP file", at: 0 }.into());
        }
        sum.update(MAGIC);
        while let Some(frame) = records.frame(at)? {
            if !self.finished && is_torn(&records, &frame) {
                return Ok(());
            }
            if frame.opcode == op::DATA_END && records.holds(&frame) {
                let proof = records.verify_sum(at, sum.finalize())?;
                return Ok(insist(ours, "data", at, proof)?);
            }
            let end = frame.end().filter(|_| records.holds(&frame)).ok_or(Damage::Cut(at))?;
            if frame.opcode == op::ATTACHMENT && frame.length > LARGEST {
                records.add_up(at..end, &mut sum)?;
            } else {
                let body = records.body(&frame)?;
                sum.update(&frame.head());
                sum.update(&body);
                ours |= frame.opcode == op::HEADER && records::is_ours(&body);
                if !hand_over(&frame, &body, ours, take)? {
                    return Ok(());
                }
            }
            at = end;
        }
        if self.finished { Err(Damage::Cut(at).into()) } else { Ok(()) }
    }

    pub fn damaged(&self, error: impl Into<Damage>) -> RecordingError {
        let path = self.path.clone();
        match error.into() {
            Damage::Io(source) => RecordingError::Read { path, source },
            Damage::Chunk { source: McapError::UnsupportedCompression(compression), .. } => {
                RecordingError::Compression { path, compression }
            }
            source => RecordingError::Damaged { path, source },
        }
    }
}

/// Hands over a record, or the records of a chunk, after comparing its checksum.
fn hand_over(
    frame: &Frame,
    body: &[u8],
    ours: bool,
    take: &mut TakeRecord,
) -> Result<bool, RecordVisitError> {
    let form = || RecordVisitError::from(Damage::Form(frame.opcode));
    match frame.opcode {
        op::CHUNK => {
            let (header, _) = records::ChunkHeader::parse(body).ok_or_else(form)?;
            insist(ours, "chunk", frame.at, header.proof())?;
            records::unpack(frame, body, &mut |opcode, data| {
                take(opcode, data).map_err(RecordVisitError::Taker)
            })
        }
        op::ATTACHMENT => {
            let content = Content::parse(frame.opcode, body);
            let Some(Content::Attachment(attachment)) = content else { return Err(form()) };
            insist(ours, "attachment", frame.at, attachment.verify(frame.at)?)?;
            take(frame.opcode, body).map_err(RecordVisitError::Taker)
        }
        opcode => take(opcode, body).map_err(RecordVisitError::Taker),
    }
}

/// What this program writes has checksums.
fn insist(ours: bool, what: &'static str, at: u64, proof: ChecksumStatus) -> Result<(), Damage> {
    let missing = ours && proof == ChecksumStatus::Missing;
    if missing { Err(Damage::Unproven { what, at }) } else { Ok(()) }
}

/// How a file ends whose writer was killed: within a record, or in a chunk that has no length yet.
fn is_torn(records: &Records, frame: &Frame) -> bool {
    let open = frame.length == u64::MAX && frame.opcode == op::CHUNK;
    !records.holds(frame) && frame.is_known() && (open || frame.length <= LARGEST)
}

/// Schemas and channels that have been read.
#[derive(Default)]
struct ChannelRegistry {
    known: ChannelAccumulator<'static>,
    numbers: Vec<u16>,
}

impl ChannelRegistry {
    fn add(&mut self, opcode: u8, data: &[u8]) -> Result<(), Damage> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL) {
            return Ok(());
        }
        match Content::parse(opcode, data).ok_or(Damage::Form(opcode))? {
            Content::Schema(header, data) => self.known.add_schema_from_slice(header, data)?,
            Content::Channel(channel) => {
                self.numbers.push(channel.id);
                self.known.add_channel(channel)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn channels(self) -> Channels {
        let channel = |id| Some((id, self.known.get(id)?));
        self.numbers.into_iter().filter_map(channel).collect()
    }
}

fn unreadable(path: &Path, source: std::io::Error) -> RecordingError {
    RecordingError::Read { path: path.to_owned(), source }
}
