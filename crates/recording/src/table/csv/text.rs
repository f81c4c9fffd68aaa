//! Opens the text of a CSV file, as often as it is wanted: unpacked from gzip, and from UTF-16 made UTF-8.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use diagnostics::read_bounded;
use flate2::read::MultiGzDecoder;
use text_encoding::{ByteOrder, utf16_units};

/// The text of a file; bytes count in what [`CsvText::open`] gives.
#[derive(Debug, Clone)]
pub enum CsvText {
    File(PathBuf),
    /// What can be read only once, or is no file.
    Memory(Vec<u8>),
}

/// The most of a pipe or a device [B].
const LARGEST: u64 = 2 << 30;

impl CsvText {
    /// The text at a path.
    pub fn from_path(path: &Path) -> io::Result<Self> {
        Ok(match std::fs::metadata(path)?.is_file() {
            true => CsvText::File(path.to_owned()),
            false => CsvText::Memory(read_bounded(path, LARGEST)?),
        })
    }

    /// The bytes from the first letter on.
    pub fn open(&self) -> io::Result<Box<dyn Read + '_>> {
        let mut raw: Box<dyn Read> = match self {
            CsvText::File(path) => Box::new(BufReader::with_capacity(1 << 16, File::open(path)?)),
            CsvText::Memory(bytes) => Box::new(&bytes[..]),
        };
        let mut head = read_first_bytes(&mut raw)?;
        if head.starts_with(&[0x1f, 0x8b]) {
            raw = Box::new(MultiGzDecoder::new(io::Cursor::new(head).chain(raw)));
            head = read_first_bytes(&mut raw)?;
        }
        let skip = match head[..] {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => 2,
            [0xef, 0xbb, 0xbf] => 3,
            _ => 0,
        };
        let order = ByteOrder::from_mark(&head).map(|(order, _)| order);
        head.drain(..skip);
        let rest = io::Cursor::new(head).chain(raw);
        Ok(match order {
            Some(order) => Box::new(Utf16Reader::new(rest, order)),
            None => Box::new(rest),
        })
    }

    /// The bytes from a place on.
    pub fn open_at(&self, begin: u64) -> io::Result<Box<dyn Read + '_>> {
        let mut text = self.open()?;
        io::copy(&mut (&mut text).take(begin), &mut io::sink())?;
        Ok(text)
    }
}

/// The first three bytes, or all.
fn read_first_bytes(from: &mut dyn Read) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    from.take(3).read_to_end(&mut head)?;
    Ok(head)
}

/// Text in UTF-16, read as UTF-8.
struct Utf16Reader<R> {
    from: R,
    order: ByteOrder,
    /// The first half of a letter beyond 16 bits.
    high: Option<u16>,
    ready: Vec<u8>,
    given: usize,
}

impl<R: Read> Utf16Reader<R> {
    fn new(from: R, order: ByteOrder) -> Self {
        Self { from, order, high: None, ready: Vec::new(), given: 0 }
    }

    /// Decodes some more.
    fn decode_more(&mut self) -> io::Result<()> {
        let mut bytes = Vec::new();
        (&mut self.from).take(1 << 14).read_to_end(&mut bytes)?;
        let mut units: Vec<u16> = self.high.take().into_iter().collect();
        units.extend(bytes.as_chunks().0.iter().map(|it| self.order.code_unit(*it)));
        let full = bytes.len() == 1 << 14;
        if full && units.last().is_some_and(|it| (0xd800..0xdc00).contains(it)) {
            self.high = units.pop();
        }
        self.ready = utf16_units(units).into_bytes();
        self.given = 0;
        Ok(())
    }
}

impl<R: Read> Read for Utf16Reader<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.given == self.ready.len() {
            self.decode_more()?;
        }
        let count = into.len().min(self.ready.len() - self.given);
        into[..count].copy_from_slice(&self.ready[self.given..self.given + count]);
        self.given += count;
        Ok(count)
    }
}
