//! Reads columns from a recording of messages, MCAP or a bag of ROS 2: fields of messages in protobuf, JSON, CDR and the form of ROS 1.

mod bag;
mod catalogue;
mod field;
mod file;
mod stamp;
mod survey;
mod topic_columns;

use std::path::Path;
use std::sync::Arc;

use ::mcap::Channel;

use self::bag::Bag;
pub(super) use self::bag::is;
use self::catalogue::Catalogue;
use self::field::FieldError;
pub(crate) use self::file::Mcap;
use self::stamp::TimeSource;
pub(super) use self::survey::mcap_tallies;
use self::topic_columns::TopicColumns;
use super::{
    ColumnTitle, ColumnType, ReadColumns, ReadRequest, RecordingError, Series, TableError, Titles,
};

/// Where a column is: a field of a topic, with its unit.
struct ColumnSource {
    /// The index of the topic's columns.
    topic: usize,
    /// The index of the field among them.
    field: usize,
    unit: Option<String>,
}

/// The titles of a recording of ROS, whose messages tell their units; those of others only reading tells.
pub(super) fn titles(path: &Path) -> Result<Titles, TableError> {
    let file = Bag::open(path)?;
    let columns = catalogue::titles(&file);
    let title = |(name, unit): (String, Option<String>)| {
        let (text, plain) = (name.clone(), name.clone());
        ColumnTitle { text, plain, name, unit }
    };
    let (columns, format) = (columns.into_iter().map(title).collect(), "MCAP".to_owned());
    Ok(Titles { columns, has_time: true, format })
}

/// Whether the recording has each of these columns. Of messages in JSON, the first one tells.
pub(super) fn look_up(
    path: &Path,
    names: &[&str],
) -> Result<Vec<Result<(), TableError>>, TableError> {
    let file = Bag::open(path)?;
    let catalogue = Catalogue::new(&file);
    let one = |name: &&str| {
        let (channel, field) = catalogue.find(name)?;
        request_field(&file, name, ColumnType::Number, channel, &field, &mut Vec::new())?;
        catalogue::sampled(&file, channel, name, &field)
    };
    Ok(names.iter().map(one).collect())
}

/// Reads the wanted columns; stamps count from the earliest one, so that times of day keep their digits.
pub(super) fn read(path: &Path, request: &ReadRequest) -> Result<ReadColumns, TableError> {
    let file = Bag::open(path)?;
    let stamp = TimeSource::of(path, request.time.as_deref())?;
    let csv = request.time_unit.map(|_| "time_unit").or(request.dialect.first_key());
    if let Some(key) = csv {
        return Err(TableError::NotCsv { path: path.to_owned(), format: "MCAP", key });
    }
    let catalogue = Catalogue::new(&file);
    let (mut tracks, mut columns) = (Vec::new(), Vec::new());
    for wanted in &request.columns {
        let column = wanted.column.as_str();
        columns.push(catalogue.find(column).and_then(|(channel, path)| {
            request_field(&file, column, wanted.column_type, channel, &path, &mut tracks)
        }));
    }
    let (columns, wrong): (Vec<_>, Vec<_>) = columns.into_iter().partition(Result::is_ok);
    if !wrong.is_empty() {
        return Err(TableError::all(wrong.into_iter().filter_map(Result::err)));
    }
    let ids: Vec<u16> = tracks.iter().map(|track: &TopicColumns| track.channel.id).collect();
    file.messages(&|id| ids.contains(&id), &mut |header, data| {
        let of_channel = tracks.iter_mut().filter(|it| it.channel.id == header.channel_id);
        for track in of_channel {
            track.take(&file, header, data)?;
        }
        Ok(true)
    })?;
    let mut warnings: Vec<String> = file.warnings.clone();
    for track in &mut tracks {
        warnings.extend(track.sort(&file, stamp)?);
    }
    let mut recorded = recorded(&file, &mut tracks, columns.into_iter().flatten())?;
    recorded.warnings = warnings;
    Ok(recorded)
}

/// Adds a field to the track of its channel.
fn request_field(
    file: &Bag,
    column: &str,
    column_type: ColumnType,
    channel: &Arc<Channel<'static>>,
    field: &str,
    tracks: &mut Vec<TopicColumns>,
) -> Result<ColumnSource, TableError> {
    let mut new = None;
    let of_channel = |track: &TopicColumns| track.channel.id == channel.id;
    let reader = match tracks.iter().find(|track| of_channel(track)) {
        Some(track) => &track.reader,
        None => &new.insert(TopicColumns::new(file, column, channel)?).reader,
    };
    let found = reader.find(field).map_err(|dead| match dead {
        FieldError::Missing => catalogue::missing(file, &[channel], column),
        FieldError::Other(found) => not_a_number(file, column, found),
    })?;
    let unit = channel.metadata.get(&format!("unit:{field}")).filter(|unit| !unit.is_empty());
    let unit = unit.cloned().or_else(|| reader.unit(&found).map(str::to_owned));
    let same = |track: &TopicColumns| of_channel(track) && track.key.as_deref() == found.key();
    let index = match tracks.iter().position(same) {
        Some(index) => index,
        None => {
            let mut track = match new {
                Some(track) => track,
                None => TopicColumns::new(file, column, channel)?,
            };
            track.key = found.key().map(str::to_owned);
            tracks.push(track);
            tracks.len() - 1
        }
    };
    let field = tracks[index].add(column, found, column_type);
    Ok(ColumnSource { topic: index, field, unit })
}

fn not_a_number(file: &Bag, column: &str, found: String) -> TableError {
    let (path, column) = (file.path.clone(), column.to_owned());
    RecordingError::NotANumber { path, column, found }.into()
}

fn seconds(nanoseconds: i128) -> f64 {
    nanoseconds as f64 / 1e9
}

fn recorded(
    file: &Bag,
    tracks: &mut [TopicColumns],
    columns: impl Iterator<Item = ColumnSource>,
) -> Result<ReadColumns, TableError> {
    let first = tracks.iter().filter_map(|it| Some(it.rows.first()?.0)).min().unwrap_or(0);
    let clock =
        |track: &TopicColumns| track.rows.iter().map(|(stamp, _)| seconds(stamp - first)).collect();
    let clocks = tracks.iter().map(clock).collect();
    let column = |ColumnSource { topic, field, unit }| {
        let series = &mut tracks[topic].columns[field];
        if let Some(what) = series.wrong.take() {
            let (path, column) = (file.path.clone(), tracks[topic].fields[field].0.clone());
            return Err(TableError::Values { path, column, what });
        }
        let (values, exact) =
            (std::mem::take(&mut series.values), std::mem::take(&mut series.exact));
        Ok(Series { clock: topic, values, exact, unit, gap: series.gap.take() })
    };
    let columns = columns.map(column).collect();
    Ok(ReadColumns { columns, clocks, zero: seconds(first), warnings: Vec::new() })
}

#[cfg(test)]
mod tests;
