//! Shows checks and faults as lanes of states over time.

use recording::{Status, StatusChange, StatusTrack};
use rerun::{
    Color, EntityPath, RecordingStream, RecordingStreamResult, StateChange, StateConfiguration,
};

use super::moments::{Moment, Moments};
use super::{ESTIMATE, LIMIT, REFERENCE};

/// What the lanes are below: checks, and inputs with faults.
pub(super) const GROUPS: [&str; 2] = ["checks", "faults"];

/// The lanes, with the changes that were not sent yet.
pub(super) struct States(Vec<Track>);

struct Track {
    of: StatusTrack,
    path: EntityPath,
    moments: Moments,
    states: Vec<&'static str>,
}

impl States {
    pub fn new(tracks: &[StatusTrack]) -> Self {
        let track = |(index, of): (usize, &StatusTrack)| Track {
            of: of.clone(),
            path: path(index + 1, of),
            moments: Moments::default(),
            states: Vec::new(),
        };
        Self(tracks.iter().enumerate().map(track).collect())
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Gives the states their colours.
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for track in &self.0 {
            let colors = [ESTIMATE, LIMIT, REFERENCE].map(Color::from);
            let states = [Status::Holds, Status::Violated, Status::Active].map(word);
            let look = StateConfiguration::new().with_values(states).with_colors(colors);
            stream.log_static(track.path.clone(), &look)?;
        }
        Ok(())
    }

    pub fn push(&mut self, moment: Moment, change: &StatusChange) {
        let mut tracks = self.0.iter_mut();
        if let Some(track) = tracks.find(|it| it.of == change.track) {
            track.moments.push(moment);
            track.states.push(word(change.status));
        }
    }

    /// Forgets all but the last change of each.
    pub fn forget_past(&mut self) {
        for track in &mut self.0 {
            track.moments.keep_last(1);
            track.states.drain(..track.states.len().saturating_sub(1));
        }
    }

    /// Sends the changes and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for track in self.0.iter_mut().filter(|it| !it.states.is_empty()) {
            let states = StateChange::new().with_state(track.states.drain(..));
            let axes = track.moments.axes();
            track.moments.clear();
            stream.send_columns(track.path.clone(), axes, states.columns_of_unit_batches()?)?;
        }
        Ok(())
    }
}

/// The viewer shows lanes in the order of their paths and writes these beside them, with a backslash before all but
/// the plainest letters.
fn path(number: usize, track: &StatusTrack) -> EntityPath {
    let group = match track {
        StatusTrack::Check(_) => GROUPS[0],
        StatusTrack::Fault(_) => GROUPS[1],
    };
    let plain = |c: char| if c.is_alphanumeric() || c == '.' { c } else { '_' };
    EntityPath::from(format!(
        "{group}/{number:02}_{}",
        track.name().chars().map(plain).collect::<String>()
    ))
}

/// What a lane says; the empty word leaves a gap.
fn word(state: Status) -> &'static str {
    match state {
        Status::Idle => "",
        Status::Holds => "holds",
        Status::Violated => "violated",
        Status::Active => "fault",
    }
}
