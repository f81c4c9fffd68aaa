//! Logs events between rows.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::TextLog;
use re_sdk_types::components::TextLogLevel;
use recording::{Event, Level};

use super::run_slot::RunSlot;
use super::timeline::{TimePoint, TimePoints};

/// Events kept for a slow viewer.
const KEPT: usize = 1_000;

/// Unsent events.
pub(super) struct Events {
    slot: RunSlot,
    time_points: TimePoints,
    events: Vec<Event>,
}

impl Events {
    pub fn new(slot: &RunSlot) -> Self {
        Self { slot: slot.clone(), time_points: TimePoints::default(), events: Vec::new() }
    }

    pub fn push(&mut self, time_point: TimePoint, event: &Event) {
        self.time_points.push(time_point);
        self.events.push(event.clone());
    }

    /// Forgets all but the last few.
    pub fn forget_past(&mut self) {
        self.time_points.keep_last(KEPT);
        self.events.drain(..self.events.len().saturating_sub(KEPT));
    }

    /// Sends the events and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if self.events.is_empty() {
            return Ok(());
        }
        let text = |it: &Event| format!("{}: {}", self.slot.label(&it.source), it.message);
        let texts = self.events.iter().map(text);
        let levels = self.events.iter().map(|it| match it.level {
            Level::Info | Level::Summary => TextLogLevel::INFO,
            Level::Warning => TextLogLevel::WARN,
            Level::Error => TextLogLevel::ERROR,
        });
        let log = TextLog::update_fields().with_many_text(texts).with_many_level(levels);
        let path = self.slot.path("events");
        stream.send_columns(path, self.time_points.axes(), log.columns_of_unit_batches()?)?;
        self.time_points.clear();
        self.events.clear();
        Ok(())
    }
}
