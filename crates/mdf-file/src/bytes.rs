//! Reads blocks of a file, none of them beyond its end.

use std::io::{Read, Seek, SeekFrom};

use crate::error::Error;

/// The length of the head of a block [B].
pub(crate) const HEAD: u64 = 24;
/// The longest block of descriptions [B].
const LONGEST: u64 = 16 << 20;

/// What has the bytes of a file.
trait ByteSource: Read + Seek + Send {}

impl<T: Read + Seek + Send> ByteSource for T {}

/// A file.
pub(crate) struct FileByteReader {
    file: Box<dyn ByteSource>,
    /// Its length [B].
    pub size: u64,
}

/// The head of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockHeader {
    pub id: [u8; 4],
    /// The length with this head [B].
    pub length: u64,
    pub links: u64,
}

/// A block of descriptions.
#[derive(Debug)]
pub(crate) struct MdfBlock {
    pub at: u64,
    pub id: [u8; 4],
    links: Vec<u64>,
    data: Vec<u8>,
}

/// The first bytes as an array.
fn leading_array<const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
    bytes.get(..N)?.try_into().ok()
}

fn u64_from_bytes(bytes: &[u8]) -> u64 {
    leading_array(bytes).map_or(0, u64::from_le_bytes)
}

/// An identification, for people.
pub(crate) fn block_id_text(id: [u8; 4]) -> String {
    id.iter().flat_map(|it| std::ascii::escape_default(*it)).map(char::from).collect()
}

impl FileByteReader {
    pub fn new(source: impl Read + Seek + Send + 'static) -> Result<Self, Error> {
        let mut file = Box::new(source);
        let size = file.seek(SeekFrom::End(0))?;
        Ok(Self { file, size })
    }

    /// Fills a buffer with the bytes from a place on.
    pub fn read_at(&mut self, at: u64, buffer: &mut [u8]) -> Result<(), Error> {
        let end = at.checked_add(buffer.len() as u64);
        if end.is_none_or(|it| it > self.size) {
            let text = format!(
                "expected {} bytes, found the end of the file at {}; was it copied in full?",
                buffer.len(),
                self.size
            );
            return Err(Error::new(at, text));
        }
        self.file.seek(SeekFrom::Start(at))?;
        Ok(self.file.read_exact(buffer)?)
    }

    /// The head of a block, whose length may leave the file.
    pub fn read_block_header(&mut self, at: u64) -> Result<BlockHeader, Error> {
        let mut head = [0; HEAD as usize];
        self.read_at(at, &mut head)?;
        let id = leading_array(&head).unwrap_or_default();
        if !id.starts_with(b"##") {
            let text = format!("expected a block, `##` and two letters, found `{}`", block_id_text(id));
            return Err(Error::new(at, text));
        }
        Ok(BlockHeader { id, length: u64_from_bytes(&head[8..]), links: u64_from_bytes(&head[16..]) })
    }

    /// A block of descriptions that has one of these identifications.
    pub fn read_block(&mut self, at: u64, expected: &[&[u8; 4]]) -> Result<MdfBlock, Error> {
        let head = self.read_block_header(at)?;
        if !expected.contains(&&head.id) {
            let names: Vec<_> = expected.iter().map(|it| block_id_text(**it)).collect();
            let text = format!("expected a block {}, found {}", names.join(" or "), block_id_text(head.id));
            return Err(Error::new(at, text));
        }
        let rest = head.length.checked_sub(HEAD).filter(|it| *it <= LONGEST.min(self.size));
        let links = rest.filter(|it| head.links <= it / 8).map(|_| head.links);
        let (Some(rest), Some(links)) = (rest, links) else {
            let text = format!(
                "expected a length and links that fit the file, found {} bytes with {} links",
                head.length, head.links
            );
            return Err(Error::new(at, text));
        };
        let mut data = vec![0; rest as usize];
        self.read_at(at + HEAD, &mut data)?;
        let behind = data.split_off(links as usize * 8);
        let links = data.chunks_exact(8).map(u64_from_bytes).collect();
        Ok(MdfBlock { at, id: head.id, links, data: behind })
    }
}

impl MdfBlock {
    /// A link, 0 where there is none.
    pub fn link_at(&self, at: usize) -> u64 {
        self.links.get(at).copied().unwrap_or(0)
    }

    /// All links.
    pub fn links(&self) -> &[u64] {
        &self.links
    }

    fn array_at<const N: usize>(&self, at: usize) -> Result<[u8; N], Error> {
        self.data.get(at..).and_then(leading_array).ok_or_else(|| {
            let text = format!(
                "expected {} bytes of data in the block {}, found {}",
                at + N,
                block_id_text(self.id),
                self.data.len()
            );
            Error::new(self.at, text)
        })
    }

    pub fn u8_at(&self, at: usize) -> Result<u8, Error> {
        self.array_at(at).map(u8::from_le_bytes)
    }

    pub fn u16_at(&self, at: usize) -> Result<u16, Error> {
        self.array_at(at).map(u16::from_le_bytes)
    }

    pub fn u32_at(&self, at: usize) -> Result<u32, Error> {
        self.array_at(at).map(u32::from_le_bytes)
    }

    pub fn u64_at(&self, at: usize) -> Result<u64, Error> {
        self.array_at(at).map(u64::from_le_bytes)
    }

    pub fn f64_at(&self, at: usize) -> Result<f64, Error> {
        self.array_at(at).map(f64::from_le_bytes)
    }
}
