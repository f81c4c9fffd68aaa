//! Writes a run as MCAP: a channel for each side of each node, with protobuf messages of its variables.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io;

use ::mcap::records::MessageHeader;
use diagnostics::Error;
use prost_types::field_descriptor_proto::Type;

use self::chunks::Chunks;
use self::file::McapFile;
use self::foxglove::{FrameTransform, Log};
use self::messages::Channel;
use super::{DerivedColumns, Event, RunHeader, Sink};
use crate::columns::{Column, Direction, ValueKind};
use crate::records::checksum;
use crate::row::{Recorded, Row};
use crate::view::Pose;
use expression::{NumberIndex, TextIndex};

mod chunks;
mod descriptor;
mod file;
mod foxglove;
mod messages;
mod record;
mod tail;

pub(crate) use foxglove::event;

/// The metadata at the start, and that at the end of a complete recording.
pub(crate) const RUN: &str = "run";
const END: &str = "end";
/// The verdict.
pub(crate) const SUMMARY: &str = "summary.md";
/// Media types of the scenario's files, the user's own first, and of the files that they name.
pub(crate) const SCENARIO: &str = "application/toml";
pub(crate) const KEPT: &str = "text/plain";

/// An MCAP file, at any time readable up to its last closed chunk; what comes then is in a tail. It has a thread of its own.
pub struct McapSink {
    chunks: Chunks,
    channels: Vec<Channel>,
    log: u16,
    /// The channel of the moving body's position, if the scenario has a pose, with its last message.
    transform: Option<(u16, Pose, FrameTransform)>,
    sequence: u32,
}

/// The recorded variables of one side of one node, by their indices in the row.
#[derive(Default)]
struct Side {
    numbers: Vec<NumberIndex<Recorded>>,
    texts: Vec<TextIndex<Recorded>>,
}

impl McapSink {
    /// The file that it leaves, and those that a killed run leaves beside it.
    pub const FILES: &[&str] = &["run.mcap", "run.mcap.tail", "run.mcap.tail2"];

    /// Begins the file `run.mcap` of the run's folder.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn new(header: &RunHeader) -> Result<Self, Error> {
        let path = header.folder.join("run.mcap");
        let failed = |error| Error::output(&path, error);
        let library = concat!("trackside ", env!("CARGO_PKG_VERSION"));
        let mut file = McapFile::create(&path, library).map_err(failed)?;
        begin(&mut file, header).map_err(failed)?;
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
            let id = channel(&mut file, (node, word), &numbers.chain(texts).collect::<Vec<_>>())?;
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
            Ok::<_, io::Error>(Channel::new(id, numbers, integers, texts))
        });
        let channels = channels.collect::<io::Result<Vec<_>>>().map_err(failed)?;
        let mut well_known = |topic, name, descriptor: Vec<u8>| {
            file.add_channel(topic, (name, &descriptor), &BTreeMap::new()).map_err(failed)
        };
        let log = well_known("/log", "foxglove.Log", foxglove::log_schema())?;
        let transform = header.view.pose.as_ref().map(|pose| {
            let id = well_known("/tf", "foxglove.FrameTransform", foxglove::transform_schema())?;
            Ok::<_, Error>((id, pose.clone(), FrameTransform::default()))
        });
        let transform = transform.transpose()?;
        file.define().map_err(failed)?;
        Ok(McapSink { chunks: Chunks::new(&path, file), channels, log, transform, sequence: 0 })
    }
}

fn append(message: &impl prost::Message, to: &mut Vec<u8>) {
    // It fails where there is no room, and a vector makes room.
    let _ = message.encode(to);
}

/// The header of a message at a time [s].
fn head(channel_id: u16, sequence: u32, time: f64) -> MessageHeader {
    let log_time = nanoseconds(time);
    MessageHeader { channel_id, sequence, log_time, publish_time: log_time }
}

impl Sink for McapSink {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        self.sequence = tick as u32;
        // Nothing to write of a row: then the run is not to wait for it either.
        if self.channels.is_empty() && self.transform.is_none() {
            return Ok(());
        }
        let mut open = self.chunks.open()?;
        for channel in &self.channels {
            let head = head(channel.id, self.sequence, time);
            open.add(|to| channel.add(&head, row, to));
        }
        if let Some((id, pose, transform)) = &mut self.transform {
            let [x, y, heading] = [pose.x, pose.y, pose.heading].map(|index| row[index]);
            transform.place_car(time, [x, y], heading);
            let head = head(*id, self.sequence, time);
            open.add(|to| messages::add(&head, |to| append(transform, to), to));
        }
        open.end_row(time)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        let head = head(self.log, self.sequence, event.time);
        let mut open = self.chunks.open()?;
        open.add(|to| messages::add(&head, |to| append(&Log::from(event), to), to));
        open.save()
    }

    fn derived(&mut self, derived: &DerivedColumns) -> Result<(), Error> {
        let columns: Vec<_> = derived.columns().collect();
        let fields: Vec<_> = columns.iter().collect();
        let belongs = (derived.analysis, derived.group);
        let id = self.chunks.close(|file| {
            let id = channel(file, belongs, &fields)?;
            file.define().map(|()| id)
        })?;
        let fields: Vec<_> = descriptor::numbers().take(fields.len()).collect();
        for (row, time) in derived.time.iter().enumerate() {
            let data = |to: &mut Vec<u8>| {
                for (field, column) in fields.iter().zip(derived.columns) {
                    messages::add_tag(*field, to);
                    to.extend_from_slice(&column.values[row].to_le_bytes());
                }
            };
            let head = head(id, self.sequence, *time);
            self.chunks.open()?.add(|to| messages::add(&head, data, to));
        }
        Ok(())
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.chunks.close(|file| {
            metadata(file, END, [("completed", completed.to_string())])?;
            file.attach(SUMMARY, "text/markdown", summary.as_bytes())?;
            file.finish()
        })?;
        self.chunks.remove_tails();
        Ok(())
    }
}

/// Writes the description of the run first: a killed run leaves it, too.
fn begin(file: &mut McapFile, header: &RunHeader) -> io::Result<()> {
    let entries = [
        ("scenario", header.scenario.clone()),
        ("title", header.title.clone()),
        ("step", format!("{}", header.step)),
        ("stop", format!("{}", header.stop)),
        ("seed", header.seed.to_string()),
        ("set", header.given.join("\n")),
        ("trackside", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    metadata(file, RUN, entries)?;
    let [scenario, kept] = header.source.recorded_files();
    let scenario = scenario.iter().map(|it| (it, SCENARIO));
    for (it, media_type) in scenario.chain(kept.iter().map(|it| (it, KEPT))) {
        file.attach(&it.path.display().to_string(), media_type, it.text.as_bytes())?;
    }
    Ok(())
}

fn metadata<const N: usize>(
    file: &mut McapFile,
    name: &str,
    entries: [(&str, String); N],
) -> io::Result<()> {
    let mut metadata: BTreeMap<_, _> =
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    // MCAP has no checksum for metadata until the file is complete.
    metadata.extend([checksum(name, &metadata)]);
    file.write_metadata(name, &metadata)
}

/// The recording's clock is the simulated time, from 0 on.
fn nanoseconds(time: f64) -> u64 {
    (time * 1e9).round() as u64
}

/// Adds a channel with a field for each column, and returns its id.
fn channel(file: &mut McapFile, (node, word): (&str, &str), fields: &[&Column]) -> io::Result<u16> {
    let names = field_names(fields);
    let message = format!("{}_{}", identifier(node), identifier(word));
    let kind = |column: &Column| match column.kind {
        ValueKind::String => Type::String,
        ValueKind::Int64 => Type::Int64,
        ValueKind::UInt64 => Type::Uint64,
        ValueKind::Real | ValueKind::Integer | ValueKind::Boolean => Type::Double,
    };
    let typed = names.iter().zip(fields).map(|(name, column)| (name.as_str(), kind(column)));
    let descriptor = descriptor::schema("trackside", &message, &typed.collect::<Vec<_>>());
    let mut metadata = BTreeMap::new();
    for (field, column) in names.iter().zip(fields) {
        metadata.insert(format!("fmi:{field}"), column.variable.clone());
        metadata.insert(format!("unit:{field}"), column.unit.clone().unwrap_or_default());
        // Integers and booleans are written as doubles.
        if matches!(column.kind, ValueKind::Integer | ValueKind::Boolean) {
            metadata.insert(format!("type:{field}"), format!("{:?}", column.kind));
        }
    }
    let schema = (format!("trackside.{message}"), descriptor);
    file.add_channel(&format!("/{node}/{word}"), (&schema.0, &schema.1), &metadata)
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
