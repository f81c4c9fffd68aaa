//! Reads columns from a recording of messages, MCAP or a bag of ROS 2: fields of messages in protobuf, JSON, CDR and the form of ROS 1.

mod bag;
mod catalogue;
mod field;
mod file;
mod json;
mod stamp;
mod survey;
mod topic_columns;

use std::path::Path;
use std::sync::Arc;

use ::mcap::Channel;

use self::bag::MessageRecording;
pub(super) use self::bag::is_message_recording;
use self::catalogue::ChannelCatalogue;
use self::field::FieldError;
pub(crate) use self::file::McapReader;
use self::stamp::TimeSource;
pub(super) use self::survey::survey_message_recording;
use self::topic_columns::TopicColumns;
use super::{
    ColumnTitle, ColumnType, FileTitles, ReadColumns, ReadRequest, ReadSeries, RecordingError, TableError,
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
pub(super) fn ros_titles(path: &Path) -> Result<FileTitles, TableError> {
    let file = MessageRecording::open(path)?;
    let columns = catalogue::ros_column_titles(&file);
    let title = |(name, unit): (String, Option<String>)| {
        let (text, plain) = (name.clone(), name.clone());
        ColumnTitle { text, plain, name, unit }
    };
    let (columns, format) = (columns.into_iter().map(title).collect(), "MCAP".to_owned());
    Ok(FileTitles { columns, has_time: true, format })
}

/// Whether the recording has each of these columns. Of messages in JSON, the first one tells.
pub(super) fn check_message_columns(
    path: &Path,
    names: &[&str],
) -> Result<Vec<Result<(), TableError>>, TableError> {
    let file = MessageRecording::open(path)?;
    let catalogue = ChannelCatalogue::new(&file);
    let one = |name: &&str| {
        let (channel, field) = catalogue.resolve_column(name)?;
        request_field(&file, name, ColumnType::Number, channel, &field, &mut Vec::new())?;
        catalogue::check_field_in_first_message(&file, channel, name, &field)
    };
    Ok(names.iter().map(one).collect())
}

/// Reads the wanted columns; stamps count from the earliest one, so that times of day keep their digits.
pub(super) fn read_message_columns(path: &Path, request: &ReadRequest) -> Result<ReadColumns, TableError> {
    let file = MessageRecording::open(path)?;
    let stamp = TimeSource::parse(path, request.time.as_deref())?;
    let csv = request.time_unit.map(|_| "time_unit").or(request.dialect.first_key());
    if let Some(key) = csv {
        return Err(TableError::NotCsv { path: path.to_owned(), format: "MCAP", key });
    }
    let catalogue = ChannelCatalogue::new(&file);
    let (mut tracks, mut columns) = (Vec::new(), Vec::new());
    for wanted in &request.columns {
        let column = wanted.column.as_str();
        columns.push(catalogue.resolve_column(column).and_then(|(channel, path)| {
            request_field(&file, column, wanted.column_type, channel, &path, &mut tracks)
        }));
    }
    let (columns, wrong): (Vec<_>, Vec<_>) = columns.into_iter().partition(Result::is_ok);
    if !wrong.is_empty() {
        return Err(TableError::from_errors(wrong.into_iter().filter_map(Result::err)));
    }
    let ids: Vec<u16> = tracks.iter().map(|track: &TopicColumns| track.channel.id).collect();
    file.visit_messages(&|id| ids.contains(&id), &mut |header, data| {
        let of_channel = tracks.iter_mut().filter(|it| it.channel.id == header.channel_id);
        for track in of_channel {
            track.add_message(&file, header, data)?;
        }
        Ok(true)
    })?;
    let mut warnings: Vec<String> = file.warnings.clone();
    for track in &mut tracks {
        warnings.extend(track.sort_by_time_stamp(&file, stamp)?);
    }
    let mut recorded = collect_read_columns(&file, &mut tracks, columns.into_iter().flatten())?;
    recorded.warnings = warnings;
    Ok(recorded)
}

/// Adds a field to the track of its channel.
fn request_field(
    file: &MessageRecording,
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
    let found = reader.resolve_field(field).map_err(|dead| match dead {
        FieldError::Missing => catalogue::missing_column_error(file, &[channel], column),
        FieldError::Other(found) => not_a_number(file, column, found),
    })?;
    let unit = channel.metadata.get(&format!("unit:{field}")).filter(|unit| !unit.is_empty());
    let unit = unit.cloned().or_else(|| reader.field_unit(&found).map(str::to_owned));
    let same = |track: &TopicColumns| of_channel(track) && track.key.as_deref() == found.row_key();
    let index = match tracks.iter().position(same) {
        Some(index) => index,
        None => {
            let mut track = match new {
                Some(track) => track,
                None => TopicColumns::new(file, column, channel)?,
            };
            track.key = found.row_key().map(str::to_owned);
            tracks.push(track);
            tracks.len() - 1
        }
    };
    let field = tracks[index].add_field(column, found, column_type);
    Ok(ColumnSource { topic: index, field, unit })
}

fn not_a_number(file: &MessageRecording, column: &str, found: String) -> TableError {
    let (path, column) = (file.path.clone(), column.to_owned());
    RecordingError::NotANumber { path, column, found }.into()
}

fn nanoseconds_to_seconds(nanoseconds: i128) -> f64 {
    nanoseconds as f64 / 1e9
}

fn collect_read_columns(
    file: &MessageRecording,
    tracks: &mut [TopicColumns],
    columns: impl Iterator<Item = ColumnSource>,
) -> Result<ReadColumns, TableError> {
    let first = tracks.iter().filter_map(|it| Some(it.rows.first()?.0)).min().unwrap_or(0);
    let clock = |track: &TopicColumns| {
        track.rows.iter().map(|(stamp, _)| nanoseconds_to_seconds(stamp - first)).collect()
    };
    let clocks = tracks.iter().map(clock).collect();
    let column = |ColumnSource { topic, field, unit }| {
        let series = &mut tracks[topic].columns[field];
        if let Some(what) = series.wrong.take() {
            let (path, column) = (file.path.clone(), tracks[topic].fields[field].0.clone());
            return Err(TableError::Values { path, column, what });
        }
        let (values, exact) = (std::mem::take(&mut series.values), std::mem::take(&mut series.exact));
        Ok(ReadSeries { clock: topic, values, exact, unit, gap: series.gap.take() })
    };
    let columns = columns.map(column).collect();
    Ok(ReadColumns { columns, clocks, zero: nanoseconds_to_seconds(first), warnings: Vec::new() })
}

#[cfg(test)]
mod tests;
