//! Surveys the fields of a recording of messages.

use std::collections::HashMap;
use std::path::Path;

use ::mcap::Channel as Topic;

use super::bag::Bag;
use super::field::{ChannelValue, FieldError, MessageField, MessageReader, MessageRow};
use super::seconds;
use super::stamp::{HeaderStampCheck, MessageTimes};
use crate::survey::{Channel, Survey, Tally};
use crate::table::TableError;

/// So many different rows of a message are told apart, such as transforms between frames.
const MOST_KEYS: usize = 1000;

/// The fields of a channel of the recording.
struct TopicTally {
    reader: MessageReader,
    topic: String,
    units: HashMap<String, String>,
    /// What the program calls the variable of a field.
    names: HashMap<String, String>,
    /// The rows of its messages, by what tells them apart; nothing before the first message.
    rows: HashMap<Option<String>, RowTally>,
}

/// The rows of one kind.
struct RowTally {
    fields: Vec<FieldTally>,
    /// Lists that may have any length: path, way, length in the first message, and another length that was found.
    lists: Vec<(String, Vec<usize>, usize, Option<usize>)>,
    left_out: Vec<String>,
    stamp_check: HeaderStampCheck,
}

/// A field, and what was counted of it over both times.
struct FieldTally {
    steps: Vec<usize>,
    field: MessageField,
    name: String,
    unit: Option<String>,
    by_log: Tally,
    /// Only where messages say when they were measured.
    by_header: Option<Tally>,
}

impl TopicTally {
    fn new(channel: &Topic, reader: MessageReader) -> Self {
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
        TopicTally { reader, topic, units, names, rows: HashMap::new() }
    }

    fn take(
        &mut self,
        times: &dyn Fn(Option<i128>) -> MessageTimes,
        data: &[u8],
    ) -> Result<(), String> {
        let message = self.reader.read(data)?;
        let rows = self.reader.rows(&message);
        for row in &rows {
            let key = row.key.map(str::to_owned);
            if !self.rows.contains_key(&key) {
                if self.rows.len() >= MOST_KEYS {
                    continue;
                }
                let new = self.first(row, &message);
                self.rows.insert(key.clone(), new);
            }
            if let Some(of) = self.rows.get_mut(&key) {
                of.take(row, &times(row.stamp));
            }
        }
        Ok(())
    }

    /// The fields of the first row of its kind.
    fn first(&self, row: &MessageRow, message: &super::field::DecodedMessage) -> RowTally {
        let (mut lists, mut left_out) = (Vec::new(), Vec::new());
        let paths: Vec<(String, Vec<usize>)> = match self.reader.listing(Some(row)) {
            Some(listing) => {
                lists.extend(
                    listing.lists.into_iter().map(|(path, way, count)| (path, way, count, None)),
                );
                left_out = listing.left_out;
                listing.leaves.into_iter().map(|leaf| (leaf.path, leaf.steps)).collect()
            }
            None => {
                let paths = self.reader.list(Some(message)).into_iter();
                paths.map(|path| (path, Vec::new())).collect()
            }
        };
        let fields = paths.into_iter().filter_map(|(path, steps)| {
            let field = self.reader.find(&path).ok()?;
            let name = self.names.get(&path).cloned();
            let name = name.unwrap_or_else(|| format!("{}.{path}", self.topic));
            let unit = self.units.get(&path).cloned();
            let unit = unit.or_else(|| self.reader.unit(&field).map(str::to_owned));
            let by_header = self.reader.has_stamp().then(Tally::default);
            Some(FieldTally { steps, field, name, unit, by_log: Tally::default(), by_header })
        });
        RowTally {
            fields: fields.collect(),
            lists,
            left_out,
            stamp_check: HeaderStampCheck::default(),
        }
    }
}

impl RowTally {
    fn take(&mut self, row: &MessageRow, times: &MessageTimes) {
        self.stamp_check.take(times);
        for (_, way, count, other) in &mut self.lists {
            if other.is_none() {
                *other = row.length(way).filter(|length| length != count);
            }
        }
        for counted in &mut self.fields {
            let value = counted.field.value(row);
            count(&mut counted.by_log, seconds(times.log), &value);
            if let Some(tally) = &mut counted.by_header {
                count(tally, times.header.map_or(f64::NAN, seconds), &value);
            }
        }
    }

    /// The channels, and what is left out.
    fn finish(self, topic: &str, channels: &mut Vec<Channel>, left_out: &mut Vec<String>) {
        let RowTally { fields, lists, left_out: own, stamp_check } = self;
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
        if let Some(why) = stamp_check.objection() {
            left_out.push(format!("the times header.stamp of `{topic}`: {why}"));
        }
        let right = stamp_check.is_right();
        for FieldTally { steps, name, unit, by_log, by_header, .. } in fields {
            if changing.iter().any(|(_, way, ..)| steps.starts_with(way)) {
                continue;
            }
            let tally = by_header.filter(|_| right).unwrap_or(by_log);
            channels.push(Channel { name, unit, tally });
        }
    }
}

fn count(tally: &mut Tally, stamp: f64, value: &Result<ChannelValue, FieldError>) {
    match value {
        Ok(ChannelValue::Number(number)) => tally.number(stamp, *number),
        Ok(ChannelValue::Integer(integer)) => tally.number(stamp, *integer as f64),
        Ok(ChannelValue::Text(text)) => tally.text(stamp, text),
        Err(_) => tally.nothing(),
    }
}

/// The survey of a recording: numbers and texts of messages.
pub fn mcap_tallies(path: &Path) -> Result<Survey, TableError> {
    let file = Bag::open(path)?;
    let (mut tracks, mut left_out) = (HashMap::new(), Vec::new());
    for (id, channel) in &file.channels {
        let topic = &channel.topic;
        match MessageReader::new(channel) {
            Ok(Some(reader)) => {
                tracks.insert(*id, TopicTally::new(channel, reader));
            }
            Ok(None) => left_out.push(format!(
                "`{topic}` is left out: its encoding is {}",
                channel.message_encoding
            )),
            Err(what) => left_out.push(format!("`{topic}` is left out: {what}")),
        }
    }
    let ids: Vec<u16> = tracks.keys().copied().collect();
    let mut unread: HashMap<u16, (u64, String)> = HashMap::new();
    file.messages(&|id| ids.contains(&id), &mut |header, data| {
        let Some(track) = tracks.get_mut(&header.channel_id) else { return Ok(true) };
        if let Err(what) = track.take(&|measured| MessageTimes::new(header, measured), data) {
            unread.entry(header.channel_id).or_insert((0, what)).0 += 1;
        }
        Ok(true)
    })?;
    let mut warnings = file.warnings.clone();
    for (id, (count, what)) in unread {
        let topic = &file.channels[&id].topic;
        warnings.push(format!(
            "{count} messages of `{topic}` do not fit their schema, the first one: {what}"
        ));
    }
    let (mut channels, mut stamped) = (Vec::new(), Vec::new());
    for track in tracks.into_values() {
        for rows in track.rows.into_values() {
            stamped.extend(rows.stamp_check.before().filter(|_| rows.stamp_check.is_right()));
            rows.finish(&track.topic, &mut channels, &mut left_out);
        }
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    left_out.sort();
    warnings.sort();
    let least = stamped.iter().map(|it| it.0).reduce(f64::min);
    let most = stamped.iter().map(|it| it.1).reduce(f64::max);
    let time = match least.zip(most) {
        None => "`log_time`".to_owned(),
        Some((least, most)) => format!(
            "`header.stamp` where a message has one ({least:.4} to {most:.4} s before `log_time`), or else `log_time`"
        ),
    };
    Ok(Survey { format: file.format.clone(), time, channels, left_out, warnings })
}
