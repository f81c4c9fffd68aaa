//! Surveys the fields of a recording of messages.

use std::collections::HashMap;
use std::path::Path;

use ::mcap::Channel as Topic;

use super::bag::MessageRecording;
use super::field::{ChannelValue, FieldError, MessageDecoder, MessageField, MessageRow};
use super::nanoseconds_to_seconds;
use super::stamp::{HeaderStampCheck, MessageTimes};
use crate::records::McapStatistics;
use crate::survey::{BEGINNING_SIZE, ChannelStatistics, ChannelSurvey, LogSurvey};
use crate::table::TableError;

/// So many different rows of a message are told apart, such as transforms between frames.
const MOST_KEYS: usize = 1000;

/// The fields of a channel of the recording.
struct TopicStatistics {
    reader: MessageDecoder,
    topic: String,
    units: HashMap<String, String>,
    /// What the program calls the variable of a field.
    names: HashMap<String, String>,
    /// The rows of its messages, by what tells them apart; nothing before the first message.
    rows: HashMap<Option<String>, RowStatistics>,
}

/// The rows of one kind.
struct RowStatistics {
    fields: Vec<FieldStatistics>,
    /// Lists that may have any length: path, way, length in the first message, and another length that was found.
    lists: Vec<(String, Vec<usize>, usize, Option<usize>)>,
    left_out: Vec<String>,
    stamp_check: HeaderStampCheck,
}

/// A field, and what was counted of it over both times.
struct FieldStatistics {
    steps: Vec<usize>,
    field: MessageField,
    name: String,
    unit: Option<String>,
    by_log: ChannelStatistics,
    /// Only where messages say when they were measured.
    by_header: Option<ChannelStatistics>,
}

impl TopicStatistics {
    fn new(channel: &Topic, reader: MessageDecoder) -> Self {
        let topic = channel.topic.clone();
        let about = |of: &'static str| {
            let entries = channel.metadata.iter();
            entries.filter_map(move |(key, value)| {
                let field = key.strip_prefix(of)?;
                (!value.is_empty()).then(|| (field.to_owned(), value.clone()))
            })
        };
        let node = topic.trim_start_matches('/').rsplit_once('/').map(|it| it.0.to_owned());
        let name = |(field, variable)| Some((field, format!("{}.{variable}", node.as_ref()?)));
        let (units, names) = (about("unit:").collect(), about("fmi:").filter_map(name).collect());
        TopicStatistics { reader, topic, units, names, rows: HashMap::new() }
    }

    fn add_message(
        &mut self,
        times: &dyn Fn(Option<i128>) -> MessageTimes,
        data: &[u8],
    ) -> Result<(), String> {
        let message = self.reader.decode(data)?;
        let rows = self.reader.message_rows(&message);
        for row in &rows {
            let key = row.key.map(str::to_owned);
            if !self.rows.contains_key(&key) {
                if self.rows.len() >= MOST_KEYS {
                    continue;
                }
                let new = self.first_row_statistics(row, &message);
                self.rows.insert(key.clone(), new);
            }
            if let Some(of) = self.rows.get_mut(&key) {
                of.add_row(row, &times(row.stamp));
            }
        }
        Ok(())
    }

    /// The fields of the first row of its kind.
    fn first_row_statistics(
        &self,
        row: &MessageRow,
        message: &super::field::DecodedMessage,
    ) -> RowStatistics {
        let (mut lists, mut left_out) = (Vec::new(), Vec::new());
        let paths: Vec<(String, Vec<usize>)> = match self.reader.ros_field_listing(Some(row)) {
            Some(listing) => {
                lists.extend(listing.lists.into_iter().map(|(path, way, count)| (path, way, count, None)));
                left_out = listing.left_out;
                listing.leaves.into_iter().map(|leaf| (leaf.path, leaf.steps)).collect()
            }
            None => {
                let paths = self.reader.field_paths(Some(message)).into_iter();
                paths.map(|path| (path, Vec::new())).collect()
            }
        };
        let fields = paths.into_iter().filter_map(|(path, steps)| {
            let field = self.reader.resolve_field(&path).ok()?;
            let name = self.names.get(&path).cloned();
            let name = name.unwrap_or_else(|| format!("{}.{path}", self.topic));
            let unit = self.units.get(&path).cloned();
            let unit = unit.or_else(|| self.reader.field_unit(&field).map(str::to_owned));
            let by_header = self.reader.has_stamp().then(ChannelStatistics::default);
            Some(FieldStatistics {
                steps,
                field,
                name,
                unit,
                by_log: ChannelStatistics::default(),
                by_header,
            })
        });
        RowStatistics { fields: fields.collect(), lists, left_out, stamp_check: HeaderStampCheck::default() }
    }
}

impl RowStatistics {
    fn add_row(&mut self, row: &MessageRow, times: &MessageTimes) {
        self.stamp_check.add_row(times);
        for (_, way, count, other) in &mut self.lists {
            if other.is_none() {
                *other = row.ros_list_length(way).filter(|length| length != count);
            }
        }
        for counted in &mut self.fields {
            let value = counted.field.value_in_row(row);
            count_field_value(&mut counted.by_log, nanoseconds_to_seconds(times.log), &value);
            if let Some(tally) = &mut counted.by_header {
                count_field_value(tally, times.header.map_or(f64::NAN, nanoseconds_to_seconds), &value);
            }
        }
    }

    /// The channels, and what is left out.
    fn append_channels(self, topic: &str, channels: &mut Vec<ChannelSurvey>, left_out: &mut Vec<String>) {
        let RowStatistics { fields, lists, left_out: own, stamp_check } = self;
        let told = |what: &String| format!("{what} of `{topic}`");
        left_out.extend(own.iter().map(told));
        let changing: Vec<_> = lists
            .iter()
            .filter_map(|(path, way, count, other)| Some((path, way, count, (*other)?)))
            .collect();
        for (path, _, count, other) in &changing {
            left_out.push(format!(
                "`{path}` of `{topic}`: a list whose length changes, such as from {count} to {other}"
            ));
        }
        if let Some(why) = stamp_check.rejection_reason() {
            left_out.push(format!("the times header.stamp of `{topic}`: {why}"));
        }
        let right = stamp_check.is_accepted();
        for FieldStatistics { steps, name, unit, by_log, by_header, .. } in fields {
            if changing.iter().any(|(_, way, ..)| steps.starts_with(way)) {
                continue;
            }
            let tally = by_header.filter(|_| right).unwrap_or(by_log);
            channels.push(ChannelSurvey { name, unit, tally, indexed_rows: None });
        }
    }
}

fn count_field_value(tally: &mut ChannelStatistics, stamp: f64, value: &Result<ChannelValue, FieldError>) {
    match value {
        Ok(ChannelValue::Number(number)) => tally.add_number(stamp, *number),
        Ok(ChannelValue::Integer(integer)) => tally.add_number(stamp, *integer as f64),
        Ok(ChannelValue::Text(text)) => tally.add_text(stamp, text),
        Err(_) => tally.add_gap(),
    }
}

/// The survey of a recording: numbers and texts of messages. Given the size of a large file [B], only the beginning of one with an index is
/// read.
pub fn survey_message_recording(path: &Path, large: Option<u64>) -> Result<LogSurvey, TableError> {
    let file = MessageRecording::open(path)?;
    let index = match large {
        Some(size) => file.read_statistics()?.map(|counts| (size, counts)),
        None => None,
    };
    let most = index.as_ref().map_or(u64::MAX, |_| BEGINNING_SIZE);
    let (mut tracks, mut left_out) = (HashMap::new(), Vec::new());
    for (id, channel) in &file.channels {
        let topic = &channel.topic;
        match MessageDecoder::new(channel) {
            Ok(Some(reader)) => {
                tracks.insert(*id, TopicStatistics::new(channel, reader));
            }
            Ok(None) => {
                left_out.push(format!("`{topic}` is left out: its encoding is {}", channel.message_encoding))
            }
            Err(what) => left_out.push(format!("`{topic}` is left out: {what}")),
        }
    }
    let ids: Vec<u16> = tracks.keys().copied().collect();
    let mut unread: HashMap<u16, (u64, String)> = HashMap::new();
    let mut read = 0;
    file.visit_messages(&|id| ids.contains(&id), &mut |header, data| {
        let Some(track) = tracks.get_mut(&header.channel_id) else { return Ok(true) };
        if let Err(what) = track.add_message(&|measured| MessageTimes::new(header, measured), data) {
            unread.entry(header.channel_id).or_insert((0, what)).0 += 1;
        }
        read += data.len() as u64;
        Ok(read < most)
    })?;
    // Attachments can make a file large whose messages are few.
    let index = index.filter(|_| read >= most);
    let mut warnings = file.warnings.clone();
    for (id, (count, what)) in unread {
        let topic = &file.channels[&id].topic;
        warnings
            .push(format!("{count} messages of `{topic}` do not fit their schema, the first one: {what}"));
    }
    let (mut channels, mut stamped) = (Vec::new(), Vec::new());
    for (id, track) in tracks {
        let indexed = index.as_ref().and_then(|(_, counts)| counts.by_channel.get(&id).copied());
        if let Some(count) = indexed.filter(|_| track.rows.is_empty()) {
            left_out
                .push(format!("`{}`: its {count} messages are not in the part that was read", track.topic));
        }
        // Messages of one topic may hold rows of several kinds, whose numbers no index tells.
        let indexed = indexed.filter(|_| track.rows.len() == 1);
        let before = channels.len();
        for rows in track.rows.into_values() {
            stamped
                .extend(rows.stamp_check.recorder_delay_range().filter(|_| rows.stamp_check.is_accepted()));
            rows.append_channels(&track.topic, &mut channels, &mut left_out);
        }
        channels[before..].iter_mut().for_each(|it| it.indexed_rows = indexed);
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    left_out.sort();
    warnings.sort();
    let least = stamped.iter().map(|it| it.0).reduce(f64::min);
    let most = stamped.iter().map(|it| it.1).reduce(f64::max);
    let mut time = match least.zip(most) {
        None => "`log_time`".to_owned(),
        Some((least, most)) => format!(
            "`header.stamp` where a message has one ({least:.4} to {most:.4} s before `log_time`), or else `log_time`"
        ),
    };
    if let Some((_, McapStatistics { times, .. })) = &index {
        let [first, last] = times.map(|time| nanoseconds_to_seconds(time.into()));
        time += &format!("; by the index, `log_time` goes from {first} to {last} s");
    }
    let part_of = index.map(|(size, _)| size);
    Ok(LogSurvey { format: file.format.clone(), time, channels, left_out, warnings, part_of })
}
