//! Plans a recovery: lists the records of a damaged recording that a checksum confirms, and the damaged ranges between.

use std::collections::{BTreeMap, HashSet};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::ops::Range;

use ::mcap::MAGIC;
use ::mcap::records::{Channel, SchemaHeader, op};

use super::DamagedRange;
use super::scan::Scan;
use crate::records::{
    ChecksumStatus, ChunkHeader, Content, Damage, FileEnd, Frame, LARGEST, Records, each, unpack,
    verify_metadata,
};

/// What can be saved of a recording.
#[derive(Default)]
pub(super) struct RecoveryPlan {
    /// What is saved, in the order in which it is written.
    pub items: Vec<SavedRecord>,
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
pub(super) struct SavedRecord {
    pub frame: Frame,
    /// The times of the first and of the latest message [ns]; none without messages.
    pub times: Option<[u64; 2]>,
}

impl RecoveryPlan {
    /// Goes through the whole file; takes records without a checksum only if `unchecked`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn new(records: &mut Records, unchecked: bool) -> Result<Self, Damage> {
        let mut plan = RecoveryPlan { unchecked, ..RecoveryPlan::default() };
        let ending = records.ending()?;
        let closing = if records.is_finished()? { MAGIC.len() as u64 } else { 0 };
        let mut end = records.length - closing;
        if let Some(ending) = &ending {
            plan.trusted =
                matches!(sound(records.verify_data(ending))?, Some(ChecksumStatus::Valid));
            // The place where the data end is confirmed by either.
            if plan.read_summary(records, ending)? || plan.trusted {
                end = ending.data_end;
            }
        }
        let begin = if records.has_magic(0)? { MAGIC.len() as u64 } else { 0 };
        plan.walk(records, begin..end, closing > 0)?;
        plan.bring_into_order();
        Ok(plan)
    }

    /// Takes over what the summary says, if its checksum is right.
    fn read_summary(&mut self, records: &mut Records, ending: &FileEnd) -> Result<bool, Damage> {
        let Some((summary, proof)) = sound(records.summary(ending))? else { return Ok(false) };
        if proof == ChecksumStatus::Missing && !self.unchecked {
            return Ok(false);
        }
        let read = each(ending.data_end, &summary, &mut |opcode, body| {
            match Content::parse(opcode, body).ok_or(Damage::Form(opcode))? {
                Content::ChunkIndex(at, times) => self.index.push((at, times)),
                Content::Statistics(messages) => self.messages = Some(messages),
                content => self.define(content),
            }
            Ok::<_, Damage>(true)
        });
        Ok(sound(read)?.is_some())
    }

    fn walk(
        &mut self,
        records: &mut Records,
        bytes: Range<u64>,
        finished: bool,
    ) -> Result<(), Damage> {
        let (mut scan, mut at, mut in_data) = (Scan::new(records.length), bytes.start, true);
        while at < bytes.end {
            let frame = records.frame(at)?;
            let seen = match &frame {
                Some(frame) => sound(self.look(records, frame, in_data))?,
                None => None,
            };
            let next = frame.as_ref().and_then(Frame::end).filter(|end| *end <= bytes.end);
            let goes_on = match (seen, next) {
                (Some(RecordEvidence::Proven), Some(_)) => true,
                (Some(RecordEvidence::Framed), Some(next)) => {
                    is_plausible(records, next, bytes.end)?
                }
                _ => false,
            };
            if let (true, Some(next), Some(frame)) = (goes_on, next, frame) {
                in_data &= frame.opcode != op::DATA_END;
                at = next;
                continue;
            }
            let why = self.why(records, at, frame.as_ref());
            let behind = match next {
                Some(next) if is_plausible(records, next, bytes.end)? => Some(next),
                _ => scan.find(records, at + 1..bytes.end)?,
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
    fn look(
        &mut self,
        records: &mut Records,
        frame: &Frame,
        in_data: bool,
    ) -> Result<RecordEvidence, Damage> {
        let form = || Damage::Form(frame.opcode);
        if !frame.is_known() || !records.holds(frame) {
            return Err(Damage::Expected { expected: "a record", at: frame.at });
        }
        let (proof, times, id) = match frame.opcode {
            op::CHUNK => {
                let body = records.body(frame)?;
                let (header, _) = ChunkHeader::parse(&body).ok_or_else(form)?;
                let mut found = RecoveryPlan::default();
                let (mut times, mut hasher) = (None, DefaultHasher::new());
                unpack(frame, &body, &mut |opcode, body| {
                    // What stands before the records has no checksum, and may differ in a copy.
                    (opcode, body).hash(&mut hasher);
                    let content = Content::parse(opcode, body).ok_or(Damage::Form(opcode))?;
                    if let Content::Message(header, _) = &content {
                        let time = header.log_time;
                        let [first, last] = times.unwrap_or([time; 2]);
                        times = Some([first, last.max(time)]);
                    }
                    found.define(content);
                    Ok::<_, Damage>(true)
                })?;
                if header.proof() == ChecksumStatus::Valid || self.trusted || self.unchecked {
                    self.merge(found);
                }
                (header.proof(), times, hasher.finish())
            }
            op::ATTACHMENT | op::METADATA => {
                let body = records.body(frame)?;
                let proof = match Content::parse(frame.opcode, &body).ok_or_else(form)? {
                    Content::Attachment(attachment) => attachment.verify(frame.at)?,
                    Content::Metadata(metadata) => verify_metadata(&metadata)?,
                    _ => return Err(form()),
                };
                (proof, None, identity(&body))
            }
            op::SCHEMA | op::CHANNEL | op::MESSAGE if in_data => {
                let body = records.body(frame)?;
                let content = Content::parse(frame.opcode, &body).ok_or_else(form)?;
                let mut times = None;
                if let Content::Message(header, _) = &content {
                    times = Some([header.log_time; 2]);
                }
                if self.trusted || self.unchecked {
                    self.define(content);
                }
                (ChecksumStatus::Missing, times, identity(&body))
            }
            _ => return Ok(RecordEvidence::Framed),
        };
        if proof == ChecksumStatus::Missing && !self.trusted && !self.unchecked {
            self.unverified += 1;
            return Ok(RecordEvidence::Framed);
        }
        // A block that a disk has written twice.
        if self.trusted || self.known.insert(id) {
            self.items.push(SavedRecord { frame: *frame, times });
        }
        Ok(if proof == ChecksumStatus::Valid || self.trusted {
            RecordEvidence::Proven
        } else {
            RecordEvidence::Framed
        })
    }

    /// Why nothing can be saved from here on.
    fn why(&mut self, records: &mut Records, at: u64, frame: Option<&Frame>) -> String {
        let Some(frame) = frame else { return Damage::Cut(at).to_string() };
        let looked = RecoveryPlan::default().look(records, frame, false);
        let wrong = looked.err().unwrap_or(Damage::Expected { expected: "a record", at });
        wrong.to_string()
    }

    fn define(&mut self, content: Content) {
        match content {
            // MCAP gives 0 to channels without a schema.
            Content::Schema(header, data) if header.id != 0 => {
                self.schemas.entry(header.id).or_insert_with(|| (header, data.to_vec()));
            }
            Content::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            _ => {}
        }
    }

    fn merge(&mut self, found: RecoveryPlan) {
        for (id, schema) in found.schemas {
            self.schemas.entry(id).or_insert(schema);
        }
        for (id, channel) in found.channels {
            self.channels.entry(id).or_insert(channel);
        }
    }

    /// Finds the times of losses; and in a damaged file chunks may have changed places.
    fn bring_into_order(&mut self) {
        for loss in &mut self.losses {
            let lost = self.index.iter().filter(|(at, _)| loss.bytes.contains(at));
            let known =
                lost.map(|(_, times)| *times).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
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
fn sound<T>(result: Result<T, Damage>) -> Result<Option<T>, Damage> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Damage::Io(error)) => Err(Damage::Io(error)),
        Err(_) => Ok(None),
    }
}

fn identity(body: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    body.hash(&mut hasher);
    hasher.finish()
}

/// Whether a record can begin here: the end, a whole record, or the last one, which is not whole.
fn is_plausible(records: &mut Records, at: u64, end: u64) -> Result<bool, Damage> {
    if at == end {
        return Ok(true);
    }
    let Some(frame) = records.frame(at)? else { return Ok(false) };
    let open = frame.opcode == op::CHUNK && frame.length == u64::MAX;
    Ok(frame.is_known() && (records.holds(&frame) || open || frame.length <= LARGEST))
}
