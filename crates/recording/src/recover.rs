//! Recovers a valid recording from that of a killed run, or from a damaged one: what checksums confirm, and nothing else.

mod plan;
mod scan;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::ops::Range;
use std::path::Path;

use ::mcap::records::{MessageHeader, op};
use ::mcap::write::Metadata;
use ::mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use diagnostics::Error;

use self::plan::{RecoverableRecord, RecoveryPlan};
use crate::records::{
    McapRecordReader, RecordContent, RecordDamage, describe_mcap_error, metadata_checksum_entry, tail,
    verify_and_visit_chunk,
};

/// The saved part of a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecoveryReport {
    /// Messages of all channels.
    pub messages: u64,
    /// Messages that the recording had, if it tells.
    pub of: Option<u64>,
    /// Channels.
    pub channels: usize,
    /// From the first to the last message [s].
    pub seconds: f64,
    /// From where on there is no whole record [B], if the writer did not finish.
    pub cut: Option<u64>,
    /// What is damaged, in the order of the file.
    pub losses: Vec<DamagedRange>,
    /// Records without a checksum, which are left out.
    pub unverified: u64,
    /// Messages of channels whose description is lost; they are left out.
    pub unknown: u64,
    /// Whether only the index was damaged, which is made anew.
    pub index: bool,
}

/// A damaged part of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct DamagedRange {
    /// Its place in the file [B].
    pub bytes: Range<u64>,
    /// What is wrong there.
    pub why: String,
    /// The messages that were there are of this time [s]; none if no message is lost, or nobody knows.
    pub span: Option<[f64; 2]>,
}

impl RecoveryReport {
    /// Whether everything was saved.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.cut.is_none() && self.losses.is_empty() && self.unverified == 0 && self.unknown == 0
    }

    /// What is missing, a line for each.
    #[must_use]
    pub fn loss_descriptions(&self) -> Vec<String> {
        let loss = |loss: &DamagedRange| {
            let Range { start, end } = loss.bytes;
            let span = loss.span.map(|[from, to]| format!(", between {from} s and {to} s"));
            format!("bytes {start} to {end}{}: {}", span.unwrap_or_default(), loss.why)
        };
        let mut lines: Vec<_> = self.losses.iter().map(loss).collect();
        let cut = |at| format!("its writer did not finish: nothing whole from byte {at} on");
        lines.extend(self.cut.map(cut));
        let count = |count: u64, what: &str| (count > 0).then(|| format!("{count} {what}"));
        lines.extend(count(self.unverified, "records without a checksum"));
        lines.extend(count(self.unknown, "messages of channels whose description is lost"));
        lines
    }
}

/// Copies what is sound of `broken` into a new file `into`, which appears when it is complete. Only what a checksum confirms is
/// sound, unless `unchecked` takes records without one as they are.
///
/// # Errors
/// When `broken` cannot be read, nothing in it is sound, or `into` cannot be written.
pub fn recover_recording(broken: &Path, into: &Path, unchecked: bool) -> Result<RecoveryReport, Error> {
    let unreadable = |what: String| Error::invalid_input(format!("{}: {what}", broken.display()));
    let mut records =
        McapRecordReader::open(broken).map_err(|error| unreadable(format!("cannot read: {error}")))?;
    let plan =
        RecoveryPlan::new(&mut records, unchecked).map_err(|it| unreadable(format!("cannot read: {it}")))?;
    if plan.channels.is_empty() {
        let mut error = unreadable("expected an MCAP file with channels, found none".to_owned());
        if plan.unverified > 0 {
            error = error.with_help(format!(
                "{} records have no checksum; `--unchecked` takes them, right or wrong",
                plan.unverified
            ));
        }
        return Err(error);
    }
    let partial = tail::add_extension(into, "partial");
    let written = write_recovered_file(&mut records, &plan, broken, &partial);
    let recovered = written.inspect_err(|_| drop(std::fs::remove_file(&partial)))?;
    std::fs::rename(&partial, into).map_err(|error| Error::output_failure(into, error))?;
    Ok(recovered)
}

fn write_recovered_file(
    records: &mut McapRecordReader,
    plan: &RecoveryPlan,
    broken: &Path,
    partial: &Path,
) -> Result<RecoveryReport, Error> {
    let file = File::create(partial).map_err(|error| Error::output_failure(partial, error))?;
    let failed = |error: CopyError| match error {
        CopyError::Writing(error) => Error::output_failure(partial, describe_mcap_error(error)),
        CopyError::ColumnType(damage) => Error::invalid_input(format!("the broken recording: {damage}")),
    };
    let options = WriteOptions::new()
        .profile("")
        .library(concat!("trackside ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4));
    let writer = options.create(BufWriter::new(file)).map_err(|error| failed(error.into()))?;
    let mut copy = RecoveryWriter { writer, plan, found: RecoveryReport::default(), times: None };
    copy.write_schemas_and_channels().map_err(|error| failed(error.into()))?;
    for item in &plan.items {
        copy.copy_record(records, item).map_err(failed)?;
    }
    if plan.cut.is_some() && plan.losses.is_empty() {
        for message in tail::read_tail_messages(broken, copy.found.messages) {
            copy.write_record(op::MESSAGE, &message).map_err(failed)?;
        }
    }
    copy.finish().map_err(|error| failed(error.into()))
}

/// Why a copy failed.
enum CopyError {
    Writing(McapError),
    ColumnType(RecordDamage),
}

impl From<McapError> for CopyError {
    fn from(error: McapError) -> Self {
        CopyError::Writing(error)
    }
}

impl From<RecordDamage> for CopyError {
    fn from(damage: RecordDamage) -> Self {
        CopyError::ColumnType(damage)
    }
}

/// The new file.
struct RecoveryWriter<'a> {
    writer: Writer<BufWriter<File>>,
    plan: &'a RecoveryPlan,
    found: RecoveryReport,
    times: Option<[u64; 2]>,
}

impl RecoveryWriter<'_> {
    /// Writes schemas and channels, under the numbers that they had.
    fn write_schemas_and_channels(&mut self) -> Result<(), McapError> {
        for (id, (schema, data)) in &self.plan.schemas {
            self.writer.add_schema_with_id(*id, &schema.name, &schema.encoding, data)?;
        }
        for (id, it) in &self.plan.channels {
            let known = it.schema_id == 0 || self.plan.schemas.contains_key(&it.schema_id);
            if known {
                let (topic, encoding) = (&it.topic, &it.message_encoding);
                self.writer.add_channel_with_id(*id, it.schema_id, topic, encoding, &it.metadata)?;
                self.found.channels += 1;
            }
        }
        self.writer.flush()
    }

    fn copy_record(
        &mut self,
        records: &mut McapRecordReader,
        item: &RecoverableRecord,
    ) -> Result<(), CopyError> {
        let body = records.read_body(&item.frame)?;
        if item.frame.opcode != op::CHUNK {
            return self.write_record(item.frame.opcode, &body);
        }
        verify_and_visit_chunk(&item.frame, &body, &mut |opcode, body| {
            self.write_record(opcode, body).map(|()| true)
        })?;
        Ok(())
    }

    fn write_record(&mut self, opcode: u8, body: &[u8]) -> Result<(), CopyError> {
        match RecordContent::parse(opcode, body).ok_or(RecordDamage::Form(opcode))? {
            RecordContent::Message(header, data) => self.write_message(&header, data)?,
            RecordContent::Attachment(it) => self.writer.attach(&Attachment {
                log_time: it.log_time,
                create_time: it.create_time,
                name: it.name,
                media_type: it.media_type,
                data: it.data.into(),
            })?,
            RecordContent::Metadata(metadata) => self.writer.write_metadata(&metadata)?,
            // The writer makes indices, statistics and footer of its own.
            _ => {}
        }
        Ok(())
    }

    fn write_message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), McapError> {
        match self.writer.write_to_known_channel(header, data) {
            Err(McapError::UnknownChannel(..)) => self.found.unknown += 1,
            written => {
                written?;
                self.found.messages += 1;
                let time = header.log_time;
                let [first, last] = self.times.unwrap_or([time; 2]);
                self.times = Some([first.min(time), last.max(time)]);
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<RecoveryReport, McapError> {
        let plan = self.plan;
        let found = &mut self.found;
        found.of = plan.messages;
        found.seconds = self.times.map_or(0.0, |[first, last]| (last - first) as f64 * 1e-9);
        found.cut = plan.cut;
        found.losses.clone_from(&plan.losses);
        found.unverified = plan.unverified;
        found.index = found.is_complete() && !plan.trusted;
        if !found.is_complete() {
            let mut metadata = BTreeMap::from([("ended".to_owned(), found.loss_descriptions().join("\n"))]);
            metadata.extend([metadata_checksum_entry("recovered", &metadata)]);
            self.writer.write_metadata(&Metadata { name: "recovered".to_owned(), metadata })?;
        }
        self.writer.finish()?;
        Ok(self.found)
    }
}
