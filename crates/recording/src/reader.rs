//! Reads a run back from its `run.mcap`: first its description, then its rows and events.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ::mcap::Channel;
use ::mcap::records::{MessageHeader, op};
use diagnostics::{Error, SourceFiles, TextFile};
use prost::Message as _;
use prost::encoding::{DecodeContext, WireType, decode_key, skip_field, string};
use prost_types::field_descriptor_proto::Type;
use prost_types::{DescriptorProto, FileDescriptorSet};

use crate::columns::{Column, Columns, ValueKind, VariableDirection};
use crate::records::{RecordContent, RecordDamage, verify_metadata};
use crate::row::{RecordedVariables, Row};
use crate::sink::mcap::{KEPT, RUN, SCENARIO, SUMMARY, decode_log_event};
use crate::sink::{RunHeader, Sink};
use crate::table::{McapReader, TableError};
use crate::view::ReplayView;
use expression::ColumnIndex;

/// The way out of a damaged file.
const RECOVER: &str = "`trackside recover` saves what can be read of it";

/// A recorded run.
pub struct Recording {
    /// Its description, without layout and status tracks.
    pub header: RunHeader,
    /// Its verdict as Markdown; none if the recording was cut off.
    pub summary: Option<String>,
    /// Whether the recording was cut off.
    pub cut: bool,
    file: McapReader,
    /// One side of each node, by the id of its channel.
    sides: BTreeMap<u16, FieldColumns>,
    log: Option<u16>,
}

/// The columns of a channel's fields, by field number.
type FieldColumns = BTreeMap<u32, ColumnIndex<RecordedVariables>>;

impl Recording {
    /// Opens the recording of a run: `run` is its folder, its `run.mcap`, or a file beside that.
    ///
    /// # Errors
    /// When there is no recording, or it is damaged, or another program made it.
    pub fn open(run: &Path) -> Result<Self, Error> {
        let path = find_recording_path(run)?;
        let wrong = |error: &TableError| Error::invalid_input(error.to_string()).with_help(RECOVER);
        let file = McapReader::open(&path).map_err(|error| wrong(&error.into()))?;
        let channels = file.read_channels().map_err(|error| wrong(&error))?;
        let metadata = RecordingMetadata::read(&file).map_err(|error| wrong(&error))?;
        let mut recording = Recording {
            header: metadata.run_header(&path)?,
            summary: metadata.summary,
            cut: !file.finished,
            file,
            sides: BTreeMap::new(),
            log: None,
        };
        // Outputs come first, as in every row: of two columns of one name the output counts.
        for direction in [VariableDirection::Output, VariableDirection::Input] {
            for channel in channels.values() {
                recording.add_channel_columns(channel, direction);
            }
        }
        recording.log = channels.values().find(|it| it.topic == "/log").map(|channel| channel.id);
        if recording.sides.is_empty() {
            let message = format!("{} holds no signals of a run", path.display());
            return Err(
                Error::invalid_input(message).with_help("expected a run with FMUs, signals or tables")
            );
        }
        Ok(recording)
    }

    /// The path of the recording.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.file.path
    }

    /// Adds the variables of a channel, if it holds this side of a node.
    fn add_channel_columns(&mut self, channel: &Channel, direction: VariableDirection) {
        let word = match direction {
            VariableDirection::Input => "inputs",
            VariableDirection::Output => "outputs",
        };
        let parts = channel.topic.strip_prefix('/').and_then(|topic| topic.rsplit_once('/'));
        let Some((node, _)) = parts.filter(|(_, side)| *side == word) else { return };
        let Some(message) = message_descriptor(channel) else { return };
        let mut side = FieldColumns::new();
        for field in &message.field {
            let entry = |what: &str| channel.metadata.get(&format!("{what}:{}", field.name()));
            let Some(variable) = entry("fmi") else { return };
            let kind = match (field.r#type(), entry("type").map(String::as_str)) {
                (Type::String, _) => ValueKind::String,
                (Type::Int64, _) => ValueKind::Int64,
                (Type::Uint64, _) => ValueKind::UInt64,
                (_, Some("Integer")) => ValueKind::Integer,
                (_, Some("Boolean")) => ValueKind::Boolean,
                _ => ValueKind::Real,
            };
            let index = self.header.columns.push(Column {
                node: node.to_owned(),
                variable: variable.clone(),
                direction,
                kind,
                unit: entry("unit").filter(|unit| !unit.is_empty()).cloned(),
                description: None,
            });
            side.insert(field.number() as u32, index);
        }
        self.sides.insert(channel.id, side);
    }

    /// Plays the rows and events of the run to a sink. At the end of a recording that was cut off, an incomplete row is left
    /// out.
    ///
    /// # Errors
    /// When the recording is damaged, or the sink fails.
    pub fn replay_into(&self, sink: &mut dyn Sink) -> Result<(), Error> {
        let columns = &self.header.columns;
        let mut row = columns.zero_row();
        let (mut now, mut filled, mut failed) = (None, 0, None);
        let mut take = |header: &MessageHeader, data: &[u8]| -> Result<(), Error> {
            let time = header.log_time as f64 / 1e9;
            if Some(header.channel_id) == self.log {
                return decode_log_event(time, data).map_or(Ok(()), |event| sink.push_event(&event));
            }
            let Some(side) = self.sides.get(&header.channel_id) else { return Ok(()) };
            if now > Some(header.log_time) {
                let (path, found) = (self.path().display(), header.sequence);
                let message = format!("{path} is damaged: row {found} stands behind a later one");
                return Err(Error::invalid_input(message).with_help(RECOVER));
            }
            if now != Some(header.log_time) {
                (now, filled) = (Some(header.log_time), 0);
            }
            decode_fields_into_row(data, side, columns, &mut row).map_err(|error| {
                let path = self.path().display();
                Error::invalid_input(format!("{path}: a message at {time} s cannot be read: {error}"))
            })?;
            filled += 1;
            if filled < self.sides.len() {
                return Ok(());
            }
            sink.push_row(u64::from(header.sequence), time, &row)
        };
        let read = self.file.visit_messages(&mut |header, data| {
            failed = take(header, data).err();
            Ok(failed.is_none())
        });
        failed.map_or(Ok(()), Err)?;
        read.map_err(|error| Error::invalid_input(error.to_string()).with_help(RECOVER))
    }
}

/// The recording of a run.
fn find_recording_path(run: &Path) -> Result<PathBuf, Error> {
    let path = match run.extension().is_some_and(|it| it == "mcap") {
        true => run.to_owned(),
        // `run.rrd` is thinned and has no units.
        false if run.is_file() => run.with_file_name("run.mcap"),
        false => run.join("run.mcap"),
    };
    if path.is_file() {
        return Ok(path);
    }
    let error = Error::invalid_input(format!("{}: there is no recording {}", run.display(), path.display()));
    Err(error.with_help(
        "expected the folder of a run, such as target/runs/limit_handling, or its run.mcap; `trackside run` makes both",
    ))
}

/// The metadata and attachments of a recording.
#[derive(Default)]
struct RecordingMetadata {
    /// The metadata of the run.
    run: Option<BTreeMap<String, String>>,
    scenario: Vec<TextFile>,
    kept: Vec<TextFile>,
    summary: Option<String>,
}

impl RecordingMetadata {
    fn read(file: &McapReader) -> Result<Self, TableError> {
        let mut metadata = RecordingMetadata::default();
        file.visit_records(&mut |opcode, data| {
            if matches!(opcode, op::ATTACHMENT | op::METADATA) {
                let content = RecordContent::parse(opcode, data).ok_or(RecordDamage::Form(opcode));
                content.and_then(|it| metadata.add_record(it)).map_err(|error| file.damage_error(error))?;
            }
            Ok(true)
        })?;
        Ok(metadata)
    }

    fn add_record(&mut self, content: RecordContent) -> Result<(), RecordDamage> {
        match content {
            RecordContent::Metadata(it) if it.name == RUN => {
                verify_metadata(&it)?;
                self.run = Some(it.metadata);
            }
            RecordContent::Attachment(it) => {
                let text = String::from_utf8_lossy(it.data).into_owned();
                let file = TextFile::new(&it.name, text);
                match it.media_type.as_str() {
                    SCENARIO => self.scenario.push(file),
                    KEPT => self.kept.push(file),
                    _ if it.name == SUMMARY => self.summary = Some(file.text),
                    _ => {}
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn run_header(&self, path: &Path) -> Result<RunHeader, Error> {
        let entry = |key: &str| self.run.as_ref().and_then(|run| run.get(key)).map(String::as_str);
        let number = |key: &str| entry(key).and_then(|text| text.parse::<f64>().ok());
        let (Some(scenario), Some(step)) = (entry("scenario"), number("step")) else {
            let message = format!("{} is not the recording of a run of this program", path.display());
            let help =
                "expected the run.mcap of `trackside run`; scenarios play other recordings back as [[table]]";
            return Err(Error::invalid_input(message).with_help(help));
        };
        let mut files = self.scenario.iter().cloned();
        Ok(RunHeader {
            scenario: scenario.to_owned(),
            title: entry("title").unwrap_or(scenario).to_owned(),
            source: SourceFiles::from_recording(
                files.next().unwrap_or_default(),
                files.collect(),
                self.kept.clone(),
            ),
            given: entry("set").unwrap_or_default().lines().map(str::to_owned).collect(),
            step,
            stop: number("stop").unwrap_or_default(),
            seed: entry("seed").and_then(|seed| seed.parse().ok()).unwrap_or_default(),
            columns: Columns::default(),
            status_tracks: Vec::new(),
            view: ReplayView::default(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
        })
    }
}

/// The description of a channel's messages.
fn message_descriptor(channel: &Channel) -> Option<DescriptorProto> {
    let schema = channel.schema.as_ref()?;
    let files = FileDescriptorSet::decode(&*schema.data).ok()?.file;
    let name = schema.name.rsplit('.').next()?;
    files.into_iter().flat_map(|file| file.message_type).find(|message| message.name() == name)
}

/// Puts the fields of a message into the row.
fn decode_fields_into_row(
    mut data: &[u8],
    side: &FieldColumns,
    columns: &Columns<RecordedVariables>,
    row: &mut Row<RecordedVariables>,
) -> Result<(), prost::DecodeError> {
    while !data.is_empty() {
        let (number, wire) = decode_key(&mut data)?;
        match (wire, side.get(&number)) {
            (WireType::SixtyFourBit, Some(ColumnIndex::Number(index))) => {
                prost::encoding::double::merge(wire, &mut row[*index], &mut data, DecodeContext::default())?;
            }
            (WireType::Varint, Some(ColumnIndex::Number(index))) => {
                let bits = prost::encoding::decode_varint(&mut data)?;
                let signed = columns[*index].kind == ValueKind::Int64;
                let value = if signed { i128::from(bits as i64) } else { i128::from(bits) };
                if let Some(integer) = columns.integer_index_of(*index) {
                    row.set_integer(integer, *index, value);
                }
            }
            (WireType::LengthDelimited, Some(ColumnIndex::Text(index))) => {
                let text = &mut row[*index];
                string::merge(wire, text, &mut data, DecodeContext::default())?;
            }
            _ => skip_field(wire, number, &mut data, DecodeContext::default())?,
        }
    }
    Ok(())
}
