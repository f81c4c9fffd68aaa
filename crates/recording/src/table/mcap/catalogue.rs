//! Finds the channel of a column, and lists what is in a recording when there is none.

use std::collections::BTreeMap;
use std::sync::Arc;

use ::mcap::Channel;

use super::field::Reader;
use super::file::{Channels, Mcap};
use super::{RecordingError, TableError};

/// The channel of a column and the path of its field: `/topic.path`, or `node.variable` in a recording of
/// a run, whose channels name the variables of their fields.
pub fn find<'a>(
    file: &Mcap,
    channels: &'a Channels,
    column: &str,
) -> Result<(&'a Arc<Channel<'static>>, String), TableError> {
    let after = |topic: &str| column.strip_prefix(topic)?.strip_prefix('.').map(str::to_owned);
    let named = channels.values().filter_map(|channel| Some((channel, after(&channel.topic)?)));
    let Some((channel, path)) = named.max_by_key(|(channel, _)| channel.topic.len()) else {
        let found = variable(channels, column);
        return found.ok_or_else(|| missing(file, &channels.values().collect::<Vec<_>>(), column));
    };
    let topic = channel.topic.clone();
    if channels.values().filter(|other| other.topic == topic).count() > 1 {
        let (path, column) = (file.path.clone(), column.to_owned());
        return Err(RecordingError::Ambiguous { path, column, topic }.into());
    }
    Ok((channel, path))
}

/// The field that holds a variable: an output before an input of the same name.
fn variable<'a>(
    channels: &'a Channels,
    column: &str,
) -> Option<(&'a Arc<Channel<'static>>, String)> {
    let side = |channel: &Channel| !channel.topic.ends_with("/outputs");
    let mut sides: Vec<_> = channels.values().collect();
    sides.sort_by_key(|channel| side(channel));
    let field = |channel: &'a Arc<Channel<'static>>| {
        let mut variables = variables(channel);
        let (_, field) = variables.find(|(variable, _)| variable == column)?;
        Some((channel, field.to_owned()))
    };
    sides.into_iter().find_map(field)
}

/// What a recording of a run says of a channel: `node.variable` and the field of each.
fn variables<'a>(channel: &'a Channel) -> impl Iterator<Item = (String, &'a str)> {
    let node = channel.topic.trim_start_matches('/').rsplit_once('/').map(|(node, _)| node);
    let fields = channel
        .metadata
        .iter()
        .filter_map(|(key, variable)| Some((key.strip_prefix("fmi:")?, variable)));
    fields.filter_map(move |(field, variable)| Some((format!("{}.{variable}", node?), field)))
}

/// The error that lists what can be asked for instead.
pub fn missing(file: &Mcap, channels: &[&Arc<Channel<'static>>], column: &str) -> TableError {
    let mut present: Vec<_> = match column.starts_with('/') {
        true => Vec::new(),
        false => {
            channels.iter().flat_map(|channel| variables(channel)).map(|(name, _)| name).collect()
        }
    };
    if present.is_empty() {
        let samples = samples(file, channels);
        present = channels.iter().flat_map(|channel| fields(channel, &samples)).collect();
    }
    TableError::missing(&file.path, column, present)
}

fn fields(channel: &Channel, samples: &BTreeMap<u16, Vec<u8>>) -> Vec<String> {
    let topic = &channel.topic;
    let Ok(Some(reader)) = Reader::new(channel) else {
        return vec![format!("{topic} (encoding {})", channel.message_encoding)];
    };
    let message = samples.get(&channel.id).and_then(|sample| reader.read(sample).ok());
    let paths = reader.list(message.as_ref());
    paths.into_iter().map(|path| format!("{topic}.{path}")).collect()
}

/// The first message of each channel whose schema does not tell its fields.
fn samples(file: &Mcap, channels: &[&Arc<Channel<'static>>]) -> BTreeMap<u16, Vec<u8>> {
    let json = channels.iter().filter(|channel| channel.message_encoding == "json");
    let mut open: Vec<_> = json.map(|channel| channel.id).collect();
    let mut samples = BTreeMap::new();
    // What is wrong with the rest of the file is not the matter here.
    let _ = file.messages(&mut |header, data| {
        if let Some(index) = open.iter().position(|id| *id == header.channel_id) {
            samples.insert(open.swap_remove(index), data.to_vec());
        }
        Ok(!open.is_empty())
    });
    samples
}
