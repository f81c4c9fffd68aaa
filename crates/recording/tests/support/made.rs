//! Makes recordings that are to be damaged.
#![allow(dead_code, reason = "each user needs a part")]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::ops::Range;
use std::path::Path;

use diagnostics::SourceFiles;
use mcap::records::{MessageHeader, op};
use mcap::{Compression, WriteOptions};
use rand::RngExt as _;
use rand_pcg::Pcg64;
use recording::view::ReplayView;
use recording::{
    Column, Columns, EventLevel, McapSink, RecordedVariables, Row, RunEvent, RunHeader, Sink as _, ValueKind,
    VariableDirection,
};

pub type TestError = Box<dyn std::error::Error>;

/// Communication step of the made recordings [s].
pub const STEP: f64 = 0.01;

/// Recordings of this program and of others, finished and cut ones.
pub fn all() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder");
    let made = [
        finished(folder.path(), 120),
        killed(folder.path(), 120),
        foreign(folder.path(), Some(Compression::Zstd), 16),
        foreign(folder.path(), None, 64),
        ros(folder.path()),
    ];
    made.map(|recording| recording.expect("it can be made")).to_vec()
}

pub fn value_of(tick: u64, column: usize) -> f64 {
    (tick as f64 * 0.37 + column as f64).sin()
}

/// A recording of this program.
pub fn finished(folder: &Path, ticks: u64) -> Result<Vec<u8>, TestError> {
    let column = |k: usize, node: &str, kind: ValueKind| Column {
        node: node.to_owned(),
        variable: format!("c{k}"),
        direction: VariableDirection::Output,
        kind,
        unit: (k == 0).then(|| "m/s".to_owned()),
        description: None,
    };
    let numbers = (0..12).map(|k| column(k, ["car", "road"][k / 6], ValueKind::Real));
    let columns: Columns<_> = numbers.chain([column(12, "car", ValueKind::String)]).collect();
    made(folder, columns, ticks)
}

/// The description of a run with these columns.
pub fn header(folder: &Path, columns: Columns<RecordedVariables>, step: f64, ticks: u64) -> RunHeader {
    RunHeader {
        scenario: "made".to_owned(),
        title: "A recording to be damaged".to_owned(),
        source: SourceFiles::from_generated(diagnostics::TextFile::new(
            "made.toml",
            "title = \"made\"\n".repeat(40),
        )),
        given: Vec::new(),
        step,
        stop: step * ticks as f64,
        seed: 1,
        columns,
        status_tracks: Vec::new(),
        view: ReplayView::default(),
        folder: folder.to_owned(),
    }
}

/// A recording of these columns.
pub fn made(folder: &Path, columns: Columns<RecordedVariables>, ticks: u64) -> Result<Vec<u8>, TestError> {
    let (numbers, texts) = (columns.number_columns().len(), columns.text_columns().len());
    let header = header(folder, columns, STEP, ticks);
    let mut sink = McapSink::new(&header)?;
    for tick in 0..=ticks {
        let numbers = (0..numbers).map(|column| value_of(tick, column)).collect();
        let time = tick as f64 * STEP;
        sink.push_row(tick, time, &Row::from_values(numbers, vec![format!("row {tick}"); texts]))?;
        if tick % 100 == 50 {
            let (source, message) = ("car".to_owned(), format!("half a second after {time}"));
            sink.push_event(&RunEvent { time, level: EventLevel::Info, source, message, again: 0 })?;
        }
    }
    sink.finish("# All is well", true)?;
    Ok(std::fs::read(folder.join("run.mcap"))?)
}

/// What a killed run leaves: no summary, and at the end a chunk without a length.
fn killed(folder: &Path, ticks: u64) -> Result<Vec<u8>, TestError> {
    let whole = finished(folder, ticks)?;
    let chunks: Vec<_> = records(&whole).filter(|(opcode, _)| *opcode == op::CHUNK).collect();
    let last = chunks.last().ok_or("a chunk")?.1.clone();
    let mut bytes = whole[..last.end - last.len() / 3].to_vec();
    bytes[last.start + 1..last.start + 9].fill(0xff);
    Ok(bytes)
}

/// A recording of another program.
fn foreign(folder: &Path, compression: Option<Compression>, messages: u64) -> Result<Vec<u8>, TestError> {
    let path = folder.join("foreign.mcap");
    let options = WriteOptions::new().compression(compression).chunk_size(Some(700));
    let mut writer = options.create(BufWriter::new(File::create(&path)?))?;
    let channel = writer.add_channel(0, "/x", "json", &BTreeMap::new())?;
    for k in 0..messages {
        let header = MessageHeader {
            channel_id: channel,
            sequence: k as u32,
            log_time: k * 1_000_000,
            publish_time: k,
        };
        let text = format!("{{\"x\":{k},\"y\":\"{}\"}}", "abc".repeat(k as usize % 50));
        writer.write_to_known_channel(&header, text.as_bytes())?;
    }
    writer.finish()?;
    Ok(std::fs::read(path)?)
}

/// A recording of ROS 2: a text, a list and a number with the time of each message.
fn ros(folder: &Path) -> Result<Vec<u8>, TestError> {
    let path = folder.join("ros.mcap");
    let mut writer = WriteOptions::new().compression(None).create(BufWriter::new(File::create(&path)?))?;
    let definition = "std_msgs/Header header\nfloat64[] list\nfloat64 x\n";
    let schema = writer.add_schema("demo/msg/Ros", "ros2msg", definition.as_bytes())?;
    let channel = writer.add_channel(schema, "/ros", "cdr", &BTreeMap::new())?;
    for k in 0..20u32 {
        let mut data = vec![0, 1, 0, 0];
        // Seconds, nanoseconds, a text of 4 bytes, a list of 2 numbers.
        let head: [u32; 6] = [k, 0, 4, u32::from_le_bytes(*b"imu\0"), 2, 0];
        data.extend(head.iter().flat_map(|it| it.to_le_bytes()));
        data.extend([0.5, 1.5, f64::from(k)].iter().flat_map(|it| it.to_le_bytes()));
        let time = u64::from(k) * 1_000_000_000;
        let header = MessageHeader { channel_id: channel, sequence: k, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data)?;
    }
    writer.finish()?;
    Ok(std::fs::read(path)?)
}

/// The opcodes and the places of all records outside of chunks, as far as the file goes.
fn records(bytes: &[u8]) -> impl Iterator<Item = (u8, Range<usize>)> {
    let mut at = mcap::MAGIC.len();
    std::iter::from_fn(move || {
        let length = u64::from_le_bytes(bytes.get(at + 1..at + 9)?.try_into().ok()?);
        let end = usize::try_from(length).ok()?.checked_add(at + 9)?;
        let record = (bytes[at], at..end.min(bytes.len()));
        at = end;
        Some(record)
    })
}

/// A damage that only recordings can have: lengths, and records at other places.
pub fn own(random: &mut Pcg64, bytes: &mut Vec<u8>) {
    let all: Vec<_> = records(bytes).map(|(_, place)| place).collect();
    if all.is_empty() {
        return;
    }
    let record = |random: &mut Pcg64| all[random.random_range(0..all.len())].clone();
    match random.random_range(0..4) {
        0 => lengths(random, bytes, &all),
        1 => {
            let (a, b) = (record(random), record(random));
            swap(bytes, a, b);
        }
        2 => {
            let (from, to) = (record(random), record(random).start);
            let copy = bytes[from].to_vec();
            drop(bytes.splice(to..to, copy));
        }
        _ => {
            // A sector of a disk.
            let (length, start) = (bytes.len(), record(random).start / 512 * 512);
            bytes[start..(start + 512).min(length)].fill(0);
        }
    }
}

/// Puts a hostile number where a length stands: that of a record, or one within.
fn lengths(random: &mut Pcg64, bytes: &mut [u8], records: &[Range<usize>]) {
    const HOSTILE: [u64; 7] = [0, 1, 1 << 31, u32::MAX as u64, 1 << 40, 1 << 63, u64::MAX];
    if records.is_empty() {
        return;
    }
    let start = records[random.random_range(0..records.len())].start;
    let place = start + [1, 9, 13, 25, 29, 37, 41, 44][random.random_range(0..8)];
    if let Some(length) = bytes.get_mut(place..place + 8) {
        length.copy_from_slice(&HOSTILE[random.random_range(0..HOSTILE.len())].to_le_bytes());
    }
}

fn swap(bytes: &mut [u8], a: Range<usize>, b: Range<usize>) {
    let (first, second) = if a.start <= b.start { (a, b) } else { (b, a) };
    if first.end <= second.start && second.end <= bytes.len() {
        let parts = [&bytes[second.clone()], &bytes[first.end..second.start], &bytes[first.clone()]];
        let swapped = parts.concat();
        bytes[first.start..second.end].copy_from_slice(&swapped);
    }
}
