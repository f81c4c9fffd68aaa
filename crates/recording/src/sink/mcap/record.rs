//! Builds the records of an MCAP file, which the specification describes: <https://mcap.dev/spec>.

use std::collections::BTreeMap;

/// A record: its opcode, the length of its body, and the body.
pub(super) struct Record(Vec<u8>);

impl Record {
    pub fn new(opcode: u8) -> Self {
        let mut bytes = vec![0; 9];
        bytes[0] = opcode;
        Record(bytes)
    }

    /// The bytes of the record, when the body is complete.
    pub fn bytes(mut self) -> Vec<u8> {
        let length = self.0.len() as u64 - 9;
        self.0[1..9].copy_from_slice(&length.to_le_bytes());
        self.0
    }

    pub fn u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    pub fn u16(self, value: u16) -> Self {
        self.all(&value.to_le_bytes())
    }

    pub fn u32(self, value: u32) -> Self {
        self.all(&value.to_le_bytes())
    }

    pub fn u64(self, value: u64) -> Self {
        self.all(&value.to_le_bytes())
    }

    /// Bytes without their length.
    pub fn all(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    /// Bytes after their length in 32 bits, as all texts are written.
    pub fn short(self, bytes: &[u8]) -> Self {
        self.u32(bytes.len() as u32).all(bytes)
    }

    /// Bytes after their length in 64 bits.
    pub fn long(self, bytes: &[u8]) -> Self {
        self.u64(bytes.len() as u64).all(bytes)
    }

    pub fn text(self, text: &str) -> Self {
        self.short(text.as_bytes())
    }

    /// Texts by texts.
    pub fn texts(self, texts: &BTreeMap<String, String>) -> Self {
        let size = texts.iter().map(|(key, value)| 8 + key.len() + value.len()).sum::<usize>();
        let start = self.u32(size as u32);
        texts.iter().fold(start, |record, (key, value)| record.text(key).text(value))
    }

    /// Numbers by channels.
    pub fn by_channel(self, numbers: impl ExactSizeIterator<Item = (u16, u64)>) -> Self {
        let start = self.u32(10 * numbers.len() as u32);
        numbers.fold(start, |record, (channel, number)| record.u16(channel).u64(number))
    }
}
