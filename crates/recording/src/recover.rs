//! Makes a valid recording from that of a killed run.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use ::mcap::read::{ChunkFlattener, Options};
use ::mcap::records::{MessageHeader, Record};
use ::mcap::write::Metadata;
use ::mcap::{Attachment, Compression, McapError, McapResult, WriteOptions, Writer};
use diagnostics::Error;

/// The saved part of a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recovered {
    /// Messages of all channels.
    pub messages: u64,
    /// Channels.
    pub channels: usize,
    /// From the first to the last message [s].
    pub seconds: f64,
    /// The reason why the rest is lost; without it nothing is lost.
    pub lost: Option<String>,
}

/// Copies the readable part of `broken` into a new file `into`, which appears when it is complete.
///
/// # Errors
/// When `broken` cannot be read or is no MCAP file at all, or `into` cannot be written.
pub fn recover(broken: &Path, into: &Path) -> Result<Recovered, Error> {
    let unreadable = |what: String| Error::input(format!("{}: {what}", broken.display()));
    let bytes =
        std::fs::read(broken).map_err(|error| unreadable(format!("cannot read: {error}")))?;
    let records = ChunkFlattener::new_with_options(&bytes, Options::IgnoreEndMagic.into())
        .map_err(|error| unreadable(format!("expected an MCAP file: {error}")))?;
    let partial = into.with_added_extension("partial");
    let failed = |error: McapError| Error::output(&partial, error);
    let file = File::create(&partial).map_err(|error| Error::output(&partial, error))?;
    let options = WriteOptions::new()
        .profile("")
        .library(concat!("trackside ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4));
    let mut copy = Copy {
        writer: options.create(BufWriter::new(file)).map_err(failed)?,
        schemas: HashMap::from([(0, 0)]),
        channels: HashMap::new(),
        messages: 0,
        times: None,
    };
    let mut lost = None;
    for record in records {
        match record {
            Ok(record) => copy.add(record).map_err(failed)?,
            Err(error) => {
                lost = Some(error.to_string());
                break;
            }
        }
    }
    if copy.channels.is_empty() {
        let _ = std::fs::remove_file(&partial);
        let reason = lost.unwrap_or_else(|| "it has no channel".to_owned());
        return Err(unreadable(format!("expected an MCAP file with channels: {reason}")));
    }
    let recovered = copy.finish(lost).map_err(failed)?;
    std::fs::rename(&partial, into).map_err(|error| Error::output(into, error))?;
    Ok(recovered)
}

/// The new file, and the new ids of schemas and channels by the old ones.
struct Copy {
    writer: Writer<BufWriter<File>>,
    schemas: HashMap<u16, u16>,
    channels: HashMap<u16, u16>,
    messages: u64,
    times: Option<(u64, u64)>,
}

impl Copy {
    fn add(&mut self, record: Record) -> McapResult<()> {
        match record {
            Record::Schema { header, data } => {
                let id = self.writer.add_schema(&header.name, &header.encoding, &data)?;
                self.schemas.insert(header.id, id);
            }
            Record::Channel(channel) => {
                let unknown = || McapError::UnknownSchema(channel.topic.clone(), channel.schema_id);
                let schema = *self.schemas.get(&channel.schema_id).ok_or_else(unknown)?;
                let (topic, encoding) = (&channel.topic, &channel.message_encoding);
                let id = self.writer.add_channel(schema, topic, encoding, &channel.metadata)?;
                self.channels.insert(channel.id, id);
            }
            Record::Message { header, data } => {
                let unknown = || McapError::UnknownChannel(header.sequence, header.channel_id);
                let channel_id = *self.channels.get(&header.channel_id).ok_or_else(unknown)?;
                self.writer
                    .write_to_known_channel(&MessageHeader { channel_id, ..header }, &data)?;
                self.messages += 1;
                let time = header.log_time;
                let (first, last) = self.times.unwrap_or((time, time));
                self.times = Some((first.min(time), last.max(time)));
            }
            Record::Attachment { header, data, .. } => self.writer.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            })?,
            Record::Metadata(metadata) => self.writer.write_metadata(&metadata)?,
            // The writer makes indices, statistics and footer of its own.
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self, lost: Option<String>) -> McapResult<Recovered> {
        if let Some(reason) = &lost {
            let metadata = BTreeMap::from([("ended".to_owned(), reason.clone())]);
            self.writer.write_metadata(&Metadata { name: "recovered".to_owned(), metadata })?;
        }
        self.writer.finish()?;
        Ok(Recovered {
            messages: self.messages,
            channels: self.channels.len(),
            seconds: self.times.map_or(0.0, |(first, last)| (last - first) as f64 * 1e-9),
            lost,
        })
    }
}
