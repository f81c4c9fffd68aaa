//! Goes through the records of an MCAP file, also of one whose writer was killed.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::read::ChannelAccumulator;
use mcap::records::{MessageHeader, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader};
use mcap::{Channel, MAGIC, McapError, parse_record};

use super::{RecordingError, TableError};

/// A chunk or record that would take more memory than this [B] is taken for damage.
const LARGEST: usize = 1 << 30;
/// How much is read at once [B].
const BUFFER: usize = 1 << 18;

/// The channels by their numbers, which is the order in which most writers add them.
pub type Channels = BTreeMap<u16, Arc<Channel<'static>>>;

/// Takes a message and says whether it wants more.
type TakeMessage<'a> = dyn FnMut(&MessageHeader, &[u8]) -> Result<bool, TableError> + 'a;
/// Takes the opcode and the content of a record and says whether it wants more.
type TakeRecord<'a> = dyn FnMut(u8, &[u8]) -> Result<bool, TableError> + 'a;

/// An MCAP file.
#[derive(Debug)]
pub struct Mcap {
    /// Where it is.
    pub path: PathBuf,
    /// Whether its writer came to the end: otherwise what is behind the last whole chunk is lost.
    pub finished: bool,
}

impl Mcap {
    /// Looks at how the file ends.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let end = || {
            let mut file = File::open(path)?;
            let mut end = [0; MAGIC.len()];
            // A file of the opening magic alone does not end with the closing one.
            if file.seek(SeekFrom::End(0))? >= 2 * MAGIC.len() as u64 {
                file.seek(SeekFrom::End(-(MAGIC.len() as i64)))?;
                file.read_exact(&mut end)?;
            }
            Ok(end == MAGIC)
        };
        let finished = end().map_err(|source| self::unreadable(path, source))?;
        Ok(Mcap { path: path.to_owned(), finished })
    }

    /// The channels, from the summary at the end of the file if there is one with them.
    pub fn channels(&self) -> Result<Channels, TableError> {
        let summary = if self.finished { self.summary()? } else { BTreeMap::new() };
        if !summary.is_empty() {
            return Ok(summary);
        }
        let (mut known, mut numbers) = (ChannelAccumulator::default(), Vec::new());
        self.records(&mut |opcode, data| {
            match parse(opcode, data).map_err(|error| self.damaged(error))? {
                Some(Record::Schema { header, data }) => known.add_schema_from_slice(header, &data),
                Some(Record::Channel(channel)) => {
                    numbers.push(channel.id);
                    known.add_channel(channel)
                }
                _ => Ok(()),
            }
            .map_err(|error| self.damaged(error))?;
            Ok(true)
        })?;
        Ok(numbers.into_iter().filter_map(|id| Some((id, known.get(id)?))).collect())
    }

    fn summary(&self) -> Result<Channels, RecordingError> {
        let mut file = File::open(&self.path).map_err(|source| unreadable(&self.path, source))?;
        let mut reader = SummaryReader::new();
        while let Some(event) = reader.next_event() {
            match event.map_err(|error| self.damaged(error))? {
                SummaryReadEvent::ReadRequest(size) => {
                    let read = file.read(reader.insert(size.min(BUFFER)));
                    reader.notify_read(read.map_err(|source| unreadable(&self.path, source))?);
                }
                SummaryReadEvent::SeekRequest(to) => {
                    let place = file.seek(to);
                    reader.notify_seeked(place.map_err(|source| unreadable(&self.path, source))?);
                }
            }
        }
        Ok(reader
            .finish()
            .map(|summary| summary.channels.into_iter().collect())
            .unwrap_or_default())
    }

    /// Hands over the messages, in the order of the file, until `take` says that it has enough.
    pub fn messages(&self, take: &mut TakeMessage) -> Result<(), TableError> {
        self.records(&mut |opcode, data| {
            if opcode != op::MESSAGE {
                return Ok(true);
            }
            match parse(opcode, data).map_err(|error| self.damaged(error))? {
                Some(Record::Message { header, data }) => take(&header, &data),
                _ => Ok(true),
            }
        })
    }

    /// Hands over all records, of which those in chunks are checked before.
    pub fn records(&self, take: &mut TakeRecord) -> Result<(), TableError> {
        let file = File::open(&self.path).map_err(|source| unreadable(&self.path, source))?;
        let mut file = BufReader::with_capacity(BUFFER, file);
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_record_length_limit(LARGEST);
        let mut reader = LinearReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(size)) => {
                    let read = file.read(reader.insert(size.min(BUFFER)));
                    reader.notify_read(read.map_err(|source| unreadable(&self.path, source))?);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    if !take(opcode, data)? {
                        return Ok(());
                    }
                }
                Err(error) if !self.finished && cut(&error) => return Ok(()),
                Err(error) => return Err(self.damaged(error).into()),
            }
        }
        Ok(())
    }

    pub fn damaged(&self, error: McapError) -> RecordingError {
        let path = self.path.clone();
        match error {
            McapError::UnsupportedCompression(compression) => {
                RecordingError::Compression { path, compression }
            }
            source => RecordingError::Damaged { path, source },
        }
    }
}

fn unreadable(path: &Path, source: std::io::Error) -> RecordingError {
    RecordingError::Read { path: path.to_owned(), source }
}

/// Attachments and indexes are not looked at.
fn parse(opcode: u8, data: &[u8]) -> Result<Option<Record<'_>>, McapError> {
    let wanted = matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE);
    wanted.then(|| parse_record(opcode, data)).transpose()
}

/// How a file ends whose writer was killed: within a record, or in a chunk that has no length yet.
fn cut(error: &McapError) -> bool {
    matches!(
        error,
        McapError::UnexpectedEof | McapError::RecordTooLarge { .. } | McapError::ChunkTooLarge(_)
    )
}
