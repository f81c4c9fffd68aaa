//! Logs recorded texts where they change.

use rerun::{EntityPath, RecordingStream, RecordingStreamResult, TextLog, TextLogLevel};

use super::axes;
use super::signals::signal_path;
use crate::sink::Header;

/// One text with its changes that were not sent yet.
struct Track {
    path: EntityPath,
    name: String,
    /// What it is, once there was a row.
    now: Option<String>,
    times: Vec<i64>,
    steps: Vec<i64>,
    changes: Vec<String>,
}

/// Every recorded text.
pub(super) struct Texts(Vec<Track>);

impl Texts {
    /// One entity for each text, where the entities of numbers are.
    pub fn new(header: &Header) -> Self {
        let tracks = header.texts.iter().map(|column| Track {
            path: signal_path(column),
            name: column.name(),
            now: None,
            times: Vec::new(),
            steps: Vec::new(),
            changes: Vec::new(),
        });
        Self(tracks.collect())
    }

    /// The entities.
    pub fn paths(&self) -> Vec<EntityPath> {
        self.0.iter().map(|it| it.path.clone()).collect()
    }

    /// Takes the texts of one row.
    pub fn push(&mut self, (time, step): (i64, i64), texts: &[String]) {
        for (track, text) in self.0.iter_mut().zip(texts) {
            if track.now.as_ref() == Some(text) {
                continue;
            }
            track.changes.push(format!("{}: {text}", track.name));
            track.now = Some(text.clone());
            track.times.push(time);
            track.steps.push(step);
        }
    }

    /// Sends the changes and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for track in self.0.iter_mut().filter(|it| !it.changes.is_empty()) {
            let levels = track.changes.iter().map(|_| TextLogLevel::INFO);
            let log = TextLog::update_fields().with_many_level(levels);
            let log = log.with_many_text(track.changes.drain(..));
            let axes = axes(&track.times, &track.steps);
            stream.send_columns(track.path.clone(), axes, log.columns_of_unit_batches()?)?;
            track.times.clear();
            track.steps.clear();
        }
        Ok(())
    }
}
