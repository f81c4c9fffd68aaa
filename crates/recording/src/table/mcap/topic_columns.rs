//! Collects the requested fields of a topic, message by message.

use std::sync::Arc;

use ::mcap::Channel;

use super::bag::MessageRecording;
use super::field::{ChannelValue, FieldError, MessageDecoder, MessageField, MessageRow};
use super::stamp::{HeaderStampCheck, MessageTimes, TimeSource};
use super::{RecordingError, catalogue, nanoseconds_to_seconds, not_a_number};
use crate::table::log::SeriesBuilder;
use crate::table::{ColumnType, TableError};

/// The wanted fields of a channel, and their values.
pub struct TopicColumns {
    pub channel: Arc<Channel<'static>>,
    pub reader: MessageDecoder,
    /// What tells its rows from others of the same messages.
    pub key: Option<String>,
    /// Each with its column and the form in which it is wanted.
    pub fields: Vec<(String, MessageField, ColumnType)>,
    /// The values of each field.
    pub columns: Vec<SeriesBuilder>,
    /// The times of each row.
    times: Vec<MessageTimes>,
    stamp_check: HeaderStampCheck,
    /// The time stamp [ns] of each row, and its number in the order of the file.
    pub rows: Vec<(i128, u64)>,
}

impl TopicColumns {
    pub fn new(
        file: &MessageRecording,
        column: &str,
        channel: &Arc<Channel<'static>>,
    ) -> Result<Self, RecordingError> {
        let (path, topic) = (file.path.clone(), channel.topic.clone());
        let reader = match MessageDecoder::new(channel) {
            Ok(Some(reader)) => reader,
            Ok(None) => {
                let (column, encoding) = (column.to_owned(), channel.message_encoding.clone());
                return Err(RecordingError::Encoding { path, column, topic, encoding });
            }
            Err(what) => return Err(RecordingError::Schema { path, topic, what }),
        };
        let channel = channel.clone();
        Ok(TopicColumns {
            channel,
            reader,
            key: None,
            fields: vec![],
            columns: vec![],
            times: vec![],
            stamp_check: HeaderStampCheck::default(),
            rows: vec![],
        })
    }

    /// Adds a field, and returns its place.
    pub fn add_field(&mut self, column: &str, field: MessageField, column_type: ColumnType) -> usize {
        self.fields.push((column.to_owned(), field, column_type));
        self.columns.push(SeriesBuilder::new(column_type));
        self.fields.len() - 1
    }

    /// Takes a message.
    pub fn add_message(
        &mut self,
        file: &MessageRecording,
        header: &::mcap::records::MessageHeader,
        data: &[u8],
    ) -> Result<(), TableError> {
        let message = self.reader.decode(data).map_err(|what| self.row_error(file, what))?;
        // The reader is taken out while its rows are read.
        let reader = std::mem::replace(&mut self.reader, MessageDecoder::Json);
        let mut taken = Ok(());
        for row in reader.message_rows(&message) {
            if taken.is_ok() && row.key == self.key.as_deref() {
                taken = self.add_row(file, &MessageTimes::new(header, row.stamp), &row, &reader);
            }
        }
        self.reader = reader;
        taken
    }

    /// What is wrong with the next row.
    fn row_error(&self, file: &MessageRecording, what: String) -> TableError {
        let (path, topic) = (file.path.clone(), self.channel.topic.clone());
        let number = self.times.len() as u64 + 1;
        RecordingError::Message { path, topic, number, what }.into()
    }

    /// Takes a row. Whether a column is in JSON is first seen here.
    fn add_row(
        &mut self,
        file: &MessageRecording,
        times: &MessageTimes,
        row: &MessageRow,
        reader: &MessageDecoder,
    ) -> Result<(), TableError> {
        let number = self.times.len() + 1;
        let unsure = number == 1 && matches!(reader, MessageDecoder::Json | MessageDecoder::Ros(..));
        for index in 0..self.fields.len() {
            let (column, field, column_type) = &self.fields[index];
            let value = field.value_in_row(row).and_then(|value| match (value, column_type) {
                (ChannelValue::Text(_), ColumnType::Number | ColumnType::Integer) => {
                    Err(FieldError::Other("a string".to_owned()))
                }
                (value, _) => Ok(value),
            });
            let value = value.map_err(|dead| match dead {
                FieldError::Missing if unsure => {
                    catalogue::missing_column_error(file, &[&self.channel], column)
                }
                FieldError::Other(found) if number == 1 => not_a_number(file, column, found),
                FieldError::Missing => self.row_error(file, format!("it has no `{column}`")),
                FieldError::Other(found) => {
                    self.row_error(file, format!("expected a number in `{column}`, found {found}"))
                }
            })?;
            if let ChannelValue::Number(value) = value
                && value.is_infinite()
                && *column_type != ColumnType::Text
            {
                let what =
                    format!("expected a finite number in `{column}`, found {value}; remove the message");
                return Err(self.row_error(file, what));
            }
            let topic = &self.channel.topic;
            self.columns[index].push_value(value, &|| format!("message {number} of `{topic}`"));
        }
        self.stamp_check.add_row(times);
        self.times.push(*times);
        Ok(())
    }

    /// Brings the rows into the order of their time stamps, no two of which may be equal. Where none is asked for, those of measurement count if
    /// they can, and a sentence says why not.
    pub fn sort_by_time_stamp(
        &mut self,
        file: &MessageRecording,
        asked: Option<TimeSource>,
    ) -> Result<Option<String>, TableError> {
        let (path, topic) = (file.path.clone(), self.channel.topic.clone());
        if self.times.is_empty() {
            return Err(match (&self.key, self.fields.first()) {
                (Some(_), Some((column, ..))) => {
                    catalogue::missing_column_error(file, &[&self.channel], column)
                }
                _ => RecordingError::Silent { path, topic }.into(),
            });
        }
        let mut objection = self.stamp_check.rejection_reason();
        let mut stamp = asked.unwrap_or(if self.stamp_check.is_accepted() {
            TimeSource::Header
        } else {
            TimeSource::Log
        });
        let Some(mut rows) = self.sorted_stamps(stamp) else {
            return Err(RecordingError::NoStamp { path, topic }.into());
        };
        if let (TimeSource::Header, None, Some([first, second])) = (stamp, asked, first_repeated_stamp(&rows))
        {
            objection = Some(format!("messages {first} and {second} have the same"));
            stamp = TimeSource::Log;
            rows = self.sorted_stamps(stamp).unwrap_or_default();
        }
        if let Some(numbers) = first_repeated_stamp(&rows) {
            let time =
                rows.iter().find(|row| row.1 == numbers[0]).map_or(0.0, |row| nanoseconds_to_seconds(row.0));
            let (stamp, other) = stamp.name_and_alternative();
            return Err(RecordingError::Repeated { path, topic, numbers, stamp, time, other }.into());
        }
        if !rows.iter().map(|(_, number)| *number).is_sorted() {
            for SeriesBuilder { values, .. } in &mut self.columns {
                *values = rows.iter().map(|(_, number)| values[*number as usize - 1]).collect();
            }
        }
        self.rows = rows;
        let told = objection.filter(|_| asked.is_none());
        Ok(told.map(|why| {
            format!(
                "{}: the times of `{}` are log_time, not header.stamp: {why}; `time = \"header.stamp\"` takes them all the same",
                file.path.display(),
                self.channel.topic
            )
        }))
    }

    fn sorted_stamps(&self, stamp: TimeSource) -> Option<Vec<(i128, u64)>> {
        let stamps = self.times.iter().map(|times| times.get(stamp)).zip(1..);
        let rows = stamps.map(|(time, number)| Some((time?, number)));
        let mut rows: Vec<(i128, u64)> = rows.collect::<Option<_>>()?;
        if !rows.is_sorted() {
            rows.sort_unstable();
        }
        Some(rows)
    }
}

/// The numbers of the first two rows with one time stamp.
fn first_repeated_stamp(rows: &[(i128, u64)]) -> Option<[u64; 2]> {
    let twice = rows.windows(2).find(|pair| pair[0].0 == pair[1].0)?;
    Some([twice[0].1, twice[1].1])
}
