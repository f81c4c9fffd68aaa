//! Reads files and streams of Arrow IPC (Feather version 2): messages of record batches.
//!
//! The footer of a file says where its batches are; some writers, polars for one, leave no stream of messages in front of it. A file that was
//! cut off has no footer: it is read as the stream that most writers leave, as far as it goes.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use arrow_array::ArrayRef;
use arrow_buffer::Buffer;
use arrow_ipc::convert::fb_to_schema;
use arrow_ipc::reader::{read_dictionary, read_footer_length, read_record_batch};
use arrow_ipc::{MessageHeader, RecordBatch as Batch, root_as_footer, root_as_message};
use arrow_schema::{Schema, SchemaRef};

use crate::arrays::SchemaChannels;
use crate::panic_guard::catch_panics;
use crate::{ChunkCallback, Error, LogChannel, LogClock, LogReader};

/// What files begin with, those of version 1 of Feather, and streams.
const FILE: &[u8] = b"ARROW1\0\0";
const FEATHER_1: &[u8] = b"FEA1";
const STREAM: [u8; 4] = [0xff; 4];

/// Whether a file begins like this.
pub fn is_arrow(head: &[u8]) -> bool {
    // The first message of a stream, the schema, is short.
    let short = head.get(4..8).is_some_and(|it| it[3] == 0 && it[..3] != [0; 3]);
    head.starts_with(FILE) || head.starts_with(FEATHER_1) || (head.starts_with(&STREAM) && short)
}

/// Unpacked, the values of a column in a batch may have so many bytes [B].
const LARGEST: u64 = 1 << 31;

/// An Arrow file or stream.
pub struct ArrowLog {
    file: BufReader<File>,
    length: u64,
    /// The first byte behind the schema of a stream.
    begin: u64,
    /// Where messages are by the footer of a file.
    places: Option<Vec<u64>>,
    /// Bytes of messages that were read.
    read: u64,
    schema: SchemaRef,
    fields: SchemaChannels,
    cut: bool,
}

/// A message: its metadata, and the body.
struct IpcMessage {
    metadata: Vec<u8>,
    body: Buffer,
}

/// Sorts places of fields without repetition, and gives where each is then: readers hand over columns in the order of the file.
pub fn sort_unique_with_ranks(places: &mut Vec<usize>) -> Vec<usize> {
    let wanted = places.clone();
    places.sort_unstable();
    places.dedup();
    wanted.iter().filter_map(|it| places.binary_search(it).ok()).collect()
}

impl ArrowLog {
    /// Reads the schema.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut file = BufReader::new(File::open(path)?);
        let length = file.get_ref().metadata()?.len();
        let mut head = Vec::new();
        (&mut file).take(8).read_to_end(&mut head)?;
        if head.starts_with(FEATHER_1) {
            let what = "expected version 2 of Feather, found version 1";
            return Err(Error::new(format!("{what}: write it again with a newer library")));
        }
        if head == FILE
            && let Some((schema, places)) = read_footer(&mut file, length)?
        {
            let fields = SchemaChannels::new(&schema, None);
            let (schema, places) = (Arc::new(schema), Some(places));
            return Ok(ArrowLog { file, length, begin: 0, places, read: 0, schema, fields, cut: false });
        }
        let begin = if head == FILE { stream_start(&mut file)? } else { 0 };
        file.seek(SeekFrom::Start(begin))?;
        let mut arrow = ArrowLog {
            file,
            length,
            begin: 0,
            places: None,
            read: 0,
            schema: Arc::new(Schema::empty()),
            fields: SchemaChannels::new(&Schema::empty(), None),
            cut: false,
        };
        let none = || Error::new("expected a schema at the beginning of the Arrow file, found none");
        let message = arrow.read_next_message()?.ok_or_else(none)?;
        let schema = catch_panics("Arrow", || {
            let message = root_as_message(&message.metadata).map_err(|it| it.to_string())?;
            let schema = message.header_as_schema().ok_or("no schema at its beginning")?;
            Ok::<_, String>(fb_to_schema(schema))
        })?;
        arrow.fields = SchemaChannels::new(&schema, None);
        arrow.schema = Arc::new(schema);
        arrow.begin = arrow.file.stream_position()?;
        Ok(arrow)
    }

    /// The message of a turn, from 0 on: by the footer, or the one behind the one before.
    fn read_message(&mut self, turn: usize) -> Result<Option<IpcMessage>, Error> {
        let Some(places) = &self.places else { return self.read_next_message() };
        let Some(at) = places.get(turn).copied() else { return Ok(None) };
        self.file.seek(SeekFrom::Start(at))?;
        let none = || {
            Error::new(format!("byte {at}: the footer of the Arrow file expects a message here, found none"))
        };
        self.read_next_message()?.map(Some).ok_or_else(none)
    }

    /// The next message; nothing at the end, or where the file was cut off.
    fn read_next_message(&mut self) -> Result<Option<IpcMessage>, Error> {
        let at = self.file.stream_position()?;
        let Some(mut size) = self.read_u32()? else {
            self.cut = true;
            return Ok(None);
        };
        // Streams before version 0.15 have no such word.
        if size == u32::from_le_bytes(STREAM) {
            let Some(next) = self.read_u32()? else { return Ok(None) };
            size = next;
        }
        let left = |file: &mut BufReader<File>, length: u64| {
            Ok::<_, Error>(length.saturating_sub(file.stream_position()?))
        };
        if size == 0 {
            return Ok(None);
        }
        if u64::from(size) > left(&mut self.file, self.length)? {
            self.cut = true;
            return Ok(None);
        }
        let mut metadata = vec![0; size as usize];
        self.file.read_exact(&mut metadata)?;
        let damaged = |error: &dyn std::fmt::Display| {
            Error::new(format!(
                "byte {at}: expected a message of Arrow, found a damaged one; was the file copied in full? {error}"
            ))
        };
        let length = root_as_message(&metadata).map_err(|error| damaged(&error))?.bodyLength();
        let length = u64::try_from(length).map_err(|error| damaged(&error))?;
        if length > left(&mut self.file, self.length)? {
            self.cut = true;
            return Ok(None);
        }
        // A footer that refers to a message many times would make a small file endless.
        self.read += u64::from(size) + length;
        if self.read > self.length {
            return Err(damaged(&"the footer refers to some messages twice"));
        }
        let mut body = vec![0; length as usize];
        self.file.read_exact(&mut body)?;
        Ok(Some(IpcMessage { metadata, body: body.into() }))
    }

    fn read_u32(&mut self) -> Result<Option<u32>, Error> {
        let mut bytes = Vec::new();
        (&mut self.file).take(4).read_to_end(&mut bytes)?;
        Ok(bytes.try_into().ok().map(u32::from_le_bytes))
    }
}

/// The first byte of the stream in a file: writers fill up with zeros to 8 or 64 bytes.
fn stream_start(file: &mut BufReader<File>) -> Result<u64, Error> {
    let mut begin = FILE.len() as u64;
    file.seek(SeekFrom::Start(begin))?;
    let mut bytes = [0; 8];
    while begin < 64 && file.read_exact(&mut bytes).is_ok() && bytes == [0; 8] {
        begin += 8;
    }
    Ok(begin)
}

/// The schema, and where the messages of dictionaries and batches are; nothing where a file has no sound footer.
fn read_footer(file: &mut BufReader<File>, length: u64) -> Result<Option<(Schema, Vec<u64>)>, Error> {
    let mut end = [0; 10];
    if length < FILE.len() as u64 + end.len() as u64 {
        return Ok(None);
    }
    file.seek(SeekFrom::End(-10))?;
    file.read_exact(&mut end)?;
    let Some(size) = read_footer_length(end).ok().filter(|it| *it as u64 <= length - 18) else {
        return Ok(None);
    };
    let mut bytes = vec![0; size];
    file.seek(SeekFrom::End(-10 - size as i64))?;
    file.read_exact(&mut bytes)?;
    catch_panics("Arrow", || {
        let footer = root_as_footer(&bytes).map_err(|it| it.to_string())?;
        let schema = footer.schema().ok_or("no schema in its footer")?;
        let blocks = footer.dictionaries().into_iter().chain(footer.recordBatches()).flatten();
        let places = blocks.map(|it| u64::try_from(it.offset()).map_err(|it| it.to_string()));
        Ok::<_, String>(Some((fb_to_schema(schema), places.collect::<Result<_, _>>()?)))
    })
}

/// Refuses a batch whose packed parts claim to be larger than any of them may be: memory for them would be taken at once.
fn check_batch_size(batch: &Batch, body: &Buffer) -> Result<(), String> {
    if batch.compression().is_none() {
        return Ok(());
    }
    for buffer in batch.buffers().into_iter().flatten() {
        let at = usize::try_from(buffer.offset()).map_err(|error| error.to_string())?;
        let Some(stated) = at.checked_add(8).and_then(|end| body.get(at..end)) else { continue };
        let stated = stated.iter().rev().fold(0u64, |sum, byte| sum << 8 | u64::from(*byte));
        if stated > LARGEST && stated != u64::MAX {
            return Err(format!("a column of {stated} bytes in one batch, expected at most {LARGEST}"));
        }
    }
    Ok(())
}

impl LogReader for ArrowLog {
    fn channels(&self) -> &[LogChannel] {
        &self.fields.channels
    }

    fn clocks(&self) -> &[LogClock] {
        &self.fields.clocks
    }

    fn read_chunks(&mut self, _clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error> {
        self.file.seek(SeekFrom::Start(self.begin))?;
        (self.cut, self.read) = (false, 0);
        let mut places: Vec<usize> = wanted.iter().map(|it| self.fields.places[*it]).collect();
        let columns = sort_unique_with_ranks(&mut places);
        let mut known: HashMap<i64, ArrayRef> = HashMap::new();
        let schema = self.schema.clone();
        let mut turn = 0;
        while let Some(IpcMessage { metadata, body }) = self.read_message(turn)? {
            turn += 1;
            let batch = catch_panics("Arrow", || {
                let message = root_as_message(&metadata).map_err(|it| it.to_string())?;
                let version = message.version();
                if message.header_type() == MessageHeader::DictionaryBatch {
                    let batch = message.header_as_dictionary_batch().ok_or("no dictionary")?;
                    check_batch_size(&batch.data().ok_or("an empty dictionary")?, &body)?;
                    let added = read_dictionary(&body, batch, &schema, &mut known, &version);
                    return added.map(|()| None).map_err(|it| it.to_string());
                }
                let Some(batch) = message.header_as_record_batch() else { return Ok(None) };
                check_batch_size(&batch, &body)?;
                let read = (schema.clone(), &known, Some(&places[..]));
                let batch = read_record_batch(&body, batch, read.0, read.1, read.2, &version);
                batch.map(Some).map_err(|it| it.to_string())
            })?;
            if batch.is_some_and(|batch| !SchemaChannels::emit_batch(&batch, &columns, take)) {
                break;
            }
        }
        Ok(())
    }

    fn skipped_contents(&self) -> Vec<String> {
        self.fields.left_out.clone()
    }

    fn warnings(&self) -> Vec<String> {
        let cut = "the file was cut off: it is read up to its last complete batch";
        self.cut.then(|| cut.to_owned()).into_iter().collect()
    }
}
