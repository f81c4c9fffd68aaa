//! Resolves a column to its channel and field, and lists what a recording has instead.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use ::mcap::Channel;

use super::bag::MessageRecording;
use super::field::MessageDecoder;
use super::{RecordingError, TableError};

/// The channels of a file, with what can be asked for in each: a recording may have a hundred thousand columns.
pub struct ChannelCatalogue<'a> {
    file: &'a MessageRecording,
    /// The channels of each topic.
    topics: HashMap<&'a str, Vec<&'a Arc<Channel<'static>>>>,
    /// The channel and the field of each variable of a run: an output before an input of the same name.
    variables: HashMap<String, (&'a Arc<Channel<'static>>, &'a str)>,
}

impl<'a> ChannelCatalogue<'a> {
    pub fn new(file: &'a MessageRecording) -> Self {
        let mut sides: Vec<_> = file.channels.values().collect();
        sides.sort_by_key(|channel| !channel.topic.ends_with("/outputs"));
        let (mut topics, mut found) = (HashMap::<_, Vec<_>>::new(), HashMap::new());
        for channel in sides {
            topics.entry(channel.topic.as_str()).or_default().push(channel);
            for (variable, field) in channel_variables(channel) {
                found.entry(variable).or_insert((channel, field));
            }
        }
        Self { file, topics, variables: found }
    }

    /// The channel of a column and the path of its field: `/topic.path`, or `node.variable` in a recording of
    /// a run, whose channels name the variables of their fields.
    pub fn resolve_column(&self, column: &str) -> Result<(&'a Arc<Channel<'static>>, String), TableError> {
        // The longest topic, if several fit.
        let ends = column.rmatch_indices('.').map(|(end, _)| end);
        let named = ends.filter_map(|end| Some((self.topics.get(&column[..end])?, end))).next();
        let Some((channels, end)) = named else {
            let found = self.variables.get(column);
            return found.map(|(channel, field)| (*channel, (*field).to_owned())).ok_or_else(|| {
                missing_column_error(self.file, &self.file.channels.values().collect::<Vec<_>>(), column)
            });
        };
        match channels[..] {
            [channel] => Ok((channel, column[end + 1..].to_owned())),
            _ => {
                let (path, topic) = (self.file.path.clone(), column[..end].to_owned());
                Err(RecordingError::Ambiguous { path, column: column.to_owned(), topic }.into())
            }
        }
    }
}

/// What a recording of a run says of a channel: `node.variable` and the field of each.
fn channel_variables<'a>(channel: &'a Channel) -> impl Iterator<Item = (String, &'a str)> {
    let node = channel.topic.trim_start_matches('/').rsplit_once('/').map(|(node, _)| node);
    let fields =
        channel.metadata.iter().filter_map(|(key, variable)| Some((key.strip_prefix("fmi:")?, variable)));
    fields.filter_map(move |(field, variable)| Some((format!("{}.{variable}", node?), field)))
}

/// The error that lists what can be asked for instead.
pub fn missing_column_error(
    file: &MessageRecording,
    channels: &[&Arc<Channel<'static>>],
    column: &str,
) -> TableError {
    let mut present: Vec<_> = match column.starts_with('/') {
        true => Vec::new(),
        false => {
            channels.iter().flat_map(|channel| channel_variables(channel)).map(|(name, _)| name).collect()
        }
    };
    if present.is_empty() {
        let samples = first_messages(file, channels);
        present = channels.iter().flat_map(|channel| channel_field_paths(channel, &samples)).collect();
    }
    TableError::missing_column(&file.path, column, present)
}

/// The columns of topics of ROS with their units, as the first message of each has them.
pub fn ros_column_titles(file: &MessageRecording) -> Vec<(String, Option<String>)> {
    let is_ros = |channel: &&Arc<Channel<'static>>| {
        ros_bag::MessageEncoding::from_name(&channel.message_encoding).is_some()
    };
    let channels: Vec<_> = file.channels.values().filter(is_ros).collect();
    let samples = first_messages(file, &channels);
    let mut titles = Vec::new();
    for channel in channels {
        let Ok(Some(reader)) = MessageDecoder::new(channel) else { continue };
        let message = samples.get(&channel.id).and_then(|sample| reader.decode(sample).ok());
        for path in reader.field_paths(message.as_ref()) {
            let unit = reader.resolve_field(&path).ok().and_then(|field| reader.field_unit(&field));
            titles.push((format!("{}.{path}", channel.topic), unit.map(str::to_owned)));
        }
    }
    titles
}

/// Whether the first message of a channel has the field, where the schema does not tell.
pub fn check_field_in_first_message(
    file: &MessageRecording,
    channel: &Arc<Channel<'static>>,
    column: &str,
    field: &str,
) -> Result<(), TableError> {
    if channel.message_encoding != "json" {
        return Ok(());
    }
    let samples = first_messages(file, &[channel]);
    let Some(sample) = samples.get(&channel.id) else { return Ok(()) };
    match channel_field_paths(channel, &samples).iter().any(|it| *it == format!("{}.{field}", channel.topic))
    {
        true => Ok(()),
        false if sample.is_empty() => Ok(()),
        false => Err(missing_column_error(file, &[channel], column)),
    }
}

fn channel_field_paths(channel: &Channel, samples: &BTreeMap<u16, Vec<u8>>) -> Vec<String> {
    let topic = &channel.topic;
    let Ok(Some(reader)) = MessageDecoder::new(channel) else {
        return vec![format!("{topic} (encoding {})", channel.message_encoding)];
    };
    let message = samples.get(&channel.id).and_then(|sample| reader.decode(sample).ok());
    let paths = reader.field_paths(message.as_ref());
    paths.into_iter().map(|path| format!("{topic}.{path}")).collect()
}

/// The first message of each channel whose schema does not tell its fields.
fn first_messages(file: &MessageRecording, channels: &[&Arc<Channel<'static>>]) -> BTreeMap<u16, Vec<u8>> {
    let told = |channel: &&&Arc<Channel<'static>>| channel.message_encoding != "protobuf";
    let mut open: Vec<_> = channels.iter().filter(told).map(|channel| channel.id).collect();
    let mut samples = BTreeMap::new();
    let ids = open.clone();
    // What is wrong with the rest of the file is not the matter here.
    let _ = file.visit_messages(&|id| ids.contains(&id), &mut |header, data| {
        if let Some(index) = open.iter().position(|id| *id == header.channel_id) {
            samples.insert(open.swap_remove(index), data.to_vec());
        }
        Ok(!open.is_empty())
    });
    samples
}
