//! Logs recorded texts where they change, as events and over time.

use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{StateChange, TextLog};
use re_sdk_types::components::TextLogLevel;
use recording::RunHeader;

use super::run_slot::RunNamespace;
use super::signals::column_entity_path;
use super::timeline::{TimePoint, TimePoints};

/// One text with its unsent changes.
struct TextTrack {
    path: EntityPath,
    name: String,
    /// Its value in the last row.
    now: Option<String>,
    time_points: TimePoints,
    changes: Vec<String>,
}

/// Every recorded text.
pub(super) struct RecordedTexts(Vec<TextTrack>);

impl RecordedTexts {
    /// One entity for each text, beside those of numbers.
    pub fn new(header: &RunHeader, slot: &RunNamespace) -> Self {
        let tracks = header.columns.text_columns().map(|(_, column)| TextTrack {
            path: slot.entity_path(column_entity_path(column)),
            name: slot.run_label(&column.qualified_name()),
            now: None,
            time_points: TimePoints::default(),
            changes: Vec::new(),
        });
        Self(tracks.collect())
    }

    /// The entities.
    pub fn entity_paths(&self) -> Vec<EntityPath> {
        self.0.iter().map(|it| it.path.clone()).collect()
    }

    /// Takes the texts of one row.
    pub fn push_row(&mut self, time_point: TimePoint, texts: &[String]) {
        for (track, text) in self.0.iter_mut().zip(texts) {
            if track.now.as_ref() == Some(text) {
                continue;
            }
            track.changes.push(text.clone());
            track.now = Some(text.clone());
            track.time_points.push(time_point);
        }
    }

    /// Forgets all but the last change of each.
    pub fn forget_all_but_last(&mut self) {
        for track in &mut self.0 {
            track.time_points.keep_last(1);
            track.changes.drain(..track.changes.len().saturating_sub(1));
        }
    }

    /// Sends the changes and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for track in self.0.iter_mut().filter(|it| !it.changes.is_empty()) {
            let (axes, changes) = (track.time_points.time_columns(), std::mem::take(&mut track.changes));
            track.time_points.clear();
            let log = TextLog::update_fields()
                .with_many_level(changes.iter().map(|_| TextLogLevel::INFO))
                .with_many_text(changes.iter().map(|text| format!("{}: {text}", track.name)));
            let path = &track.path;
            stream.send_columns(path.clone(), axes.clone(), log.columns_of_unit_batches()?)?;
            let states = StateChange::new().with_state(changes);
            stream.send_columns(path.clone(), axes, states.columns_of_unit_batches()?)?;
        }
        Ok(())
    }
}
