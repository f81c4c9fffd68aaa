//! Writes a run as MCAP: a channel for each side of each node, with protobuf messages of its variables.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use ::mcap::records::MessageHeader;
use ::mcap::write::Metadata;
use ::mcap::{Attachment, Compression, WriteOptions, Writer};
use diagnostics::Error;
use prost::Message as _;
use prost_types::field_descriptor_proto::Type;

use self::foxglove::{FrameTransform, Log};
use self::tail::Tail;
use super::{Derived, Event, RunHeader, Sink};
use crate::columns::{Column, Direction, ValueKind};
use crate::records::{checksum, plainly};
use crate::row::{Recorded, Row};
use expression::{IntegerIndex, NumberIndex, TextIndex};

mod descriptor;
mod foxglove;
mod tail;

pub(crate) use foxglove::event;

/// A message closes its chunk at this size [B]. Chunks thus stay below 256 KiB, which bounds the memory of a reader.
const CHUNK: usize = 240 << 10;
/// Chunks are closed before they hold more than this simulated time [s]: with the rows that wait for the thread of the recording a
/// killed run loses twice as much.
const FLUSH_EVERY: f64 = 0.5;

/// The metadata at the start, and that at the end of a complete recording.
pub(crate) const RUN: &str = "run";
const END: &str = "end";
/// The verdict.
pub(crate) const SUMMARY: &str = "summary.md";
/// Media types of the scenario's files, the user's own first, and of the files that they name.
pub(crate) const SCENARIO: &str = "application/toml";
pub(crate) const KEPT: &str = "text/plain";

/// An MCAP file, at any time readable up to its last closed chunk.
pub struct McapSink {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    channels: Vec<Channel>,
    log: u16,
    /// The channel of the moving body's position, if the scenario has a pose.
    transform: Option<u16>,
    header: RunHeader,
    /// The times of the last whole row, and of the last one in a closed chunk [s].
    last: f64,
    saved: f64,
    sequence: u32,
    message: Vec<u8>,
    tail: Tail,
}

/// A channel: one side of one node.
struct Channel {
    id: u16,
    /// Numbers, each with the bytes that protobuf writes before it.
    numbers: Vec<(NumberIndex<Recorded>, Vec<u8>)>,
    /// Texts, each with the number of its field.
    texts: Vec<(TextIndex<Recorded>, u32)>,
    /// Integers of 64 bits, each with the number of its field.
    integers: Vec<(IntegerIndex<Recorded>, u32)>,
}

/// The recorded variables of one side of one node, by their indices in the row.
#[derive(Default)]
struct Side {
    numbers: Vec<NumberIndex<Recorded>>,
    texts: Vec<TextIndex<Recorded>>,
}

impl McapSink {
    /// The file that it leaves, and those that a killed run leaves beside it.
    pub const FILES: &[&str] = &["run.mcap", "run.mcap.tail", "run.mcap.tail.partial"];

    /// Begins the file `run.mcap` of the run's folder.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn new(header: &RunHeader) -> Result<Self, Error> {
        let path = header.folder.join("run.mcap");
        let file = File::create(&path).map_err(|error| Error::output(&path, error))?;
        let options = WriteOptions::new()
            .profile("")
            .library(concat!("trackside ", env!("CARGO_PKG_VERSION")))
            // The sink closes them, because it keeps what is in the open one.
            .chunk_size(None)
            .compression(Some(Compression::Lz4));
        let mut writer =
            options.create(BufWriter::new(file)).map_err(|error| failed(&path, error))?;
        begin(&mut writer, header).map_err(|error| failed(&path, error))?;
        let mut sides: BTreeMap<(&str, Direction), Side> = BTreeMap::new();
        for (index, column) in header.columns.numbers() {
            sides.entry((&column.node, column.direction)).or_default().numbers.push(index);
        }
        for (index, column) in header.columns.texts() {
            sides.entry((&column.node, column.direction)).or_default().texts.push(index);
        }
        let channels = sides.into_iter().map(|((node, direction), side)| {
            let word = match direction {
                Direction::Input => "inputs",
                Direction::Output => "outputs",
            };
            let numbers = side.numbers.iter().map(|&index| &header.columns[index]);
            let texts = side.texts.iter().map(|&index| &header.columns[index]);
            let id = channel(&mut writer, (node, word), &numbers.chain(texts).collect::<Vec<_>>())?;
            let mut fields = descriptor::numbers();
            let numbers: Vec<_> = side.numbers.into_iter().zip(fields.by_ref()).collect();
            let texts = side.texts.into_iter().zip(fields).collect();
            let exact = |(index, field): &(NumberIndex<Recorded>, u32)| {
                Some((header.columns.integer(*index)?, *field))
            };
            let integers = numbers.iter().filter_map(exact).collect();
            let plain =
                |(index, _): &(NumberIndex<Recorded>, u32)| !header.columns[*index].kind.is_exact();
            let numbers = numbers.into_iter().filter(plain);
            let numbers = numbers.map(|(index, field)| (index, tag(field))).collect();
            Ok::<_, ::mcap::McapError>(Channel { id, numbers, texts, integers })
        });
        let channels =
            channels.collect::<Result<Vec<_>, _>>().map_err(|error| failed(&path, error))?;
        let mut well_known = |topic, name, schema: Vec<u8>| {
            let schema = writer.add_schema(name, "protobuf", &schema)?;
            writer.add_channel(schema, topic, "protobuf", &BTreeMap::new())
        };
        let log = well_known("/log", "foxglove.Log", foxglove::log_schema());
        let log = log.map_err(|error| failed(&path, error))?;
        let transform =
            header.view.pose.as_ref().map(|_| {
                well_known("/tf", "foxglove.FrameTransform", foxglove::transform_schema())
            });
        let transform = transform.transpose().map_err(|error| failed(&path, error))?;
        // In a chunk of its own: whatever happens to the rest, all channels stay known.
        writer.flush().map_err(|error| failed(&path, error))?;
        Ok(McapSink {
            tail: Tail::beside(&path),
            path,
            writer,
            channels,
            log,
            transform,
            header: header.clone(),
            last: f64::NEG_INFINITY,
            saved: f64::NEG_INFINITY,
            sequence: 0,
            message: Vec::new(),
        })
    }

    fn write(&mut self, channel_id: u16, time: f64) -> Result<(), Error> {
        if self.tail.size() > CHUNK {
            self.close_chunk()?;
        }
        let log_time = nanoseconds(time);
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.tail.add(&header, &self.message);
        let written = self.writer.write_to_known_channel(&header, &self.message);
        written.map_err(|error| failed(&self.path, error))
    }

    fn close_chunk(&mut self) -> Result<(), Error> {
        self.writer.flush().map_err(|error| failed(&self.path, error))?;
        self.tail.clear();
        self.saved = self.last;
        Ok(())
    }

    fn close(&mut self, summary: &str, completed: bool) -> Result<(), ::mcap::McapError> {
        metadata(&mut self.writer, END, [("completed", completed.to_string())])?;
        attach(&mut self.writer, SUMMARY, "text/markdown", summary)?;
        self.writer.finish().map(|_| ())
    }
}

impl Sink for McapSink {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        self.sequence = tick as u32;
        for index in 0..self.channels.len() {
            let channel = &self.channels[index];
            self.message.clear();
            for (number, tag) in &channel.numbers {
                self.message.extend_from_slice(tag);
                self.message.extend_from_slice(&row[*number].to_le_bytes());
            }
            for (integer, field) in &channel.integers {
                // Two's complement of 64 bits is the same varint for both types.
                prost::encoding::uint64::encode(*field, &(row[*integer] as u64), &mut self.message);
            }
            for (text, field) in &channel.texts {
                prost::encoding::string::encode(*field, &row[*text], &mut self.message);
            }
            self.write(self.channels[index].id, time)?;
        }
        if let (Some(channel), Some(pose)) = (self.transform, &self.header.view.pose) {
            let [x, y, heading] = [pose.x, pose.y, pose.heading].map(|index| row[index]);
            self.message = FrameTransform::of_car(time, [x, y], heading).encode_to_vec();
            self.write(channel, time)?;
        }
        self.last = time;
        // Half a step beside the edge, where rounding would decide.
        if time + 0.5 * self.header.step >= self.saved + FLUSH_EVERY {
            self.close_chunk()?;
        }
        Ok(())
    }

    /// Without columns there is nothing to write of a row.
    fn takes_rows(&self) -> bool {
        !self.channels.is_empty() || self.transform.is_some()
    }

    fn save(&mut self) -> Result<(), Error> {
        self.tail.save()
    }

    fn saved(&self) -> f64 {
        self.saved
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.message = Log::from(event).encode_to_vec();
        self.write(self.log, event.time)
    }

    fn derived(&mut self, derived: &Derived) -> Result<(), Error> {
        let columns: Vec<_> = derived.columns().collect();
        let fields: Vec<_> = columns.iter().collect();
        let id = channel(&mut self.writer, (derived.analysis, derived.group), &fields)
            .map_err(|error| failed(&self.path, error))?;
        let tags: Vec<_> = descriptor::numbers().take(fields.len()).map(tag).collect();
        for (row, time) in derived.time.iter().enumerate() {
            self.message.clear();
            for (tag, column) in tags.iter().zip(derived.columns) {
                self.message.extend_from_slice(tag);
                self.message.extend_from_slice(&column.values[row].to_le_bytes());
            }
            self.write(id, *time)?;
        }
        Ok(())
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.close(summary, completed).map_err(|error| failed(&self.path, error))?;
        self.tail.remove();
        Ok(())
    }
}

/// The error of a recording that cannot be written.
fn failed(path: &Path, error: ::mcap::McapError) -> Error {
    Error::output(path, plainly(error))
}

/// Writes the description of the run first: a killed run leaves it, too.
fn begin(writer: &mut Writer<BufWriter<File>>, header: &RunHeader) -> ::mcap::McapResult<()> {
    let entries = [
        ("scenario", header.scenario.clone()),
        ("title", header.title.clone()),
        ("step", format!("{}", header.step)),
        ("stop", format!("{}", header.stop)),
        ("seed", header.seed.to_string()),
        ("set", header.given.join("\n")),
        ("trackside", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    metadata(writer, RUN, entries)?;
    let [scenario, kept] = header.source.to_keep();
    let scenario = scenario.iter().map(|file| (file, SCENARIO));
    for (file, media_type) in scenario.chain(kept.iter().map(|file| (file, KEPT))) {
        attach(writer, &file.path.display().to_string(), media_type, &file.text)?;
    }
    Ok(())
}

fn metadata<const N: usize>(
    writer: &mut Writer<BufWriter<File>>,
    name: &str,
    entries: [(&str, String); N],
) -> ::mcap::McapResult<()> {
    let mut metadata: BTreeMap<_, _> =
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    // MCAP has no checksum for metadata until the file is complete.
    metadata.extend([checksum(name, &metadata)]);
    writer.write_metadata(&Metadata { name: name.to_owned(), metadata })
}

fn attach(
    writer: &mut Writer<BufWriter<File>>,
    name: &str,
    media_type: &str,
    text: &str,
) -> ::mcap::McapResult<()> {
    writer.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: name.to_owned(),
        media_type: media_type.to_owned(),
        data: text.as_bytes().into(),
    })
}

/// The recording's clock is the simulated time, from 0 on.
fn nanoseconds(time: f64) -> u64 {
    (time * 1e9).round() as u64
}

/// Adds a channel with a field for each column, and returns its id.
fn channel(
    writer: &mut Writer<BufWriter<File>>,
    (node, word): (&str, &str),
    fields: &[&Column],
) -> ::mcap::McapResult<u16> {
    let names = field_names(fields);
    let message = format!("{}_{}", identifier(node), identifier(word));
    let kind = |column: &Column| match column.kind {
        ValueKind::String => Type::String,
        ValueKind::Int64 => Type::Int64,
        ValueKind::UInt64 => Type::Uint64,
        ValueKind::Real | ValueKind::Integer | ValueKind::Boolean => Type::Double,
    };
    let typed = names.iter().zip(fields).map(|(name, column)| (name.as_str(), kind(column)));
    let schema = descriptor::schema("trackside", &message, &typed.collect::<Vec<_>>());
    let schema = writer.add_schema(&format!("trackside.{message}"), "protobuf", &schema)?;
    let mut metadata = BTreeMap::new();
    for (field, column) in names.iter().zip(fields) {
        metadata.insert(format!("fmi:{field}"), column.variable.clone());
        metadata.insert(format!("unit:{field}"), column.unit.clone().unwrap_or_default());
        // Integers and booleans are written as doubles.
        if matches!(column.kind, ValueKind::Integer | ValueKind::Boolean) {
            metadata.insert(format!("type:{field}"), format!("{:?}", column.kind));
        }
    }
    writer.add_channel(schema, &format!("/{node}/{word}"), "protobuf", &metadata)
}

/// The key of a field of 64 bits (wire type 1).
fn tag(number: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    prost::encoding::encode_key(number, prost::encoding::WireType::SixtyFourBit, &mut bytes);
    bytes
}

/// The names of the fields: different identifiers of protobuf.
fn field_names(columns: &[&Column]) -> Vec<String> {
    let mut taken = HashSet::new();
    // The last number that was added to an identifier: trying all of them again takes too long with thousands of columns.
    let mut last: HashMap<String, u32> = HashMap::new();
    let unique = |column: &&Column| {
        let wanted = identifier(&column.variable);
        let mut name = wanted.clone();
        // `a.b` and `a_b` become the same identifier.
        while !taken.insert(name.clone()) {
            let number = last.entry(wanted.clone()).or_insert(1);
            *number += 1;
            name = format!("{wanted}_{number}");
        }
        name
    };
    columns.iter().map(unique).collect()
}

fn identifier(name: &str) -> String {
    let letters = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let name: String = letters.collect();
    if name.starts_with(|first: char| first.is_ascii_alphabetic()) {
        name
    } else {
        format!("v_{name}")
    }
}
