//! Draws the status of checks and faults over time.

use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{StateChange, StateConfiguration};
use re_sdk_types::components::Color;
use recording::{CheckOrFaultStatus, StatusChange, StatusSource};

use super::timeline::{TimePoint, TimePoints};
use super::{ESTIMATE, LIMIT, MEASUREMENT, REFERENCE};

/// The roots of the tracks: checks, and inputs with faults.
pub(super) const GROUPS: [&str; 2] = ["checks", "faults"];

/// The tracks, with their unsent changes.
pub(super) struct StatusTracks(Vec<TrackDrawing>);

struct TrackDrawing {
    of: StatusSource,
    path: EntityPath,
    time_points: TimePoints,
    states: Vec<&'static str>,
}

impl StatusTracks {
    pub fn new(tracks: &[StatusSource]) -> Self {
        let track = |(index, of): (usize, &StatusSource)| TrackDrawing {
            of: of.clone(),
            path: status_track_path(index + 1, of),
            time_points: TimePoints::default(),
            states: Vec::new(),
        };
        Self(tracks.iter().enumerate().map(track).collect())
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Sends the colour of each status.
    pub fn send_status_colors(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for track in &self.0 {
            let colors = [MEASUREMENT, ESTIMATE, LIMIT, REFERENCE].map(Color::from);
            let states = [
                CheckOrFaultStatus::Pending,
                CheckOrFaultStatus::Holds,
                CheckOrFaultStatus::Violated,
                CheckOrFaultStatus::Active,
            ]
            .map(status_word);
            let look = StateConfiguration::new().with_values(states).with_colors(colors);
            stream.log_static(track.path.clone(), &look)?;
        }
        Ok(())
    }

    pub fn push_change(&mut self, time_point: TimePoint, change: &StatusChange) {
        let mut tracks = self.0.iter_mut();
        if let Some(track) = tracks.find(|it| it.of == change.track) {
            track.time_points.push(time_point);
            track.states.push(status_word(change.status));
        }
    }

    /// Forgets all but the last change of each.
    pub fn forget_all_but_last(&mut self) {
        for track in &mut self.0 {
            track.time_points.keep_last(1);
            track.states.drain(..track.states.len().saturating_sub(1));
        }
    }

    /// Sends the changes and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for track in self.0.iter_mut().filter(|it| !it.states.is_empty()) {
            let states = StateChange::new().with_state(track.states.drain(..));
            let axes = track.time_points.time_columns();
            track.time_points.clear();
            stream.send_columns(track.path.clone(), axes, states.columns_of_unit_batches()?)?;
        }
        Ok(())
    }
}

/// The viewer orders tracks by their paths and shows these as labels. Letters other than these would get a backslash.
fn status_track_path(number: usize, track: &StatusSource) -> EntityPath {
    let group = match track {
        StatusSource::Check(_) => GROUPS[0],
        StatusSource::Fault(_) => GROUPS[1],
    };
    let plain = |c: char| if c.is_alphanumeric() || c == '.' { c } else { '_' };
    EntityPath::from(format!("{group}/{number:02}_{}", track.name().chars().map(plain).collect::<String>()))
}

/// The word on a track; an empty word leaves a gap.
fn status_word(status: CheckOrFaultStatus) -> &'static str {
    match status {
        CheckOrFaultStatus::Idle => "",
        CheckOrFaultStatus::Pending => "pending",
        CheckOrFaultStatus::Holds => "holds",
        CheckOrFaultStatus::Violated => "violated",
        CheckOrFaultStatus::Active => "fault",
    }
}
