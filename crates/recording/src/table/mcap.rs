//! Reads columns of numbers from an MCAP recording: fields of protobuf and JSON messages over their time stamps.

mod catalogue;
mod error;
mod field;
mod file;
mod survey;

use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

use ::mcap::Channel;
use ::mcap::MAGIC;
use ::mcap::records::MessageHeader;

use self::catalogue::Catalogue;
pub use self::error::RecordingError;
use self::field::{Dead, Field, Reader};
pub(crate) use self::file::Mcap;
pub(super) use self::survey::mcap_tallies;
use super::{Kept, Recorded, Series, TableError, Wanted};

/// The time stamp that counts.
#[derive(Debug, Clone, Copy)]
enum Stamp {
    Log,
    Publish,
}

impl Stamp {
    fn of(path: &Path, word: Option<&str>) -> Result<Self, RecordingError> {
        match word {
            None | Some("log_time") => Ok(Stamp::Log),
            Some("publish_time") => Ok(Stamp::Publish),
            Some(found) => {
                Err(RecordingError::Stamp { path: path.to_owned(), found: found.to_owned() })
            }
        }
    }

    /// Its name, and that of the other one.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Stamp::Log => ("log_time", "publish_time"),
            Stamp::Publish => ("publish_time", "log_time"),
        }
    }

    /// [ns]
    fn get(self, header: &MessageHeader) -> u64 {
        match self {
            Stamp::Log => header.log_time,
            Stamp::Publish => header.publish_time,
        }
    }
}

/// The wanted fields of a channel, and their values.
struct Track {
    channel: Arc<Channel<'static>>,
    reader: Reader,
    /// Each with its column.
    fields: Vec<(String, Field)>,
    /// The time stamp [ns] of each message, and its number in the order of the file.
    messages: Vec<(u64, u64)>,
    /// The numbers of each field. Gaps are NaN.
    columns: Vec<Vec<f64>>,
    /// Where the first gap of each field is.
    gaps: Vec<Option<String>>,
}

/// A column: the track, the field of it, and the unit.
type Place = (usize, usize, Option<String>);

/// Whether a file begins as a recording does. Of a pipe, which can be read once, nobody looks.
pub(super) fn is(path: &Path) -> std::io::Result<bool> {
    let mut magic = Vec::new();
    let file = std::fs::File::open(path)?;
    if !file.metadata()?.is_file() {
        return Ok(false);
    }
    file.take(MAGIC.len() as u64).read_to_end(&mut magic)?;
    Ok(magic == MAGIC)
}

/// Whether the recording has each of these columns. Of messages in JSON, the first one tells.
pub(super) fn look_up(
    path: &Path,
    names: &[&str],
) -> Result<Vec<Result<(), TableError>>, TableError> {
    let file = Mcap::open(path)?;
    let channels = file.channels()?;
    let catalogue = Catalogue::new(&file, &channels);
    let one = |name: &&str| {
        let (channel, field) = catalogue.find(name)?;
        want(&file, name, channel, &field, &mut Vec::new())?;
        catalogue::sampled(&file, channel, name, &field)
    };
    Ok(names.iter().map(one).collect())
}

/// Reads the wanted columns; stamps count from the earliest one, so that times of day keep their digits.
pub(super) fn read(path: &Path, wanted: &Wanted) -> Result<Recorded, TableError> {
    let stamp = Stamp::of(path, wanted.time.as_deref())?;
    let csv = wanted.time_unit.map(|_| "time_unit").or(wanted.dialect.first_key());
    if let Some(key) = csv {
        return Err(TableError::NotCsv { path: path.to_owned(), format: "MCAP", key });
    }
    let file = Mcap::open(path)?;
    let channels = file.channels()?;
    let catalogue = Catalogue::new(&file, &channels);
    let (mut tracks, mut columns) = (Vec::new(), Vec::new());
    for column in wanted.titles() {
        let found = catalogue.find(column);
        columns.push(
            found.and_then(|(channel, path)| want(&file, column, channel, &path, &mut tracks)),
        );
    }
    let (columns, wrong): (Vec<_>, Vec<_>) = columns.into_iter().partition(Result::is_ok);
    if !wrong.is_empty() {
        return Err(TableError::all(wrong.into_iter().filter_map(Result::err)));
    }
    file.messages(&mut |header, data| {
        let track = tracks.iter_mut().find(|track| track.channel.id == header.channel_id);
        track.map_or(Ok(()), |track| track.take(&file, stamp.get(header), data)).map(|()| true)
    })?;
    for track in &mut tracks {
        track.sort(&file, stamp)?;
    }
    Ok(recorded(&file, &mut tracks, columns.into_iter().flatten()))
}

/// Adds a field to the track of its channel.
fn want(
    file: &Mcap,
    column: &str,
    channel: &Arc<Channel<'static>>,
    field: &str,
    tracks: &mut Vec<Track>,
) -> Result<Place, TableError> {
    let known = tracks.iter().position(|track| track.channel.id == channel.id);
    let index = match known {
        Some(index) => index,
        None => {
            tracks.push(Track::new(file, column, channel)?);
            tracks.len() - 1
        }
    };
    let track = &mut tracks[index];
    let found = track.reader.find(field).map_err(|dead| match dead {
        Dead::Missing => catalogue::missing(file, &[channel], column),
        Dead::Other(found) => not_a_number(file, column, found),
    })?;
    track.fields.push((column.to_owned(), found));
    track.columns.push(Vec::new());
    track.gaps.push(None);
    let unit = channel.metadata.get(&format!("unit:{field}")).filter(|unit| !unit.is_empty());
    Ok((index, track.fields.len() - 1, unit.cloned()))
}

fn not_a_number(file: &Mcap, column: &str, found: String) -> TableError {
    let (path, column) = (file.path.clone(), column.to_owned());
    RecordingError::NotANumber { path, column, found }.into()
}

impl Track {
    fn new(
        file: &Mcap,
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
            fields: vec![],
            messages: vec![],
            columns: vec![],
            gaps: vec![],
        })
    }

    /// Takes a message. Whether a column is in JSON is first seen here.
    fn take(&mut self, file: &Mcap, stamp: u64, data: &[u8]) -> Result<(), TableError> {
        let number = self.messages.len() as u64 + 1;
        let wrong = |what| {
            let (path, topic) = (file.path.clone(), self.channel.topic.clone());
            TableError::from(RecordingError::Message { path, topic, number, what })
        };
        let message = self.reader.read(data).map_err(wrong)?;
        let json = matches!(self.reader, Reader::Json);
        let columns = self.columns.iter_mut().zip(&mut self.gaps);
        for ((column, field), (values, gap)) in self.fields.iter().zip(columns) {
            let value = field.number(&message).map_err(|dead| match dead {
                Dead::Missing if number == 1 && json => {
                    catalogue::missing(file, &[&self.channel], column)
                }
                Dead::Other(found) if number == 1 => not_a_number(file, column, found),
                Dead::Missing => wrong(format!("it has no `{column}`")),
                Dead::Other(found) => {
                    wrong(format!("expected a number in `{column}`, found {found}"))
                }
            })?;
            if value.is_infinite() {
                let what = format!(
                    "expected a finite number in `{column}`, found {value}; remove the message"
                );
                return Err(wrong(what));
            }
            if value.is_nan() {
                gap.get_or_insert_with(|| format!("message {number} of `{}`", self.channel.topic));
            }
            values.push(value);
        }
        self.messages.push((stamp, number));
        Ok(())
    }

    /// Brings the messages into the order of their time stamps, no two of which may be equal.
    fn sort(&mut self, file: &Mcap, stamp: Stamp) -> Result<(), RecordingError> {
        let (path, topic) = (file.path.clone(), self.channel.topic.clone());
        if self.messages.is_empty() {
            return Err(RecordingError::Silent { path, topic });
        }
        if !self.messages.is_sorted() {
            self.messages.sort_unstable();
            for values in &mut self.columns {
                let number = |(_, number): &(u64, u64)| values[*number as usize - 1];
                *values = self.messages.iter().map(number).collect();
            }
        }
        let twice = self.messages.windows(2).find(|pair| pair[0].0 == pair[1].0);
        let Some(&[(time, first), (_, second)]) = twice.and_then(|pair| pair.first_chunk()) else {
            return Ok(());
        };
        let (stamp, other) = stamp.names();
        let (numbers, time) = ([first, second], seconds(time));
        Err(RecordingError::Repeated { path, topic, numbers, stamp, time, other })
    }
}

fn seconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 / 1e9
}

fn recorded(file: &Mcap, tracks: &mut [Track], columns: impl Iterator<Item = Place>) -> Recorded {
    let ends = |track: &Track| Some((track.messages.first()?.0, track.messages.last()?.0));
    let ends: Vec<_> = tracks.iter().filter_map(ends).collect();
    let first = ends.iter().map(|(first, _)| *first).min().unwrap_or(0);
    let last = ends.iter().map(|(_, last)| *last).max().unwrap_or(0);
    let clock =
        |track: &Track| track.messages.iter().map(|(stamp, _)| seconds(stamp - first)).collect();
    let clocks = tracks.iter().map(clock).collect();
    let columns = columns.map(|(track, field, unit)| {
        let values = std::mem::take(&mut tracks[track].columns[field]);
        let gap = tracks[track].gaps[field].take();
        Ok(Series { clock: track, values, kept: Kept::Nothing, unit, gap })
    });
    let warning = (!file.finished).then(|| {
        format!(
            "the recording {} was not finished: it is read up to {} s, the end of its last complete chunk",
            file.path.display(),
            seconds(last)
        )
    });
    Recorded {
        columns: columns.collect(),
        clocks,
        zero: seconds(first),
        warnings: warning.into_iter().collect(),
    }
}

#[cfg(test)]
mod tests;
