//! Logs what happens between the rows.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::TextLog;
use re_sdk_types::components::TextLogLevel;
use recording::{Event, Level};

use super::contender::Contender;
use super::moments::{Moment, Moments};

/// Events that are kept for a viewer that is too slow.
const KEPT: usize = 1_000;

/// The events that were not sent yet.
pub(super) struct Events {
    contender: Contender,
    moments: Moments,
    events: Vec<Event>,
}

impl Events {
    pub fn new(contender: &Contender) -> Self {
        Self { contender: contender.clone(), moments: Moments::default(), events: Vec::new() }
    }

    pub fn push(&mut self, moment: Moment, event: &Event) {
        self.moments.push(moment);
        self.events.push(event.clone());
    }

    /// Forgets all but the last few.
    pub fn forget_past(&mut self) {
        self.moments.keep_last(KEPT);
        self.events.drain(..self.events.len().saturating_sub(KEPT));
    }

    /// Sends the events and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if self.events.is_empty() {
            return Ok(());
        }
        let text = |it: &Event| format!("{}: {}", self.contender.label(&it.source), it.message);
        let texts = self.events.iter().map(text);
        let levels = self.events.iter().map(|it| match it.level {
            Level::Info => TextLogLevel::INFO,
            Level::Warning => TextLogLevel::WARN,
            Level::Error => TextLogLevel::ERROR,
        });
        let log = TextLog::update_fields().with_many_text(texts).with_many_level(levels);
        let path = self.contender.path("events");
        stream.send_columns(path, self.moments.axes(), log.columns_of_unit_batches()?)?;
        self.moments.clear();
        self.events.clear();
        Ok(())
    }
}
