//! Counts the fields of an MCAP recording.

use std::collections::HashMap;
use std::path::Path;

use super::field::{Dead, Field, Reader};
use super::file::Mcap;
use super::{Stamp, seconds};
use crate::survey::{Channel, Survey, Tally};
use crate::table::TableError;

/// The fields of a channel of the recording.
struct Track {
    reader: Reader,
    topic: String,
    units: HashMap<String, String>,
    /// What the program calls the variable of a field.
    names: HashMap<String, String>,
    /// Each with its place among the channels of the survey; nothing before the first message.
    fields: Option<Vec<(Field, usize)>>,
}

/// The survey of a recording: numbers of messages in protobuf and JSON over `log_time`.
pub fn mcap_tallies(path: &Path) -> Result<Survey, TableError> {
    let file = Mcap::open(path)?;
    let (mut tracks, mut left_out) = (HashMap::new(), Vec::new());
    for (id, channel) in file.channels()? {
        let topic = channel.topic.clone();
        match Reader::new(&channel) {
            Ok(Some(reader)) => {
                let about = |of: &'static str| {
                    let entries = channel.metadata.iter();
                    entries.filter_map(move |(key, value)| {
                        let field = key.strip_prefix(of)?;
                        (!value.is_empty()).then(|| (field.to_owned(), value.clone()))
                    })
                };
                let node = topic.trim_start_matches('/').rsplit_once('/').map(|it| it.0.to_owned());
                let name =
                    |(field, variable)| Some((field, format!("{}.{variable}", node.as_ref()?)));
                let (units, names) =
                    (about("unit:").collect(), about("fmi:").filter_map(name).collect());
                tracks.insert(id, Track { reader, topic, units, names, fields: None });
            }
            Ok(None) => left_out.push(format!(
                "`{topic}` is left out: its encoding is {}",
                channel.message_encoding
            )),
            Err(what) => left_out.push(format!("`{topic}` is left out: {what}")),
        }
    }
    let (mut channels, mut unread): (Vec<Channel>, u64) = (Vec::new(), 0);
    file.messages(&mut |header, data| {
        let Some(track) = tracks.get_mut(&header.channel_id) else { return Ok(true) };
        let Ok(message) = track.reader.read(data) else {
            unread += 1;
            return Ok(true);
        };
        let Track { reader, topic, units, names, fields } = track;
        let fields = fields.get_or_insert_with(|| {
            let paths = reader.list(Some(&message)).into_iter();
            let found = paths.filter_map(|path| {
                let field = reader.find(&path).ok()?;
                let name = names.get(&path).cloned();
                let name = name.unwrap_or_else(|| format!("{topic}.{path}"));
                let unit = units.get(&path).cloned();
                channels.push(Channel { name, unit, tally: Tally::default() });
                Some((field, channels.len() - 1))
            });
            found.collect()
        });
        let stamp = seconds(Stamp::Log.get(header));
        for (field, place) in fields {
            let tally = &mut channels[*place].tally;
            match field.number(&message) {
                Ok(number) => tally.number(stamp, number),
                Err(Dead::Missing | Dead::Other(_)) => tally.nothing(),
            }
        }
        Ok(true)
    })?;
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    let mut warnings = Vec::new();
    if unread > 0 {
        warnings.push(format!("{unread} messages do not fit their schema"));
    }
    if !file.finished {
        warnings.push("the recording was not finished".to_owned());
    }
    let (format, time) = ("MCAP".to_owned(), "`log_time`".to_owned());
    Ok(Survey { format, time, channels, left_out, warnings })
}
