//! Damages recordings at random, recovers and reads them, and counts what became of them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufWriter;
use std::ops::Range;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use diagnostics::Source;
use mcap::records::{MessageHeader, Record, op};
use mcap::{Compression, WriteOptions};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use recording::recover::recover;
use recording::table::{Table, Wanted};
use recording::view::View;
use recording::{
    Column, Columns, Direction, Event, Golden, Level, McapSink, Recorded, Row, RunHeader,
    Sink as _, ValueKind,
};

pub type Failed = Box<dyn std::error::Error>;

/// A message: its topic, its number, its times and its content.
type Message = (String, u32, u64, u64, Vec<u8>);

/// Everything that a recording holds. Of a message that is there twice each one counts.
#[derive(Default)]
struct Contents {
    messages: BTreeMap<Message, u64>,
    /// Channels with their schemas and metadata, other metadata, and attachments.
    others: BTreeSet<String>,
    count: u64,
}

/// A sound recording.
struct Sound {
    bytes: Vec<u8>,
    contents: Contents,
}

/// What became of damaged recordings.
#[derive(Debug, Default)]
pub struct Tally {
    pub panics: u64,
    /// Recovered ones with anything that the sound ones had not.
    pub wrong: u64,
    /// Recovered ones without all messages.
    pub rescued: u64,
    /// Recovered ones with all messages.
    pub complete: u64,
    /// Nothing was found in these.
    pub refused: u64,
    /// Messages that were there, and those that were saved.
    pub messages: [u64; 2],
    /// Damaged recordings that a reader took as sound, with the numbers of the sound one or with others.
    pub believed: [u64; 2],
}

/// Tries so many damaged recordings, made of these files and of some more; keeps those that fail in the folder `keep`.
///
/// # Errors
/// When a file cannot be read or written.
pub fn try_damaged(count: u64, seed: u64, files: &[PathBuf], keep: &Path) -> Result<Tally, Failed> {
    let folder = tempfile::tempdir()?;
    let mut sound = vec![
        finished(folder.path(), 400)?,
        killed(folder.path(), 400)?,
        foreign(folder.path(), Some(Compression::Zstd), 16)?,
        foreign(folder.path(), None, 64)?,
    ];
    sound.extend(files.iter().map(std::fs::read).collect::<Result<Vec<_>, _>>()?);
    let whole = |bytes: Vec<u8>| Ok::<_, Failed>(Sound { contents: contents(&bytes)?, bytes });
    let sound: Vec<_> = sound.into_iter().map(whole).collect::<Result<_, _>>()?;
    let (broken, into) = (folder.path().join("broken.mcap"), folder.path().join("new.mcap"));
    let mut tally = Tally::default();
    for case in 0..count {
        let mut random = Pcg64::seed_from_u64(seed.wrapping_add(case));
        let chosen = &sound[random.random_range(0..sound.len())];
        let damaged = damage(&mut random, &chosen.bytes);
        std::fs::write(&broken, &damaged)?;
        let before = (tally.panics, tally.wrong, tally.believed[1]);
        try_recovery(chosen, &broken, &into, &mut tally);
        try_reading(chosen, &broken, &mut tally);
        if before != (tally.panics, tally.wrong, tally.believed[1]) {
            let kept = keep.join(format!("damaged_{}.mcap", seed + case));
            std::fs::write(&kept, &damaged)?;
            println!("case {case}: kept as {}", kept.display());
        }
    }
    Ok(tally)
}

fn try_recovery(sound: &Sound, broken: &Path, into: &Path, tally: &mut Tally) {
    let _ = std::fs::remove_file(into);
    tally.messages[0] += sound.contents.count;
    match catch_unwind(|| recover(broken, into, false)) {
        Err(_) => tally.panics += 1,
        Ok(Err(_)) => tally.refused += 1,
        Ok(Ok(found)) => {
            let new = std::fs::read(into).map_err(Failed::from).and_then(|it| contents(&it));
            match new {
                Ok(new) if is_part(&new, &sound.contents) && new.count == found.messages => {
                    tally.messages[1] += new.count;
                    let whole = new.count == sound.contents.count;
                    *(if whole { &mut tally.complete } else { &mut tally.rescued }) += 1;
                }
                Ok(new) => {
                    tally.wrong += 1;
                    let added: Vec<_> = new.others.difference(&sound.contents.others).collect();
                    let held = &sound.contents.messages;
                    let more = |(it, count): &(&Message, &u64)| held.get(*it) < Some(*count);
                    let more = new.messages.iter().filter(more).count();
                    println!(
                        "{more} messages and {added:?} are new, {} of {}",
                        new.count, found.messages
                    );
                }
                Err(error) => {
                    tally.wrong += 1;
                    println!("the new recording cannot be read: {error}");
                }
            }
        }
    }
}

/// Plays a column of the damaged recording back, and compares each number with its time.
fn try_reading(sound: &Sound, broken: &Path, tally: &mut Tally) {
    let outcome = catch_unwind(|| {
        let _ = Golden::read(broken, &[]);
        let wanted = Wanted { time: None, ..Wanted::plain("", &["car.c0"]) };
        let mut table = Table::read(broken, &wanted).ok()?;
        // Times of the file's own clock: its first row may be lost.
        table.set_origin(Some(0.0));
        Some(
            table.times()[0]
                .iter()
                .copied()
                .zip(table.column(0).iter().copied())
                .collect::<Vec<_>>(),
        )
    });
    let Ok(outcome) = outcome else {
        tally.panics += 1;
        return;
    };
    let Some(rows) =
        outcome.filter(|_| sound.contents.others.iter().any(|it| it.contains("fmi:c0")))
    else {
        return;
    };
    let right =
        rows.iter().all(|(time, value)| *value == value_of((time / STEP).round() as u64, 0));
    tally.believed[usize::from(!right)] += 1;
}

fn is_part(new: &Contents, of: &Contents) -> bool {
    let messages = new.messages.iter().all(|(it, count)| of.messages.get(it) >= Some(count));
    messages && new.others.is_subset(&of.others)
}

/// Reads a sound recording with the crate `mcap` alone.
fn contents(bytes: &[u8]) -> Result<Contents, Failed> {
    let options = mcap::read::Options::IgnoreEndMagic | mcap::read::Options::ValidateChunkCrcs;
    let (mut found, mut schemas, mut topics) =
        (Contents::default(), BTreeMap::new(), BTreeMap::new());
    for record in mcap::read::ChunkFlattener::new_with_options(bytes, options)? {
        // A recording of a killed run ends within a record.
        let Ok(record) = record else { break };
        match record {
            Record::Schema { header, data } => {
                schemas.insert(header.id, format!("{header:?} {data:?}"));
            }
            Record::Channel(channel) => {
                let schema = schemas.get(&channel.schema_id);
                found.others.insert(format!("{channel:?} {schema:?}"));
                topics.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => {
                let MessageHeader { channel_id, sequence, log_time, publish_time } = header;
                let topic = topics.get(&channel_id).cloned().unwrap_or_default();
                let message = (topic, sequence, log_time, publish_time, data.into_owned());
                *found.messages.entry(message).or_default() += 1;
                found.count += 1;
            }
            Record::Attachment { header, data, .. } => {
                found.others.insert(format!("{header:?} {data:?}"));
            }
            Record::Metadata(metadata) if metadata.name != "recovered" => {
                found.others.insert(format!("{metadata:?}"));
            }
            _ => {}
        }
    }
    Ok(found)
}

/// Communication step of the made recordings [s].
const STEP: f64 = 0.01;

pub fn value_of(tick: u64, column: usize) -> f64 {
    (tick as f64 * 0.37 + column as f64).sin()
}

/// A recording of this program.
fn finished(folder: &Path, ticks: u64) -> Result<Vec<u8>, Failed> {
    let column = |k: usize, node: &str, kind: ValueKind| Column {
        node: node.to_owned(),
        variable: format!("c{k}"),
        direction: Direction::Output,
        kind,
        unit: (k == 0).then(|| "m/s".to_owned()),
        description: None,
    };
    let numbers = (0..12).map(|k| column(k, ["car", "road"][k / 6], ValueKind::Real));
    let columns: Columns<_> = numbers.chain([column(12, "car", ValueKind::String)]).collect();
    made(folder, columns, ticks)
}

/// A recording of these columns.
pub fn made(folder: &Path, columns: Columns<Recorded>, ticks: u64) -> Result<Vec<u8>, Failed> {
    let (numbers, texts) = (columns.numbers().len(), columns.texts().len());
    let header = RunHeader {
        scenario: "made".to_owned(),
        title: "A recording to be damaged".to_owned(),
        source: Source::made(diagnostics::TextFile {
            path: "made.toml".into(),
            text: "title = \"made\"\n".repeat(40),
            folder: None,
        }),
        given: Vec::new(),
        step: STEP,
        stop: STEP * ticks as f64,
        seed: 1,
        columns,
        status_tracks: Vec::new(),
        view: View::default(),
        folder: folder.to_owned(),
    };
    let mut sink = McapSink::new(&header)?;
    for tick in 0..=ticks {
        let numbers = (0..numbers).map(|column| value_of(tick, column)).collect();
        let time = tick as f64 * STEP;
        sink.row(tick, time, &Row::from_values(numbers, vec![format!("row {tick}"); texts]))?;
        if tick % 100 == 50 {
            let (source, message) = ("car".to_owned(), format!("half a second after {time}"));
            sink.event(&Event { time, level: Level::Info, source, message })?;
        }
    }
    sink.finish("# All is well", true)?;
    Ok(std::fs::read(folder.join("run.mcap"))?)
}

/// What a killed run leaves: no summary, and at the end a chunk without a length.
fn killed(folder: &Path, ticks: u64) -> Result<Vec<u8>, Failed> {
    let whole = finished(folder, ticks)?;
    let chunks: Vec<_> = records(&whole).filter(|(opcode, _)| *opcode == op::CHUNK).collect();
    let last = chunks.last().ok_or("a chunk")?.1.clone();
    let mut bytes = whole[..last.end - last.len() / 3].to_vec();
    bytes[last.start + 1..last.start + 9].fill(0xff);
    Ok(bytes)
}

/// A recording of another program.
fn foreign(
    folder: &Path,
    compression: Option<Compression>,
    messages: u64,
) -> Result<Vec<u8>, Failed> {
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

/// One to three kinds of damage, one after the other.
fn damage(random: &mut Pcg64, sound: &[u8]) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    for _ in 0..random.random_range(1..4) {
        if bytes.len() < 16 {
            break;
        }
        let length = bytes.len();
        let at = random.random_range(0..length);
        let block = at..(at + random.random_range(1..2000)).min(length);
        let all: Vec<_> = records(&bytes).map(|(_, place)| place).collect();
        let record = |random: &mut Pcg64| match all.len() {
            0 => block.clone(),
            many => all[random.random_range(0..many)].clone(),
        };
        match random.random_range(0..9) {
            0 | 1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => bytes.truncate(at),
            3 => bytes[block].fill_with(|| random.random()),
            4 => lengths(random, &mut bytes, &all),
            5 => {
                let (a, b) = (record(random), record(random));
                swap(&mut bytes, a, b);
            }
            6 => {
                let sector = at / 512 * 512;
                bytes[sector..(sector + 512).min(length)].fill(0);
            }
            7 => {
                let (from, to) = (record(random), record(random).start);
                let copy = bytes[from].to_vec();
                drop(bytes.splice(to..to, copy));
            }
            _ => drop(bytes.drain(block)),
        }
    }
    bytes
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
        let parts =
            [&bytes[second.clone()], &bytes[first.end..second.start], &bytes[first.clone()]];
        let swapped = parts.concat();
        bytes[first.start..second.end].copy_from_slice(&swapped);
    }
}
