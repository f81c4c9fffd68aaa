//! Writes a run as MCAP: a channel for each side of each node, with protobuf messages of its variables.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io;

use ::mcap::records::MessageHeader;
use diagnostics::Error;
use prost_types::field_descriptor_proto::Type;

use self::chunks::ChunkWriter;
use self::file::McapFile;
use self::foxglove::{FoxgloveLog, FrameTransform};
use self::messages::ChannelEncoder;
use super::{AnalysisColumns, RunEvent, RunHeader, Sink};
use crate::columns::{Column, ValueKind, VariableDirection};
use crate::records::metadata_checksum_entry;
use crate::row::{RecordedVariables, Row};
use crate::view::PoseColumns;
use expression::{NumberIndex, TextIndex};

mod chunks;
mod descriptor;
mod file;
mod foxglove;
mod messages;
mod record;
mod tail;

pub(crate) use foxglove::decode_log_event;

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
    chunks: ChunkWriter,
    channels: Vec<ChannelEncoder>,
    log: u16,
    /// The channel of the moving body's position, if the scenario has a pose, with its last message.
    transform: Option<(u16, PoseColumns, FrameTransform)>,
    sequence: u32,
}

/// The recorded variables of one side of one node, by their indices in the row.
#[derive(Default)]
struct NodeSideColumns {
    numbers: Vec<NumberIndex<RecordedVariables>>,
    texts: Vec<TextIndex<RecordedVariables>>,
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
        let failed = |error| Error::output_failure(&path, error);
        let library = concat!("trackside ", env!("CARGO_PKG_VERSION"));
        let mut file = McapFile::create(&path, library).map_err(failed)?;
        write_run_description(&mut file, header).map_err(failed)?;
        let mut sides: BTreeMap<(&str, VariableDirection), NodeSideColumns> = BTreeMap::new();
        for (index, column) in header.columns.number_columns() {
            sides.entry((&column.node, column.direction)).or_default().numbers.push(index);
        }
        for (index, column) in header.columns.text_columns() {
            sides.entry((&column.node, column.direction)).or_default().texts.push(index);
        }
        let channels = sides.into_iter().map(|((node, direction), side)| {
            let word = match direction {
                VariableDirection::Input => "inputs",
                VariableDirection::Output => "outputs",
            };
            let numbers = side.numbers.iter().map(|&index| &header.columns[index]);
            let texts = side.texts.iter().map(|&index| &header.columns[index]);
            let id = add_node_channel(&mut file, node, word, &numbers.chain(texts).collect::<Vec<_>>())?;
            let mut fields = descriptor::field_numbers();
            let numbers: Vec<_> = side.numbers.into_iter().zip(fields.by_ref()).collect();
            let texts = side.texts.into_iter().zip(fields).collect();
            let exact = |(index, field): &(NumberIndex<RecordedVariables>, u32)| {
                Some((header.columns.integer_index_of(*index)?, *field))
            };
            let integers = numbers.iter().filter_map(exact).collect();
            let plain = |(index, _): &(NumberIndex<RecordedVariables>, u32)| {
                !header.columns[*index].kind.is_64_bit_integer()
            };
            let numbers = numbers.into_iter().filter(plain);
            Ok::<_, io::Error>(ChannelEncoder::new(id, numbers, integers, texts))
        });
        let channels = channels.collect::<io::Result<Vec<_>>>().map_err(failed)?;
        let mut well_known = |topic, name, descriptor: Vec<u8>| {
            file.add_channel(topic, name, &descriptor, &BTreeMap::new()).map_err(failed)
        };
        let log = well_known("/log", "foxglove.Log", foxglove::log_schema())?;
        let transform = header.view.pose.as_ref().map(|pose| {
            let id = well_known("/tf", "foxglove.FrameTransform", foxglove::transform_schema())?;
            Ok::<_, Error>((id, pose.clone(), FrameTransform::default()))
        });
        let transform = transform.transpose()?;
        file.write_channel_definitions().map_err(failed)?;
        Ok(McapSink { chunks: ChunkWriter::new(&path, file), channels, log, transform, sequence: 0 })
    }
}

fn append_protobuf(message: &impl prost::Message, to: &mut Vec<u8>) {
    // It fails where there is no room, and a vector makes room.
    let _ = message.encode(to);
}

/// The header of a message at a time [s].
fn message_header(channel_id: u16, sequence: u32, time: f64) -> MessageHeader {
    let log_time = seconds_to_nanoseconds(time);
    MessageHeader { channel_id, sequence, log_time, publish_time: log_time }
}

impl Sink for McapSink {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        self.sequence = tick as u32;
        // Nothing to write of a row: then the run is not to wait for it either.
        if self.channels.is_empty() && self.transform.is_none() {
            return Ok(());
        }
        let mut open = self.chunks.open_chunk()?;
        for channel in &self.channels {
            let head = message_header(channel.id, self.sequence, time);
            open.append_message(|to| channel.append_row_message(&head, row, to));
        }
        if let Some((id, pose, transform)) = &mut self.transform {
            let [x, y, heading] = [pose.x, pose.y, pose.heading].map(|index| row[index]);
            transform.set_car_pose(time, [x, y], heading);
            let head = message_header(*id, self.sequence, time);
            open.append_message(|to| {
                messages::append_message_record(&head, |to| append_protobuf(transform, to), to)
            });
        }
        open.end_row(time)
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        let head = message_header(self.log, self.sequence, event.time);
        let mut open = self.chunks.open_chunk()?;
        open.append_message(|to| {
            messages::append_message_record(&head, |to| append_protobuf(&FoxgloveLog::from(event), to), to)
        });
        open.save_to_tail_file()
    }

    fn push_derived_columns(&mut self, derived: &AnalysisColumns) -> Result<(), Error> {
        let columns: Vec<_> = derived.columns().collect();
        let fields: Vec<_> = columns.iter().collect();
        let id = self.chunks.close_chunk_and_write(|file| {
            let id = add_node_channel(file, derived.analysis, derived.group, &fields)?;
            file.write_channel_definitions().map(|()| id)
        })?;
        let fields: Vec<_> = descriptor::field_numbers().take(fields.len()).collect();
        for (row, time) in derived.time.iter().enumerate() {
            let data = |to: &mut Vec<u8>| {
                for (field, column) in fields.iter().zip(derived.columns) {
                    messages::append_fixed64_tag(*field, to);
                    to.extend_from_slice(&column.values[row].to_le_bytes());
                }
            };
            let head = message_header(id, self.sequence, *time);
            self.chunks.open_chunk()?.append_message(|to| messages::append_message_record(&head, data, to));
        }
        Ok(())
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.chunks.close_chunk_and_write(|file| {
            write_metadata_entries(file, END, [("completed", completed.to_string())])?;
            file.write_attachment(SUMMARY, "text/markdown", summary.as_bytes())?;
            file.finish()
        })?;
        self.chunks.remove_tails();
        Ok(())
    }
}

/// Writes the description of the run first: a killed run leaves it, too.
fn write_run_description(file: &mut McapFile, header: &RunHeader) -> io::Result<()> {
    let entries = [
        ("scenario", header.scenario.clone()),
        ("title", header.title.clone()),
        ("step", format!("{}", header.step)),
        ("stop", format!("{}", header.stop)),
        ("seed", header.seed.to_string()),
        ("set", header.given.join("\n")),
        ("trackside", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    write_metadata_entries(file, RUN, entries)?;
    let [scenario, kept] = header.source.files_for_recording();
    let scenario = scenario.iter().map(|it| (it, SCENARIO));
    for (it, media_type) in scenario.chain(kept.iter().map(|it| (it, KEPT))) {
        file.write_attachment(&it.path.display().to_string(), media_type, it.text.as_bytes())?;
    }
    Ok(())
}

fn write_metadata_entries<const N: usize>(
    file: &mut McapFile,
    name: &str,
    entries: [(&str, String); N],
) -> io::Result<()> {
    let mut metadata: BTreeMap<_, _> =
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    // MCAP has no checksum for metadata until the file is complete.
    metadata.extend([metadata_checksum_entry(name, &metadata)]);
    file.write_metadata(name, &metadata)
}

/// The recording's clock is the simulated time, from 0 on.
fn seconds_to_nanoseconds(time: f64) -> u64 {
    (time * 1e9).round() as u64
}

/// Adds a channel with a field for each column, and returns its id.
fn add_node_channel(file: &mut McapFile, node: &str, word: &str, fields: &[&Column]) -> io::Result<u16> {
    let names = field_names(fields);
    let message = format!("{}_{}", protobuf_identifier(node), protobuf_identifier(word));
    let kind = |column: &Column| match column.kind {
        ValueKind::String => Type::String,
        ValueKind::Int64 => Type::Int64,
        ValueKind::UInt64 => Type::Uint64,
        ValueKind::Real | ValueKind::Integer | ValueKind::Boolean => Type::Double,
    };
    let typed = names.iter().zip(fields).map(|(name, column)| (name.as_str(), kind(column)));
    let descriptor = descriptor::encode_message_schema("trackside", &message, &typed.collect::<Vec<_>>());
    let mut metadata = BTreeMap::new();
    for (field, column) in names.iter().zip(fields) {
        metadata.insert(format!("fmi:{field}"), column.variable.clone());
        metadata.insert(format!("unit:{field}"), column.unit.clone().unwrap_or_default());
        // Integers and booleans are written as doubles.
        if matches!(column.kind, ValueKind::Integer | ValueKind::Boolean) {
            metadata.insert(format!("type:{field}"), format!("{:?}", column.kind));
        }
    }
    file.add_channel(&format!("/{node}/{word}"), &format!("trackside.{message}"), &descriptor, &metadata)
}

/// The names of the fields: different identifiers of protobuf.
fn field_names(columns: &[&Column]) -> Vec<String> {
    let mut taken = HashSet::new();
    // The last number that was added to an identifier: trying all of them again takes too long with thousands of columns.
    let mut last: HashMap<String, u32> = HashMap::new();
    let unique = |column: &&Column| {
        let wanted = protobuf_identifier(&column.variable);
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

fn protobuf_identifier(name: &str) -> String {
    let letters = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let name: String = letters.collect();
    if name.starts_with(|first: char| first.is_ascii_alphabetic()) { name } else { format!("v_{name}") }
}
