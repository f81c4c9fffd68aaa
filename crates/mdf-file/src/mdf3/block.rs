//! Reads the blocks of MDF 2 and 3: two letters, a length of 16 bits with these, fields at fixed places.

use crate::bytes::FileByteReader;
use crate::error::Error;
use crate::text::{decode_utf8_or_latin1, truncate_text};

/// What has the blocks of a file.
pub(super) struct Mdf3BlockReader<'b> {
    bytes: &'b mut FileByteReader,
    /// Whether the highest byte of a number comes first.
    is_big_endian: bool,
}

/// A block; fields that it is too short for are 0 and empty, as later versions added fields.
pub(super) struct Mdf3Block {
    pub at: u64,
    data: Vec<u8>,
    is_big_endian: bool,
}

impl<'b> Mdf3BlockReader<'b> {
    pub fn new(bytes: &'b mut FileByteReader) -> Result<Self, Error> {
        let mut head = [0; 4];
        bytes.read_at(64, &mut head)?;
        // The length of the header, 164 bytes or few more, tells the order of its bytes.
        Ok(Self { bytes, is_big_endian: head[2] < head[3] })
    }

    /// The block at a place, of at least so many bytes.
    pub fn read_block(&mut self, at: u64, id: &[u8; 2], least: usize) -> Result<Mdf3Block, Error> {
        let mut head = [0; 4];
        self.bytes.read_at(at, &mut head)?;
        let block = Mdf3Block { at, data: head.to_vec(), is_big_endian: self.is_big_endian };
        let length = usize::from(block.u16_at(2));
        if head[..2] != *id || length < least {
            let text = format!(
                "expected a block {} of at least {least} bytes, found `{}` of {length}",
                String::from_utf8_lossy(id),
                head[..2].escape_ascii()
            );
            return Err(Error::new(at, text));
        }
        self.read_oversized_block(at, length)
    }

    /// Bytes of a block whose length is not the one that it tells: tables above 64 KiB.
    pub fn read_oversized_block(&mut self, at: u64, length: usize) -> Result<Mdf3Block, Error> {
        let mut data = vec![0; length];
        self.bytes.read_at(at, &mut data)?;
        Ok(Mdf3Block { at, data, is_big_endian: self.is_big_endian })
    }

    /// The text that a link leads to; nothing where it leads nowhere or the text is empty.
    pub fn read_text_block(&mut self, at: u32) -> Result<Option<String>, Error> {
        if at == 0 {
            return Ok(None);
        }
        let block = self.read_block(at.into(), b"TX", 4)?;
        let text = block.text_at(4, block.data.len());
        Ok((!text.is_empty()).then(|| truncate_text(&text).to_owned()))
    }
}

impl Mdf3Block {
    fn little_endian_array_at<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut bytes: [u8; N] =
            self.data.get(at..at + N).map_or([0; N], |it| it.try_into().unwrap_or([0; N]));
        if self.is_big_endian {
            bytes.reverse();
        }
        bytes
    }

    pub fn block_length(&self) -> usize {
        self.data.len()
    }

    pub fn u16_at(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.little_endian_array_at(at))
    }

    pub fn u32_at(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.little_endian_array_at(at))
    }

    pub fn u64_at(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.little_endian_array_at(at))
    }

    pub fn f64_at(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.little_endian_array_at(at))
    }

    /// The text of a field of so many bytes, up to a zero.
    pub fn text_at(&self, at: usize, length: usize) -> String {
        let field = self.data.get(at..).unwrap_or_default();
        let field = &field[..field.len().min(length)];
        decode_utf8_or_latin1(field.split(|it| *it == 0).next().unwrap_or_default()).trim().to_owned()
    }
}
