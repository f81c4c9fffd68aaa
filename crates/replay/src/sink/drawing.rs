//! Draws one run from its rows: curves, texts, status, diagrams, moving body and events.

use re_sdk::{RecordingStream, RecordingStreamResult};
use recording::{RecordedVariables, Row, RunEvent, RunHeader, StatusChange};

use super::events::UnsentEvents;
use super::run_slot::RunNamespace;
use super::scene::VehicleScene;
use super::signals::{ScalarSignals, TimeChart};
use super::status_tracks::StatusTracks;
use super::texts::RecordedTexts;
use super::timeline::{TimePoint, TimePoints, TimelineClock};
use super::xy_plots::XyPlots;
use super::{FRAME_RATE, RATE};

/// The drawing of a run, with its unsent rows.
pub(super) struct RunDrawing {
    pub signals: ScalarSignals,
    pub texts: RecordedTexts,
    pub states: StatusTracks,
    pub xy_plots: XyPlots,
    pub scene: Option<VehicleScene>,
    pub events: UnsentEvents,
    pub clock: TimelineClock,
    pub time_points: TimePoints,
    /// Those of the scene and the diagrams.
    frames: TimePoints,
    /// Every so many-th row is replayed, and every so many-th row moves the scene; the last one does both.
    strides: [u64; 2],
    last: u64,
}

impl RunDrawing {
    /// Plans the drawing and its plots.
    pub fn new(header: &RunHeader, slot: &RunNamespace) -> (Self, Vec<TimeChart>) {
        let view = &header.view;
        let (signals, charts) = ScalarSignals::new(header, slot);
        let drawing = Self {
            signals,
            texts: RecordedTexts::new(header, slot),
            states: StatusTracks::new(&header.status_tracks),
            xy_plots: XyPlots::from_plots(&view.xy_plots, slot),
            scene: VehicleScene::new(view, slot),
            events: UnsentEvents::new(slot),
            clock: TimelineClock::new(view.distance.clone()),
            time_points: TimePoints::default(),
            frames: TimePoints::default(),
            strides: row_and_scene_strides(header.step),
            last: (header.stop / header.step).round() as u64,
        };
        (drawing, charts)
    }

    /// Rows that are replayed, if the run goes to its end.
    pub fn expected_row_count(&self) -> usize {
        usize::try_from(self.last / self.strides[0]).map_or(usize::MAX, |rows| rows.saturating_add(1))
    }

    /// Sends the static parts.
    pub fn send_static(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.signals.send_names(stream)?;
        self.states.send_status_colors(stream)?;
        self.xy_plots.send_static(stream)?;
        self.scene.as_ref().map_or(Ok(()), |it| it.send_static(stream))
    }

    /// Takes a row; returns its time point, if the row is replayed.
    pub fn push_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>) -> Option<TimePoint> {
        let time_point = self.clock.time_point_of_row(time, row);
        self.texts.push_row(time_point, row.texts());
        let [due, moves] = self.strides.map(|stride| tick.is_multiple_of(stride) || tick == self.last);
        if moves {
            self.frames.push(time_point);
            self.xy_plots.push_row(time_point, time, row);
            if let Some(scene) = &mut self.scene {
                scene.push_row(time_point, time, row);
            }
        }
        if !due {
            return None;
        }
        self.time_points.push(time_point);
        self.signals.push_row(time, row);
        Some(time_point)
    }

    pub fn push_event(&mut self, event: &RunEvent) {
        self.events.push(self.clock.time_point_at(event.time), event);
    }

    pub fn push_status_change(&mut self, change: &StatusChange) {
        self.states.push_change(self.clock.time_point_at(change.time), change);
    }

    /// Sends the collected rows and forgets them. With `live` the driven line grows with them.
    pub fn send_collected_rows(&mut self, stream: &RecordingStream, live: bool) -> RecordingStreamResult<()> {
        self.send_rows(stream, live)?;
        self.texts.send(stream)?;
        self.states.send(stream)?;
        self.events.send(stream)
    }

    fn send_rows(&mut self, stream: &RecordingStream, live: bool) -> RecordingStreamResult<()> {
        if self.time_points.is_empty() {
            return Ok(());
        }
        self.signals.send(stream, &self.time_points)?;
        self.time_points.clear();
        let axes = self.frames.time_columns();
        self.frames.clear();
        self.xy_plots.send(stream, &axes)?;
        if let Some(scene) = &mut self.scene {
            scene.send(stream, &axes)?;
            if live {
                scene.send_grown_driven_line(stream)?;
            }
        }
        Ok(())
    }

    /// Drops the collected rows; returns their number. The last status and the last text stay: they hold from then on.
    pub fn drop_collected_rows(&mut self) -> usize {
        let dropped = self.time_points.len();
        // A disabled stream discards them.
        let _ = self.send_rows(&RecordingStream::disabled(), true);
        self.texts.forget_all_but_last();
        self.states.forget_all_but_last();
        self.events.forget_all_but_last();
        dropped
    }
}

/// Every so many-th row is replayed, and a multiple of that moves the scene, with rows every `step` [s].
fn row_and_scene_strides(step: f64) -> [u64; 2] {
    let every = |rate: f64, step: f64| ((1.0 / rate / step + 1e-9) as u64).max(1);
    let row = every(RATE, step);
    [row, row * every(FRAME_RATE, step * row as f64)]
}

#[cfg(test)]
mod tests {
    use super::row_and_scene_strides;

    #[test]
    fn scenes_move_as_fast_as_the_eye_sees_at_most() {
        for (step, expected) in
            [(0.001, [5, 20]), (0.002, [2, 10]), (0.01, [1, 2]), (0.1, [1, 1]), (0.003, [1, 6])]
        {
            assert_eq!(row_and_scene_strides(step), expected, "{step} s");
        }
    }
}
