//! Writes rows as a file of MDF 4.10: one group, packed blocks of rows, texts of any length.
//!
//! A block is written before the link that leads to it, and the count of rows last. So the file is a whole one after every
//! [`MdfWriter::flush_rows`], also when the program is killed later: it has the rows up to there.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use flate2::Compression;
use flate2::read::ZlibEncoder;

use crate::column::{MdfCell, MdfColumn, MdfColumnType, MdfDescription};
use crate::error::Error;
use crate::head::{FileHead, PatchOffsets};

/// Bytes of rows or texts that make a block. The standard wants at most 4 MiB.
const BLOCK: usize = 1 << 20;

/// Writes rows as a file. The time is the first channel, `time` in seconds, and the master of all others.
pub struct MdfWriter {
    file: File,
    /// The length of the file [B].
    end: u64,
    kinds: Vec<MdfColumnType>,
    offsets: PatchOffsets,
    /// Bytes of a row.
    record: u32,
    rows: u64,
    /// Rows that are not written yet.
    waiting: Vec<u8>,
    data: BlockChain,
    /// The texts of each column of texts.
    texts: Vec<TextColumnBuffer>,
}

/// A list of blocks that grows.
struct BlockChain {
    /// Where the link to the list is, and the list's head; done when the first block is there.
    begin: Option<(u64, u64)>,
    /// Where the link to the next block of the list is.
    next: u64,
    /// Bytes of all blocks when they are unpacked.
    length: u64,
}

struct TextColumnBuffer {
    chain: BlockChain,
    waiting: Vec<u8>,
}

impl MdfWriter {
    /// Begins a file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path, about: &MdfDescription, columns: &[MdfColumn]) -> Result<Self, Error> {
        let head = FileHead::new(about, columns);
        let mut file = File::create(path)?;
        file.write_all(&head.bytes)?;
        let chain = |(link, list): (u64, u64)| BlockChain {
            begin: Some((link, list)),
            // The first link of the head of a list.
            next: list + 24,
            length: 0,
        };
        let texts =
            head.offsets.texts.iter().map(|it| TextColumnBuffer { chain: chain(*it), waiting: vec![] });
        Ok(Self {
            file,
            end: head.bytes.len() as u64,
            kinds: columns.iter().map(|it| it.kind).collect(),
            record: head.record,
            rows: 0,
            waiting: Vec::new(),
            data: chain(head.offsets.data),
            texts: texts.collect(),
            offsets: head.offsets,
        })
    }

    /// Takes a row: its time [s] and a cell for each column.
    ///
    /// # Errors
    /// When the cells do not fit the columns, or rows cannot be written.
    pub fn write_row(&mut self, time: f64, cells: &[MdfCell]) -> Result<(), Error> {
        let fits = |kind: &MdfColumnType, cell: &MdfCell| {
            matches!(
                (kind, cell),
                (MdfColumnType::Real, MdfCell::Real(_))
                    | (MdfColumnType::Signed, MdfCell::Signed(_))
                    | (MdfColumnType::Unsigned, MdfCell::Unsigned(_))
                    | (MdfColumnType::Boolean, MdfCell::Boolean(_))
                    | (MdfColumnType::Text, MdfCell::Text(_))
            )
        };
        if cells.len() != self.kinds.len() || !self.kinds.iter().zip(cells).all(|it| fits(it.0, it.1)) {
            let text = format!("expected cells {:?}, found {cells:?}", self.kinds);
            return Err(Error::without_offset(text));
        }
        self.waiting.extend(time.to_le_bytes());
        let (mut texts, mut full) = (self.texts.iter_mut(), false);
        for cell in cells {
            match cell {
                MdfCell::Real(value) => self.waiting.extend(value.to_le_bytes()),
                MdfCell::Signed(value) => self.waiting.extend(value.to_le_bytes()),
                MdfCell::Unsigned(value) => self.waiting.extend(value.to_le_bytes()),
                MdfCell::Boolean(value) => self.waiting.push((*value).into()),
                MdfCell::Text(text) => {
                    let Some(texts) = texts.next() else { continue };
                    let offset = texts.chain.length + texts.waiting.len() as u64;
                    self.waiting.extend(offset.to_le_bytes());
                    // A length, and the text with a zero behind it.
                    let length = u32::try_from(text.len() + 1).map_err(|_| {
                        Error::without_offset(format!("expected a text below 4 GiB, found {}", text.len()))
                    })?;
                    texts.waiting.extend(length.to_le_bytes());
                    texts.waiting.extend(text.as_bytes());
                    texts.waiting.push(0);
                    full |= texts.waiting.len() >= BLOCK;
                }
            }
        }
        self.rows += 1;
        if full || self.waiting.len() >= BLOCK { self.flush_rows() } else { Ok(()) }
    }

    /// Writes the rows that wait: a reader sees them from now on.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn flush_rows(&mut self) -> Result<(), Error> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        let Self { file, end, .. } = self;
        for texts in &mut self.texts {
            texts.chain.write_packed_block(file, end, b"SD", 0, &texts.waiting)?;
            texts.waiting.clear();
        }
        self.data.write_packed_block(file, end, b"DT", self.record, &self.waiting)?;
        self.waiting.clear();
        patch_number(file, self.offsets.rows, self.rows)
    }

    /// Writes the rows that wait, and closes the file.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        self.flush_rows()?;
        Ok(self.file.flush()?)
    }
}

/// Writes a number over the one at a place.
fn patch_number(file: &mut File, at: u64, number: u64) -> Result<(), Error> {
    file.seek(SeekFrom::Start(at))?;
    file.write_all(&number.to_le_bytes())?;
    Ok(())
}

impl BlockChain {
    /// Writes a packed block of rows of a length or of texts, and behind it the list that leads to it, then the link to that.
    fn write_packed_block(
        &mut self,
        file: &mut File,
        end: &mut u64,
        kind: &[u8; 2],
        row: u32,
        contents: &[u8],
    ) -> Result<(), Error> {
        let turned = if row > 0 { transpose_rows(contents, row as usize) } else { contents.to_vec() };
        let mut packed = Vec::new();
        ZlibEncoder::new(&turned[..], Compression::new(4)).read_to_end(&mut packed)?;
        let mut data = [&kind[..], &[(row > 0).into(), 0], &row.to_le_bytes()].concat();
        data.extend((contents.len() as u64).to_le_bytes());
        data.extend((packed.len() as u64).to_le_bytes());
        data.extend(packed);
        let mut all = Vec::new();
        crate::head::append_block(&mut all, b"##DZ", &[], &data);
        let list = *end + all.len() as u64;
        // No flags, one block, which begins here.
        let data = [&[0; 4][..], &1u32.to_le_bytes(), &self.length.to_le_bytes()].concat();
        crate::head::append_block(&mut all, b"##DL", &[0, *end], &data);
        file.seek(SeekFrom::Start(*end))?;
        file.write_all(&all)?;
        *end += all.len() as u64;
        patch_number(file, self.next, list)?;
        if let Some((link, head)) = self.begin.take() {
            patch_number(file, link, head)?;
        }
        self.next = list + 24;
        self.length += contents.len() as u64;
        Ok(())
    }
}

/// The bytes of rows column by column: numbers hardly repeat, their first bytes do.
fn transpose_rows(rows: &[u8], row: usize) -> Vec<u8> {
    let column = |at: usize| rows[at..].iter().step_by(row).copied();
    (0..row).flat_map(column).collect()
}
