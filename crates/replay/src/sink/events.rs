//! Logs events between rows.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::TextLog;
use re_sdk_types::components::TextLogLevel;
use recording::{EventLevel, RunEvent};

use super::run_slot::RunNamespace;
use super::timeline::{TimePoint, TimePoints};

/// Events kept for a slow viewer.
const KEPT: usize = 1_000;

/// Unsent events.
pub(super) struct UnsentEvents {
    slot: RunNamespace,
    time_points: TimePoints,
    events: Vec<RunEvent>,
}

impl UnsentEvents {
    pub fn new(slot: &RunNamespace) -> Self {
        Self { slot: slot.clone(), time_points: TimePoints::default(), events: Vec::new() }
    }

    pub fn push(&mut self, time_point: TimePoint, event: &RunEvent) {
        self.time_points.push(time_point);
        self.events.push(event.clone());
    }

    /// Forgets all but the last few.
    pub fn forget_all_but_last(&mut self) {
        self.time_points.keep_last(KEPT);
        self.events.drain(..self.events.len().saturating_sub(KEPT));
    }

    /// Sends the events and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if self.events.is_empty() {
            return Ok(());
        }
        let text = |it: &RunEvent| format!("{}: {}", self.slot.run_label(&it.source), it.message);
        let texts = self.events.iter().map(text);
        let levels = self.events.iter().map(|it| match it.level {
            EventLevel::Info | EventLevel::Summary => TextLogLevel::INFO,
            EventLevel::Warning => TextLogLevel::WARN,
            EventLevel::Error => TextLogLevel::ERROR,
        });
        let log = TextLog::update_fields().with_many_text(texts).with_many_level(levels);
        let path = self.slot.entity_path("events");
        stream.send_columns(path, self.time_points.time_columns(), log.columns_of_unit_batches()?)?;
        self.time_points.clear();
        self.events.clear();
        Ok(())
    }
}
