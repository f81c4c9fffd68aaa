//! Plans a recovery: lists the records of a damaged recording that a checksum confirms, and the damaged ranges between.

use std::collections::{BTreeMap, HashSet};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::ops::Range;

use ::mcap::MAGIC;
use ::mcap::records::{Channel, SchemaHeader, op};

use super::DamagedRange;
use super::scan::RecordScanner;
use crate::records::{
    ChecksumStatus, ChunkHeader, LARGEST, McapRecordReader, McapTrailer, RecordContent, RecordDamage,
    RecordFrame, for_each_record, verify_and_visit_chunk, verify_metadata,
};

/// What can be saved of a recording.
#[derive(Default)]
pub(super) struct RecoveryPlan {
    /// What is saved, in the order in which it is written.
    pub items: Vec<RecoverableRecord>,
    pub schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    pub channels: BTreeMap<u16, Channel>,
    pub losses: Vec<DamagedRange>,
    /// From where on there is no whole record, if the writer did not finish.
    pub cut: Option<u64>,
    /// Records that no checksum confirms, left out.
    pub unverified: u64,
    /// All messages of the recording, if its summary tells.
    pub messages: Option<u64>,
    /// Whether the checksum over all data is right.
    pub trusted: bool,
    /// Whether records without a checksum are taken, too.
    unchecked: bool,
    /// The chunks by their places, with their first and last times [ns], if the summary tells.
    index: Vec<(u64, [u64; 2])>,
    known: HashSet<u64>,
}

/// A record that is saved.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecoverableRecord {
    pub frame: RecordFrame,
    /// The times of the first and of the latest message [ns]; none without messages.
    pub times: Option<[u64; 2]>,
}

impl RecoveryPlan {
    /// Goes through the whole file; takes records without a checksum only if `unchecked`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn new(records: &mut McapRecordReader, unchecked: bool) -> Result<Self, RecordDamage> {
        let mut plan = RecoveryPlan { unchecked, ..RecoveryPlan::default() };
        let ending = records.read_trailer()?;
        let closing = if records.is_file_complete()? { MAGIC.len() as u64 } else { 0 };
        let mut end = records.length - closing;
        if let Some(ending) = &ending {
            plan.trusted =
                matches!(none_if_damaged(records.verify_data(ending))?, Some(ChecksumStatus::Valid));
            // The place where the data end is confirmed by either.
            if plan.read_summary(records, ending)? || plan.trusted {
                end = ending.data_end;
            }
        }
        let begin = if records.has_magic(0)? { MAGIC.len() as u64 } else { 0 };
        plan.scan_records(records, begin..end, closing > 0)?;
        plan.sort_and_date_losses();
        Ok(plan)
    }

    /// Takes over what the summary says, if its checksum is right.
    fn read_summary(
        &mut self,
        records: &mut McapRecordReader,
        ending: &McapTrailer,
    ) -> Result<bool, RecordDamage> {
        let Some((summary, proof)) = none_if_damaged(records.read_summary(ending))? else {
            return Ok(false);
        };
        if proof == ChecksumStatus::Missing && !self.unchecked {
            return Ok(false);
        }
        let read = for_each_record(ending.data_end, &summary, &mut |opcode, body| {
            match RecordContent::parse(opcode, body).ok_or(RecordDamage::Form(opcode))? {
                RecordContent::ChunkIndex(at, times) => self.index.push((at, times)),
                RecordContent::Statistics(it) => self.messages = Some(it.messages),
                content => self.add_definition(content),
            }
            Ok::<_, RecordDamage>(true)
        });
        Ok(none_if_damaged(read)?.is_some())
    }

    fn scan_records(
        &mut self,
        records: &mut McapRecordReader,
        bytes: Range<u64>,
        finished: bool,
    ) -> Result<(), RecordDamage> {
        let (mut scan, mut at, mut in_data) = (RecordScanner::new(records.length), bytes.start, true);
        while at < bytes.end {
            let frame = records.read_frame(at)?;
            let seen = match &frame {
                Some(frame) => none_if_damaged(self.classify_record(records, frame, in_data))?,
                None => None,
            };
            let next = frame.as_ref().and_then(RecordFrame::end_offset).filter(|end| *end <= bytes.end);
            let goes_on = match (seen, next) {
                (Some(RecordEvidence::Proven), Some(_)) => true,
                (Some(RecordEvidence::Framed), Some(next)) => can_record_begin_at(records, next, bytes.end)?,
                _ => false,
            };
            if let (true, Some(next), Some(frame)) = (goes_on, next, frame) {
                in_data &= frame.opcode != op::DATA_END;
                at = next;
                continue;
            }
            let why = self.describe_damage(records, at, frame.as_ref());
            let behind = match next {
                Some(next) if can_record_begin_at(records, next, bytes.end)? => Some(next),
                _ => scan.find_verified_record(records, at + 1..bytes.end)?,
            };
            if behind.is_none() && !finished {
                self.cut = Some(at);
                break;
            }
            let until = behind.unwrap_or(bytes.end);
            self.losses.push(DamagedRange { bytes: at..until, why, span: None });
            at = until;
        }
        if !finished && self.cut.is_none() {
            self.cut = Some(bytes.end);
        }
        Ok(())
    }

    /// Looks at a record, and notes it if it can be saved.
    fn classify_record(
        &mut self,
        records: &mut McapRecordReader,
        frame: &RecordFrame,
        in_data: bool,
    ) -> Result<RecordEvidence, RecordDamage> {
        let form = || RecordDamage::Form(frame.opcode);
        if !frame.has_known_opcode() || !records.contains_record(frame) {
            return Err(RecordDamage::Expected { expected: "a record", at: frame.at });
        }
        let (proof, times, id) = match frame.opcode {
            op::CHUNK => {
                let body = records.read_body(frame)?;
                let (header, _) = ChunkHeader::parse(&body).ok_or_else(form)?;
                let mut found = RecoveryPlan::default();
                let (mut times, mut hasher) = (None, DefaultHasher::new());
                verify_and_visit_chunk(frame, &body, &mut |opcode, body| {
                    // What stands before the records has no checksum, and may differ in a copy.
                    (opcode, body).hash(&mut hasher);
                    let content = RecordContent::parse(opcode, body).ok_or(RecordDamage::Form(opcode))?;
                    if let RecordContent::Message(header, _) = &content {
                        let time = header.log_time;
                        let [first, last] = times.unwrap_or([time; 2]);
                        times = Some([first, last.max(time)]);
                    }
                    found.add_definition(content);
                    Ok::<_, RecordDamage>(true)
                })?;
                if header.checksum_status() == ChecksumStatus::Valid || self.trusted || self.unchecked {
                    self.merge_definitions(found);
                }
                (header.checksum_status(), times, hasher.finish())
            }
            op::ATTACHMENT | op::METADATA => {
                let body = records.read_body(frame)?;
                let proof = match RecordContent::parse(frame.opcode, &body).ok_or_else(form)? {
                    RecordContent::Attachment(attachment) => attachment.verify_checksum(frame.at)?,
                    RecordContent::Metadata(metadata) => verify_metadata(&metadata)?,
                    _ => return Err(form()),
                };
                (proof, None, body_hash(&body))
            }
            op::SCHEMA | op::CHANNEL | op::MESSAGE if in_data => {
                let body = records.read_body(frame)?;
                let content = RecordContent::parse(frame.opcode, &body).ok_or_else(form)?;
                let mut times = None;
                if let RecordContent::Message(header, _) = &content {
                    times = Some([header.log_time; 2]);
                }
                if self.trusted || self.unchecked {
                    self.add_definition(content);
                }
                (ChecksumStatus::Missing, times, body_hash(&body))
            }
            _ => return Ok(RecordEvidence::Framed),
        };
        if proof == ChecksumStatus::Missing && !self.trusted && !self.unchecked {
            self.unverified += 1;
            return Ok(RecordEvidence::Framed);
        }
        // A block that a disk has written twice.
        if self.trusted || self.known.insert(id) {
            self.items.push(RecoverableRecord { frame: *frame, times });
        }
        Ok(if proof == ChecksumStatus::Valid || self.trusted {
            RecordEvidence::Proven
        } else {
            RecordEvidence::Framed
        })
    }

    /// Why nothing can be saved from here on.
    fn describe_damage(
        &mut self,
        records: &mut McapRecordReader,
        at: u64,
        frame: Option<&RecordFrame>,
    ) -> String {
        let Some(frame) = frame else { return RecordDamage::Cut(at).to_string() };
        let looked = RecoveryPlan::default().classify_record(records, frame, false);
        let wrong = looked.err().unwrap_or(RecordDamage::Expected { expected: "a record", at });
        wrong.to_string()
    }

    fn add_definition(&mut self, content: RecordContent) {
        match content {
            // MCAP gives 0 to channels without a schema.
            RecordContent::Schema(header, data) if header.id != 0 => {
                self.schemas.entry(header.id).or_insert_with(|| (header, data.to_vec()));
            }
            RecordContent::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            _ => {}
        }
    }

    fn merge_definitions(&mut self, found: RecoveryPlan) {
        for (id, schema) in found.schemas {
            self.schemas.entry(id).or_insert(schema);
        }
        for (id, channel) in found.channels {
            self.channels.entry(id).or_insert(channel);
        }
    }

    /// Finds the times of losses; and in a damaged file chunks may have changed places.
    fn sort_and_date_losses(&mut self) {
        for loss in &mut self.losses {
            let lost = self.index.iter().filter(|(at, _)| loss.bytes.contains(at));
            let known = lost.map(|(_, times)| *times).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
            let chunks = || self.items.iter().filter_map(|item| Some((item.frame.at, item.times?)));
            let before = chunks().take_while(|(at, _)| *at < loss.bytes.start).last();
            let after = chunks().find(|(at, _)| *at >= loss.bytes.end);
            let between = before.zip(after).map(|((_, before), (_, after))| [before[1], after[0]]);
            // With an index, a place without a chunk holds no messages.
            let span = if self.index.is_empty() { between } else { known };
            loss.span = span.map(|times| times.map(|time| time as f64 / 1e9));
        }
        if !self.trusted {
            self.items.sort_by_key(|item| item.times.map(|[first, _]| first));
        }
    }
}

/// How a record looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RecordEvidence {
    /// A checksum confirms it.
    Proven,
    /// Its length fits, which alone proves nothing.
    Framed,
}

/// Damage is no error here, unless the disk fails.
fn none_if_damaged<T>(result: Result<T, RecordDamage>) -> Result<Option<T>, RecordDamage> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(RecordDamage::Io(error)) => Err(RecordDamage::Io(error)),
        Err(_) => Ok(None),
    }
}

fn body_hash(body: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    body.hash(&mut hasher);
    hasher.finish()
}

/// Whether a record can begin here: the end, a whole record, or the last one, which is not whole.
fn can_record_begin_at(records: &mut McapRecordReader, at: u64, end: u64) -> Result<bool, RecordDamage> {
    if at == end {
        return Ok(true);
    }
    let Some(frame) = records.read_frame(at)? else { return Ok(false) };
    let open = frame.opcode == op::CHUNK && frame.length == u64::MAX;
    Ok(frame.has_known_opcode() && (records.contains_record(&frame) || open || frame.length <= LARGEST))
}
