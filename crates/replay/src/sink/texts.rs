//! Logs recorded texts where they change, as events and as lanes of states.

use recording::RunHeader;
use rerun::{
    EntityPath, RecordingStream, RecordingStreamResult, StateChange, TextLog, TextLogLevel,
};

use super::contender::Contender;
use super::moments::{Moment, Moments};
use super::signals::signal_path;

/// One text with its changes that were not sent yet.
struct Track {
    path: EntityPath,
    name: String,
    /// What it is, once there was a row.
    now: Option<String>,
    moments: Moments,
    changes: Vec<String>,
}

/// Every recorded text.
pub(super) struct Texts(Vec<Track>);

impl Texts {
    /// One entity for each text, where the entities of numbers are.
    pub fn new(header: &RunHeader, contender: &Contender) -> Self {
        let tracks = header.columns.texts().map(|(_, column)| Track {
            path: contender.path(signal_path(column)),
            name: contender.label(&column.name()),
            now: None,
            moments: Moments::default(),
            changes: Vec::new(),
        });
        Self(tracks.collect())
    }

    /// The entities.
    pub fn paths(&self) -> Vec<EntityPath> {
        self.0.iter().map(|it| it.path.clone()).collect()
    }

    /// Takes the texts of one row.
    pub fn push(&mut self, moment: Moment, texts: &[String]) {
        for (track, text) in self.0.iter_mut().zip(texts) {
            if track.now.as_ref() == Some(text) {
                continue;
            }
            track.changes.push(text.clone());
            track.now = Some(text.clone());
            track.moments.push(moment);
        }
    }

    /// Forgets all but the last change of each.
    pub fn forget_past(&mut self) {
        for track in &mut self.0 {
            track.moments.keep_last(1);
            track.changes.drain(..track.changes.len().saturating_sub(1));
        }
    }

    /// Sends the changes and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for track in self.0.iter_mut().filter(|it| !it.changes.is_empty()) {
            let (axes, changes) = (track.moments.axes(), std::mem::take(&mut track.changes));
            track.moments.clear();
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
