//! Encodes rows as records of messages, without allocating: what stays the same from row to row is copied as a whole.

use ::mcap::records::{MessageHeader, op};
use expression::{IntegerIndex, NumberIndex, TextIndex};

use crate::row::{RecordedVariables, Row};

/// The bytes of a record before its data: opcode and length, then channel, number and two times.
pub(super) const HEAD: usize = 9 + 22;

/// Appends a message, whose data `append` appends.
pub(super) fn append_message_record(
    header: &MessageHeader,
    append: impl FnOnce(&mut Vec<u8>),
    to: &mut Vec<u8>,
) {
    let start = to.len();
    to.extend_from_slice(&[0; HEAD]);
    append(to);
    write_record_header(header, &mut to[start..]);
}

/// Writes the head of a record.
fn write_record_header(header: &MessageHeader, record: &mut [u8]) {
    let length = record.len() as u64 - 9;
    record[0] = op::MESSAGE;
    record[1..9].copy_from_slice(&length.to_le_bytes());
    record[9..11].copy_from_slice(&header.channel_id.to_le_bytes());
    record[11..15].copy_from_slice(&header.sequence.to_le_bytes());
    record[15..23].copy_from_slice(&header.log_time.to_le_bytes());
    record[23..31].copy_from_slice(&header.publish_time.to_le_bytes());
}

/// The headers and the data of records that [`append_message_record`] has made.
pub(super) fn iter_message_records(mut records: &[u8]) -> impl Iterator<Item = (MessageHeader, &[u8])> {
    std::iter::from_fn(move || {
        let length = u64::from_le_bytes(*records.get(1..)?.first_chunk()?);
        let (record, rest) = records.split_at_checked(9 + length as usize)?;
        records = rest;
        let header = MessageHeader {
            channel_id: u16::from_le_bytes(*record[9..].first_chunk()?),
            sequence: u32::from_le_bytes(*record[11..].first_chunk()?),
            log_time: u64::from_le_bytes(*record[15..].first_chunk()?),
            publish_time: u64::from_le_bytes(*record[23..].first_chunk()?),
        };
        Some((header, &record[HEAD..]))
    })
}

/// A channel: one side of one node.
pub(super) struct ChannelEncoder {
    pub id: u16,
    /// A message of zeros, with its head: the numbers only.
    zeros: Vec<u8>,
    /// The numbers, each with its place in the message.
    numbers: Vec<(NumberIndex<RecordedVariables>, usize)>,
    /// Integers of 64 bits, each with the number of its field.
    integers: Vec<(IntegerIndex<RecordedVariables>, u32)>,
    /// Texts, each with the number of its field.
    texts: Vec<(TextIndex<RecordedVariables>, u32)>,
}

impl ChannelEncoder {
    /// A channel of these values, each with the number of its field.
    pub fn new(
        id: u16,
        numbers: impl Iterator<Item = (NumberIndex<RecordedVariables>, u32)>,
        integers: Vec<(IntegerIndex<RecordedVariables>, u32)>,
        texts: Vec<(TextIndex<RecordedVariables>, u32)>,
    ) -> Self {
        let mut zeros = vec![0; HEAD];
        let places = numbers.map(|(index, field)| {
            append_fixed64_tag(field, &mut zeros);
            zeros.extend_from_slice(&[0; 8]);
            (index, zeros.len() - 8)
        });
        let numbers = places.collect();
        ChannelEncoder { id, zeros, numbers, integers, texts }
    }

    /// Appends the message of a row.
    pub fn append_row_message(&self, header: &MessageHeader, row: &Row<RecordedVariables>, to: &mut Vec<u8>) {
        let start = to.len();
        to.extend_from_slice(&self.zeros);
        let message = &mut to[start..];
        for (number, place) in &self.numbers {
            message[*place..place + 8].copy_from_slice(&row[*number].to_le_bytes());
        }
        for (integer, field) in &self.integers {
            // Two's complement of 64 bits is the same varint for both types.
            prost::encoding::uint64::encode(*field, &(row[*integer] as u64), to);
        }
        for (text, field) in &self.texts {
            prost::encoding::string::encode(*field, &row[*text], to);
        }
        write_record_header(header, &mut to[start..]);
    }
}

/// Appends the key of a field of 64 bits (wire type 1).
pub(super) fn append_fixed64_tag(field: u32, to: &mut Vec<u8>) {
    prost::encoding::encode_key(field, prost::encoding::WireType::SixtyFourBit, to);
}
