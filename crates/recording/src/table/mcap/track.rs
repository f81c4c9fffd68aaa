//! Collects the wanted fields of a channel, message by message.

use std::sync::Arc;

use ::mcap::Channel;

use super::bag::Bag;
use super::field::{Cell, Dead, Field, Reader, Row};
use super::stamp::{Judge, Stamp, Times};
use super::{RecordingError, catalogue, not_a_number, seconds};
use crate::table::logged::Growing;
use crate::table::{Reading, TableError};

/// The wanted fields of a channel, and their values.
pub struct Track {
    pub channel: Arc<Channel<'static>>,
    pub reader: Reader,
    /// What tells its rows from others of the same messages.
    pub key: Option<String>,
    /// Each with its column and the form in which it is wanted.
    pub fields: Vec<(String, Field, Reading)>,
    /// The values of each field.
    pub columns: Vec<Growing>,
    /// The times of each row.
    times: Vec<Times>,
    judge: Judge,
    /// The time stamp [ns] of each row, and its number in the order of the file.
    pub rows: Vec<(i128, u64)>,
}

impl Track {
    pub fn new(
        file: &Bag,
        column: &str,
        channel: &Arc<Channel<'static>>,
    ) -> Result<Self, RecordingError> {
        let (path, topic) = (file.path.clone(), channel.topic.clone());
        let reader = match Reader::new(channel) {
            Ok(Some(reader)) => reader,
            Ok(None) => {
                let (column, encoding) = (column.to_owned(), channel.message_encoding.clone());
                return Err(RecordingError::Encoding { path, column, topic, encoding });
            }
            Err(what) => return Err(RecordingError::Schema { path, topic, what }),
        };
        let channel = channel.clone();
        Ok(Track {
            channel,
            reader,
            key: None,
            fields: vec![],
            columns: vec![],
            times: vec![],
            judge: Judge::default(),
            rows: vec![],
        })
    }

    /// Adds a field, and returns its place.
    pub fn add(&mut self, column: &str, field: Field, reading: Reading) -> usize {
        self.fields.push((column.to_owned(), field, reading));
        self.columns.push(Growing::new(reading));
        self.fields.len() - 1
    }

    /// Takes a message.
    pub fn take(
        &mut self,
        file: &Bag,
        header: &::mcap::records::MessageHeader,
        data: &[u8],
    ) -> Result<(), TableError> {
        let message = self.reader.read(data).map_err(|what| self.wrong(file, what))?;
        // The reader is taken out while its rows are read.
        let reader = std::mem::replace(&mut self.reader, Reader::Json);
        let mut taken = Ok(());
        for row in reader.rows(&message) {
            if taken.is_ok() && row.key == self.key.as_deref() {
                taken = self.row(file, &Times::new(header, row.stamp), &row, &reader);
            }
        }
        self.reader = reader;
        taken
    }

    /// What is wrong with the next row.
    fn wrong(&self, file: &Bag, what: String) -> TableError {
        let (path, topic) = (file.path.clone(), self.channel.topic.clone());
        let number = self.times.len() as u64 + 1;
        RecordingError::Message { path, topic, number, what }.into()
    }

    /// Takes a row. Whether a column is in JSON is first seen here.
    fn row(
        &mut self,
        file: &Bag,
        times: &Times,
        row: &Row,
        reader: &Reader,
    ) -> Result<(), TableError> {
        let number = self.times.len() + 1;
        let unsure = number == 1 && matches!(reader, Reader::Json | Reader::Ros(..));
        for index in 0..self.fields.len() {
            let (column, field, reading) = &self.fields[index];
            let value = field.value(row).and_then(|value| match (value, reading) {
                (Cell::Text(_), Reading::Number | Reading::Integer) => {
                    Err(Dead::Other("a string".to_owned()))
                }
                (value, _) => Ok(value),
            });
            let value = value.map_err(|dead| match dead {
                Dead::Missing if unsure => catalogue::missing(file, &[&self.channel], column),
                Dead::Other(found) if number == 1 => not_a_number(file, column, found),
                Dead::Missing => self.wrong(file, format!("it has no `{column}`")),
                Dead::Other(found) => {
                    self.wrong(file, format!("expected a number in `{column}`, found {found}"))
                }
            })?;
            if let Cell::Number(value) = value
                && value.is_infinite()
                && *reading != Reading::Text
            {
                let what = format!(
                    "expected a finite number in `{column}`, found {value}; remove the message"
                );
                return Err(self.wrong(file, what));
            }
            let topic = &self.channel.topic;
            self.columns[index].push(value, &|| format!("message {number} of `{topic}`"));
        }
        self.judge.take(times);
        self.times.push(*times);
        Ok(())
    }

    /// Brings the rows into the order of their time stamps, no two of which may be equal. Where none is asked for, those of measurement count if
    /// they can, and a sentence says why not.
    pub fn sort(&mut self, file: &Bag, asked: Option<Stamp>) -> Result<Option<String>, TableError> {
        let (path, topic) = (file.path.clone(), self.channel.topic.clone());
        if self.times.is_empty() {
            return Err(match (&self.key, self.fields.first()) {
                (Some(_), Some((column, ..))) => catalogue::missing(file, &[&self.channel], column),
                _ => RecordingError::Silent { path, topic }.into(),
            });
        }
        let mut objection = self.judge.objection();
        let mut stamp =
            asked.unwrap_or(if self.judge.is_right() { Stamp::Header } else { Stamp::Log });
        let Some(mut rows) = self.sorted(stamp) else {
            return Err(RecordingError::NoStamp { path, topic }.into());
        };
        if let (Stamp::Header, None, Some([first, second])) = (stamp, asked, repeated(&rows)) {
            objection = Some(format!("messages {first} and {second} have the same"));
            stamp = Stamp::Log;
            rows = self.sorted(stamp).unwrap_or_default();
        }
        if let Some(numbers) = repeated(&rows) {
            let time =
                rows.iter().find(|row| row.1 == numbers[0]).map_or(0.0, |row| seconds(row.0));
            let (stamp, other) = stamp.names();
            return Err(
                RecordingError::Repeated { path, topic, numbers, stamp, time, other }.into()
            );
        }
        if !rows.iter().map(|(_, number)| *number).is_sorted() {
            for Growing { values, .. } in &mut self.columns {
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

    fn sorted(&self, stamp: Stamp) -> Option<Vec<(i128, u64)>> {
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
fn repeated(rows: &[(i128, u64)]) -> Option<[u64; 2]> {
    let twice = rows.windows(2).find(|pair| pair[0].0 == pair[1].0)?;
    Some([twice[0].1, twice[1].1])
}
