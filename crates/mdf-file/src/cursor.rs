//! Goes through the records of a group, and through the values of any length that they refer to.

use std::collections::HashMap;
use std::sync::Arc;

use crate::bytes::FileByteReader;
use crate::error::Error;
use crate::layout::{ChannelGroup, VariableLengthValue};
use crate::stream::{BlockListOptions, DataStream, GroupDataParts, StreamParts, list_data_blocks};

/// Goes through the records of a group.
pub(crate) struct RecordCursor {
    group: ChannelGroup,
    values: DataStream,
    /// Invalidation bits that have blocks of their own.
    invalid: Option<DataStream>,
    /// Rows that were read.
    row: u64,
    /// Where the next record of mixed groups begins.
    at: u64,
    /// Whether the data may end within a record.
    open_end: bool,
}

impl RecordCursor {
    pub fn open(bytes: &mut FileByteReader, group: &ChannelGroup, open_end: bool) -> Result<Self, Error> {
        let apart = Some((group.values as u64, group.invalid as u64));
        let found = match group.raw {
            Some(length) => {
                GroupDataParts { values: StreamParts::from_file_range(group.data, length)?, invalid: None }
            }
            None => list_data_blocks(bytes, group.data, &BlockListOptions { open_end, apart })?,
        };
        let stream = |parts: StreamParts| DataStream::new(Arc::new(parts));
        let (values, invalid) = (stream(found.values), found.invalid.map(stream));
        let cursor = Self { group: group.clone(), values, invalid, row: 0, at: 0, open_end };
        cursor.check_data_length()?;
        Ok(cursor)
    }

    /// Whether the data is as long as the rows are.
    fn check_data_length(&self) -> Result<(), Error> {
        let Some(rows) = self.group.rows.filter(|_| !self.group.has_mixed_records()) else {
            return Ok(());
        };
        let long = |stream: &DataStream, record: usize| {
            let needed = u128::from(rows) * record as u128;
            if needed <= u128::from(stream.stream_length()) {
                return Ok(());
            }
            let text = format!(
                "expected data of {rows} rows with {record} bytes each, found {} bytes; was the measurement cut off?",
                stream.stream_length()
            );
            Err(Error::new(self.group.data, text))
        };
        long(&self.values, self.record_stride())?;
        self.invalid.as_ref().map_or(Ok(()), |it| long(it, self.group.invalid))
    }

    /// The bytes from one record to the next in the stream.
    fn record_stride(&self) -> usize {
        let apart = if self.invalid.is_some() { 0 } else { self.group.invalid };
        self.group.number_bytes + self.group.values + apart
    }

    /// Puts the next records, values and then invalidation bits, into the buffer; says how many there were.
    pub fn read_next_records(
        &mut self,
        bytes: &mut FileByteReader,
        most: usize,
        to: &mut Vec<u8>,
    ) -> Result<usize, Error> {
        to.clear();
        let count = match self.group.has_mixed_records() {
            true => self.read_mixed_records(bytes, most, to)?,
            false => self.read_sequential_records(bytes, most, to)?,
        };
        self.row += count as u64;
        Ok(count)
    }

    /// Records that follow each other.
    fn read_sequential_records(
        &mut self,
        bytes: &mut FileByteReader,
        most: usize,
        to: &mut Vec<u8>,
    ) -> Result<usize, Error> {
        let left = self.group.rows.unwrap_or(0) - self.row;
        let count = left.min(most as u64) as usize;
        let (stride, record) = (self.record_stride(), self.group.record_bytes());
        let begin = self.row * stride as u64;
        if stride == record {
            to.resize(count * record, 0);
            self.values.read_at(bytes, begin, to)?;
            return Ok(count);
        }
        let mut all = vec![0; count * stride];
        self.values.read_at(bytes, begin, &mut all)?;
        let mut bits = vec![0; if self.invalid.is_some() { count * self.group.invalid } else { 0 }];
        if let Some(invalid) = &mut self.invalid {
            invalid.read_at(bytes, self.row * self.group.invalid as u64, &mut bits)?;
        }
        for row in 0..count {
            to.extend(&all[row * stride + self.group.number_bytes..(row + 1) * stride]);
            if self.invalid.is_some() {
                to.extend(&bits[row * self.group.invalid..(row + 1) * self.group.invalid]);
            }
        }
        Ok(count)
    }

    /// Records among those of other groups.
    fn read_mixed_records(
        &mut self,
        bytes: &mut FileByteReader,
        most: usize,
        to: &mut Vec<u8>,
    ) -> Result<usize, Error> {
        let left = self.group.rows.map_or(u64::MAX, |rows| rows - self.row);
        let (most, mut count) = (left.min(most as u64) as usize, 0);
        while count < most {
            let found = read_mixed_record(bytes, &mut self.values, &self.group, self.at);
            let found = match found {
                Ok(found) => found,
                Err(error) if !self.open_end => return Err(error),
                Err(_) => None,
            };
            let Some(found) = found else {
                let Some(rows) = self.group.rows else { return Ok(count) };
                let text = format!(
                    "expected {rows} rows of the group with number {}, found {}",
                    self.group.number,
                    self.row + count as u64
                );
                return Err(Error::new(self.group.data, text));
            };
            if found.number == self.group.number {
                let held = to.len();
                to.resize(held + found.length as usize, 0);
                self.values.read_at(bytes, found.begin, &mut to[held..])?;
                count += 1;
            }
            self.at = found.begin + found.length;
        }
        Ok(count)
    }
}

/// A record among those of other groups.
struct UnsortedRecord {
    number: u64,
    /// Where its contents are in the stream.
    begin: u64,
    length: u64,
    /// Whether it is a value of any length.
    is_variable: bool,
}

/// The record at a place of the stream; nothing at its end.
fn read_mixed_record(
    bytes: &mut FileByteReader,
    stream: &mut DataStream,
    group: &ChannelGroup,
    at: u64,
) -> Result<Option<UnsortedRecord>, Error> {
    if at >= stream.stream_length() {
        return Ok(None);
    }
    let mut number = [0; 8];
    stream.read_at(bytes, at, &mut number[..group.number_bytes])?;
    let (number, mut begin) = (u64::from_le_bytes(number), at + group.number_bytes as u64);
    let Some(length) = group.mixed.get(&number) else {
        let text = format!("expected the number of a group in front of a record, found {number}");
        return Err(Error::new(group.data, text));
    };
    let length = match length {
        Some(length) => *length as u64,
        None => {
            let mut length = [0; 4];
            stream.read_at(bytes, begin, &mut length)?;
            begin += 4;
            u32::from_le_bytes(length).into()
        }
    };
    if length > stream.stream_length() - begin {
        let text = format!("expected a record of {length} bytes, found the end of the data");
        return Err(Error::new(group.data, text));
    }
    let is_variable = group.mixed.get(&number) == Some(&None);
    Ok(Some(UnsortedRecord { number, begin, length, is_variable }))
}

/// The values of any length of a channel.
pub(crate) struct VariableLengthTexts {
    stream: DataStream,
    /// Among other records: where a value is by the bytes of such values in front of it, and where in the stream.
    places: Option<Vec<(u64, u64)>>,
    /// Bytes that may still be read: many rows may refer to one long text.
    left: u64,
    variable: VariableLengthValue,
}

impl VariableLengthTexts {
    pub fn open(
        bytes: &mut FileByteReader,
        variable: &VariableLengthValue,
        group: &ChannelGroup,
        open_end: bool,
    ) -> Result<Self, Error> {
        let number = group.variable.get(&variable.link).copied();
        let from = if number.is_some() { group.data } else { variable.link };
        let found = list_data_blocks(bytes, from, &BlockListOptions { open_end, apart: None })?;
        let mut stream = DataStream::new(Arc::new(found.values));
        let places = match number {
            Some(number) => Some(find_value_places(bytes, &mut stream, group, number, open_end)?),
            None => None,
        };
        let left = stream.stream_length().saturating_mul(16).saturating_add(16 << 20);
        Ok(Self { stream, places, left, variable: variable.clone() })
    }

    /// The text that a record refers to.
    pub fn read_text(&mut self, bytes: &mut FileByteReader, record: &[u8]) -> Result<String, Error> {
        if self.variable.link == 0 {
            return Ok(String::new());
        }
        let offset = self.variable.offset.decode_integer(record) as u64;
        let nowhere = || {
            let text = format!("expected a text at offset {offset} of its data, found none");
            Error::new(self.variable.link, text)
        };
        let at = match &self.places {
            None => offset,
            Some(places) => {
                let found = places.binary_search_by_key(&offset, |it| it.0);
                places[found.map_err(|_| nowhere())?].1
            }
        };
        let end = at.checked_add(4).filter(|it| *it <= self.stream.stream_length());
        let begin = end.ok_or_else(nowhere)?;
        let mut length = [0; 4];
        self.stream.read_at(bytes, at, &mut length)?;
        let length = u64::from(u32::from_le_bytes(length));
        if length > self.stream.stream_length() - begin {
            return Err(nowhere());
        }
        self.left = self.left.checked_sub(length).ok_or_else(|| {
            Error::new(self.variable.link, "expected each text about once, found some many times")
        })?;
        let mut all = vec![0; length as usize];
        self.stream.read_at(bytes, begin, &mut all)?;
        Ok(self.variable.value.decode_text_bytes(&all))
    }
}

/// Where the values of any length are that stand among other records.
fn find_value_places(
    bytes: &mut FileByteReader,
    stream: &mut DataStream,
    group: &ChannelGroup,
    number: u64,
    open_end: bool,
) -> Result<Vec<(u64, u64)>, Error> {
    let (mut all, mut offset, mut at) = (Vec::new(), 0, 0);
    loop {
        let found = match read_mixed_record(bytes, stream, group, at) {
            Ok(Some(found)) => found,
            Err(error) if !open_end => return Err(error),
            Ok(None) | Err(_) => return Ok(all),
        };
        if found.number == number && found.is_variable {
            all.push((offset, found.begin - 4));
            offset += 4 + found.length;
        }
        at = found.begin + found.length;
    }
}

/// The texts of channels by their place.
pub(crate) type TextsByChannel = HashMap<usize, VariableLengthTexts>;
