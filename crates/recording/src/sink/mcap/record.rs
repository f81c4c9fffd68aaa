//! Builds the records of an MCAP file, which the specification describes: <https://mcap.dev/spec>.

use std::collections::BTreeMap;

/// A record: its opcode, the length of its body, and the body.
pub(super) struct RecordBuilder(Vec<u8>);

impl RecordBuilder {
    pub fn new(opcode: u8) -> Self {
        let mut bytes = vec![0; 9];
        bytes[0] = opcode;
        RecordBuilder(bytes)
    }

    /// The bytes of the record, when the body is complete.
    pub fn into_bytes(mut self) -> Vec<u8> {
        let length = self.0.len() as u64 - 9;
        self.0[1..9].copy_from_slice(&length.to_le_bytes());
        self.0
    }

    pub fn with_u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    pub fn with_u16(self, value: u16) -> Self {
        self.with_raw_bytes(&value.to_le_bytes())
    }

    pub fn with_u32(self, value: u32) -> Self {
        self.with_raw_bytes(&value.to_le_bytes())
    }

    pub fn with_u64(self, value: u64) -> Self {
        self.with_raw_bytes(&value.to_le_bytes())
    }

    /// Bytes without their length.
    pub fn with_raw_bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    /// Bytes after their length in 32 bits, as all texts are written.
    pub fn with_u32_length_bytes(self, bytes: &[u8]) -> Self {
        self.with_u32(bytes.len() as u32).with_raw_bytes(bytes)
    }

    /// Bytes after their length in 64 bits.
    pub fn with_u64_length_bytes(self, bytes: &[u8]) -> Self {
        self.with_u64(bytes.len() as u64).with_raw_bytes(bytes)
    }

    pub fn with_text(self, text: &str) -> Self {
        self.with_u32_length_bytes(text.as_bytes())
    }

    /// Texts by texts.
    pub fn with_text_map(self, texts: &BTreeMap<String, String>) -> Self {
        let size = texts.iter().map(|(key, value)| 8 + key.len() + value.len()).sum::<usize>();
        let start = self.with_u32(size as u32);
        texts.iter().fold(start, |record, (key, value)| record.with_text(key).with_text(value))
    }

    /// Numbers by channels.
    pub fn with_channel_map(self, numbers: impl ExactSizeIterator<Item = (u16, u64)>) -> Self {
        let start = self.with_u32(10 * numbers.len() as u32);
        numbers.fold(start, |record, (channel, number)| record.with_u16(channel).with_u64(number))
    }
}
