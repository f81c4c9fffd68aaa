//! Reads the records of an MCAP file by their places, and compares their checksums; nothing that the file says about itself is
//! believed before.

mod content;
pub(crate) mod tail;

use std::fs::File;
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom};
use std::ops::Range;
use std::path::Path;

use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{MAGIC, McapError, records::op};

pub(crate) use self::content::{
    ChunkHeader, McapStatistics, RecordContent, is_own_file_header, metadata_checksum_entry, verify_metadata,
};

/// A record or a chunk that would take more memory than this [B] is not read.
pub(crate) const LARGEST: u64 = 256 << 20;
/// How much is read at once [B].
const BUFFER: usize = 1 << 18;
/// The bytes of opcode and length before each record.
const HEAD: u64 = 9;
/// The bytes of the records that end a file, their heads included.
const DATA_END: u64 = HEAD + 4;
const FOOTER: u64 = HEAD + 20;
/// lz4 makes no more of a byte than this many, its frame aside.
const LZ4_AT_MOST: u64 = 255;

/// Why a record cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecordDamage {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The file ends before the record does.
    #[error("the file ends within the record at byte {0}")]
    Cut(u64),
    /// There is no record, or one of another form.
    #[error("expected {expected} at byte {at}")]
    Expected {
        /// What should be there.
        expected: &'static str,
        /// Its place in the file [B].
        at: u64,
    },
    /// The contents differ from those that were written.
    #[error("the checksum of the {what} at byte {at} is {found:08x}, expected {expected:08x}")]
    Checksum {
        /// What has the checksum.
        what: &'static str,
        /// Its place in the file [B].
        at: u64,
        /// The checksum of the contents.
        found: u32,
        /// The one in the file.
        expected: u32,
    },
    /// Entries differ from those that were written.
    #[error("the metadata `{0}` do not fit their checksum")]
    Metadata(String),
    /// This program writes checksums, so one that is missing is damage.
    #[error("the {what} at byte {at} has no checksum")]
    Unproven {
        /// What has none.
        what: &'static str,
        /// Its place in the file [B].
        at: u64,
    },
    /// The record is too large.
    #[error("the record at byte {at} has {length} bytes, at most {LARGEST} are read")]
    Large {
        /// Its place in the file [B].
        at: u64,
        /// Its length [B].
        length: u64,
    },
    /// A record has not the form of its opcode.
    #[error("a record of the opcode {0:#04x} has another form than expected")]
    Form(u8),
    /// Records contradict each other.
    #[error(transparent)]
    Contradiction(#[from] McapError),
    /// The contents of a chunk are wrong.
    #[error("the chunk at byte {at}: {source}")]
    Chunk {
        /// Its place in the file [B].
        at: u64,
        /// What is wrong.
        source: McapError,
    },
}

/// What is wrong. The error of the crate `mcap` speaks of compression when a disk is full.
pub(crate) fn describe_mcap_error(error: McapError) -> String {
    match error {
        McapError::Io(error) => error.to_string(),
        error => error.to_string(),
    }
}

/// Whether a checksum confirms what it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ChecksumStatus {
    /// It does.
    Valid,
    /// There is none.
    Missing,
}

impl ChecksumStatus {
    fn compare_checksums(
        what: &'static str,
        at: u64,
        found: u32,
        expected: u32,
    ) -> Result<Self, RecordDamage> {
        match expected {
            0 => Ok(ChecksumStatus::Missing),
            _ if expected == found => Ok(ChecksumStatus::Valid),
            _ => Err(RecordDamage::Checksum { what, at, found, expected }),
        }
    }
}

/// The place of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RecordFrame {
    /// Where its opcode is.
    pub at: u64,
    pub opcode: u8,
    /// The length of its body [B].
    pub length: u64,
}

impl RecordFrame {
    /// Where its body begins.
    pub fn body_offset(&self) -> u64 {
        self.at + HEAD
    }

    /// Where the next record begins; none if that is more than a number can say.
    pub fn end_offset(&self) -> Option<u64> {
        self.body_offset().checked_add(self.length)
    }

    /// Its opcode and length as they stand in the file.
    pub fn header_bytes(&self) -> [u8; HEAD as usize] {
        let mut head = [self.opcode; HEAD as usize];
        head[1..].copy_from_slice(&self.length.to_le_bytes());
        head
    }

    /// Whether the opcode is one of MCAP's or of a private record.
    pub fn has_known_opcode(&self) -> bool {
        matches!(self.opcode, op::HEADER..=op::DATA_END | 0x80..)
    }
}

/// How a complete file ends: data, summary, footer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct McapTrailer {
    /// Where the record stands that ends the data.
    pub data_end: u64,
    /// Where the summary begins; none if there is none.
    summary: Option<u64>,
    footer: u64,
    summary_crc: u32,
}

/// An MCAP file, of which any place can be read.
#[derive(Debug)]
pub(crate) struct McapRecordReader {
    file: BufReader<File>,
    position: u64,
    /// Its length [B].
    pub length: u64,
}

impl McapRecordReader {
    /// Opens a file.
    ///
    /// # Errors
    /// When it cannot be opened, or is no file on a disk.
    pub fn open(path: &Path) -> io::Result<Self> {
        let about = std::fs::metadata(path)?;
        if !about.is_file() {
            return Err(io::Error::other("expected a file on a disk"));
        }
        let file = BufReader::with_capacity(BUFFER, File::open(path)?);
        Ok(McapRecordReader { file, position: 0, length: about.len() })
    }

    /// Reads from a place on; fewer bytes than wanted where the file ends.
    pub fn read_at(&mut self, at: u64, wanted: u64) -> io::Result<Vec<u8>> {
        let offset = at as i128 - i128::from(self.position);
        match i64::try_from(offset) {
            Ok(offset) => self.file.seek_relative(offset)?,
            Err(_) => drop(self.file.seek(SeekFrom::Start(at))?),
        }
        let there = wanted.min(self.length.saturating_sub(at));
        let mut bytes = Vec::with_capacity(there as usize);
        let read = (&mut self.file).take(there).read_to_end(&mut bytes);
        self.position = at + bytes.len() as u64;
        read.map(|_| bytes)
    }

    /// The next place from one on that is no hole of a sparse file: such holes are zeros, as many as anybody likes.
    pub fn skip_sparse_hole(&mut self, at: u64) -> io::Result<u64> {
        let found = match rustix::fs::seek(self.file.get_ref(), rustix::fs::SeekFrom::Data(at)) {
            Ok(place) => place.max(at),
            Err(rustix::io::Errno::NXIO) => self.length.max(at),
            // The file system does not tell.
            Err(_) => at,
        };
        self.file.seek(SeekFrom::Start(found))?;
        self.position = found;
        Ok(found)
    }

    /// Whether the file begins and ends like an MCAP file.
    pub fn has_magic(&mut self, at: u64) -> io::Result<bool> {
        Ok(self.read_at(at, MAGIC.len() as u64)? == MAGIC)
    }

    /// Whether its writer came to the end.
    pub fn is_file_complete(&mut self) -> io::Result<bool> {
        let magic = MAGIC.len() as u64;
        // A file of the opening magic alone does not end with the closing one.
        Ok(self.length >= 2 * magic && self.has_magic(self.length - magic)?)
    }

    /// What stands at a place as opcode and length; none if the file ends before.
    pub fn read_frame(&mut self, at: u64) -> io::Result<Option<RecordFrame>> {
        let head = self.read_at(at, HEAD)?;
        let frame = head.split_first_chunk().and_then(|([opcode], length)| {
            let length = u64::from_le_bytes(length.try_into().ok()?);
            Some(RecordFrame { at, opcode: *opcode, length })
        });
        Ok(frame)
    }

    /// Whether the file goes on to the end of a record.
    pub fn contains_record(&self, frame: &RecordFrame) -> bool {
        frame.end_offset().is_some_and(|end| end <= self.length)
    }

    /// The body of a record.
    ///
    /// # Errors
    /// When the file ends before, or the body is too large.
    pub fn read_body(&mut self, frame: &RecordFrame) -> Result<Vec<u8>, RecordDamage> {
        if !self.contains_record(frame) {
            return Err(RecordDamage::Cut(frame.at));
        }
        if frame.length > LARGEST {
            return Err(RecordDamage::Large { at: frame.at, length: frame.length });
        }
        Ok(self.read_at(frame.body_offset(), frame.length)?)
    }

    /// How the file ends, if its writer came to the end and what it wrote there fits together.
    pub fn read_trailer(&mut self) -> Result<Option<McapTrailer>, RecordDamage> {
        let magic = MAGIC.len() as u64;
        if self.length < 2 * magic + FOOTER + DATA_END || !self.is_file_complete()? {
            return Ok(None);
        }
        let at = self.length - magic - FOOTER;
        let footer = self.read_at(at, FOOTER)?;
        let number = |place: usize| footer[place..].first_chunk().map(|it| u64::from_le_bytes(*it));
        let crc = footer.last_chunk().map(|it| u32::from_le_bytes(*it));
        let (Some(20), Some(start), Some(summary_crc)) = (number(1), number(9), crc) else {
            return Ok(None);
        };
        let summary = (start != 0).then_some(start);
        let data_end = summary.unwrap_or(at).checked_sub(DATA_END);
        let Some(data_end) = data_end.filter(|end| footer[0] == op::FOOTER && end + DATA_END <= at) else {
            return Ok(None);
        };
        let end = self.read_frame(data_end)?;
        let fits = end.is_some_and(|end| end.opcode == op::DATA_END && end.length == 4);
        Ok(fits.then_some(McapTrailer { data_end, summary, footer: at, summary_crc }))
    }

    /// Compares the checksum over all data.
    ///
    /// # Errors
    /// When it differs.
    pub fn verify_data(&mut self, ending: &McapTrailer) -> Result<ChecksumStatus, RecordDamage> {
        let mut sum = crc32fast::Hasher::new();
        self.update_checksum(0..ending.data_end, &mut sum)?;
        self.compare_data_checksum(ending.data_end, sum.finalize())
    }

    /// Adds bytes to a checksum.
    ///
    /// # Errors
    /// When the file ends before they do.
    pub fn update_checksum(
        &mut self,
        bytes: Range<u64>,
        sum: &mut crc32fast::Hasher,
    ) -> Result<(), RecordDamage> {
        let mut at = bytes.start;
        while at < bytes.end {
            let piece = self.read_at(at, (bytes.end - at).min(BUFFER as u64))?;
            if piece.is_empty() {
                return Err(RecordDamage::Cut(at));
            }
            sum.update(&piece);
            at += piece.len() as u64;
        }
        Ok(())
    }

    /// Compares the sum of the data with the one in the record that ends it.
    pub fn compare_data_checksum(
        &mut self,
        data_end: u64,
        found: u32,
    ) -> Result<ChecksumStatus, RecordDamage> {
        let expected = self.read_at(data_end + HEAD, 4)?;
        let expected = expected.first_chunk().ok_or(RecordDamage::Cut(data_end))?;
        ChecksumStatus::compare_checksums("data", data_end, found, u32::from_le_bytes(*expected))
    }

    /// The summary, with the proof of its checksum.
    ///
    /// # Errors
    /// When the checksum differs, or the summary is too large.
    pub fn read_summary(&mut self, ending: &McapTrailer) -> Result<(Vec<u8>, ChecksumStatus), RecordDamage> {
        let start = ending.summary.unwrap_or(ending.footer);
        let length = ending.footer - start;
        if length > LARGEST {
            return Err(RecordDamage::Large { at: start, length });
        }
        let mut bytes = self.read_at(start, length + FOOTER - 4)?;
        let proof =
            ChecksumStatus::compare_checksums("summary", start, crc32fast::hash(&bytes), ending.summary_crc)?;
        bytes.truncate(length as usize);
        Ok((bytes, proof))
    }
}

/// Takes the opcode and the content of a record and says whether it wants more.
pub(crate) type RecordCallback<'a, E> = dyn FnMut(u8, &[u8]) -> Result<bool, E> + 'a;

/// Goes through the records that stand one behind the other.
///
/// # Errors
/// When the last one is not whole, or `take` fails.
pub(crate) fn for_each_record<E: From<RecordDamage>>(
    at: u64,
    mut records: &[u8],
    take: &mut RecordCallback<E>,
) -> Result<bool, E> {
    while !records.is_empty() {
        let cut = || E::from(RecordDamage::Cut(at));
        let (head, rest) = records.split_first_chunk::<{ HEAD as usize }>().ok_or_else(cut)?;
        let length = u64::from_le_bytes(*head.last_chunk().ok_or_else(cut)?);
        let length = usize::try_from(length).map_err(|_| cut())?;
        let (body, rest) = rest.split_at_checked(length).ok_or_else(cut)?;
        if !take(head[0], body)? {
            return Ok(false);
        }
        records = rest;
    }
    Ok(true)
}

/// Compares the checksum of a chunk, and hands over its records if that is right or missing.
///
/// # Errors
/// When the checksum differs or the contents cannot be unpacked, or `take` fails.
pub(crate) fn verify_and_visit_chunk<E: From<RecordDamage>>(
    frame: &RecordFrame,
    body: &[u8],
    take: &mut RecordCallback<E>,
) -> Result<bool, E> {
    let wrong = |source| E::from(RecordDamage::Chunk { at: frame.at, source });
    let expected = || RecordDamage::Expected { expected: "the header of a chunk", at: frame.at };
    let (header, records) = ChunkHeader::parse(body).ok_or_else(expected)?;
    if header.compression.is_empty() {
        ChecksumStatus::compare_checksums("chunk", frame.at, crc32fast::hash(records), header.crc)?;
        return for_each_record(frame.at, records, take);
    }
    let packed = records.len() as u64;
    let claimed = if header.compression == "lz4" { LZ4_AT_MOST * packed } else { LARGEST };
    if header.size > claimed.min(LARGEST) {
        return Err(wrong(McapError::ChunkTooLarge(header.size)));
    }
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(LARGEST as usize);
    let mut reader = LinearReader::new_with_options(options);
    let head = frame.header_bytes();
    let mut whole = head.chain(body);
    while let Some(event) = reader.next_event() {
        match event.map_err(wrong)? {
            LinearReadEvent::ReadRequest(size) => {
                let read = whole.read(reader.insert(size.min(BUFFER))).map_err(RecordDamage::from)?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => {
                if !take(opcode, data)? {
                    return Ok(false);
                }
            }
        }
    }
    Ok(true)
}
