//! Draws one run: its curves, texts, states, diagrams, moving body and events, from its rows on.

use recording::{Event, NumberIndex, Recorded, Row, RunHeader, StatusChange};
use rerun::{RecordingStream, RecordingStreamResult};

use super::RATE;
use super::contender::Contender;
use super::events::Events;
use super::moments::{Clock, Moment, Moments};
use super::planes::Planes;
use super::scene::Scene;
use super::signals::{Chart, Signals};
use super::states::States;
use super::texts::Texts;

/// What is shown of a run, with what was not sent yet.
pub(super) struct Drawing {
    pub signals: Signals,
    pub texts: Texts,
    pub states: States,
    pub planes: Planes,
    pub scene: Option<Scene>,
    pub events: Events,
    pub clock: Clock,
    pub moments: Moments,
    /// One row in so many is replayed, and the last one.
    stride: u64,
    last: u64,
}

impl Drawing {
    /// Plans what is shown, and the plots of it; the run lacks these columns of its rows.
    pub fn new(
        header: &RunHeader,
        contender: &Contender,
        lacks: &[NumberIndex<Recorded>],
    ) -> (Self, Vec<Chart>) {
        let view = &header.view;
        let (signals, charts) = Signals::new(header, contender, lacks);
        let drawing = Self {
            signals,
            texts: Texts::new(header, contender),
            states: States::new(&header.status_tracks),
            planes: Planes::new(&view.planes, header.columns.numbers().len(), contender),
            scene: Scene::new(view, contender),
            events: Events::new(contender),
            clock: Clock::new(header.step, view.distance.clone()),
            moments: Moments::default(),
            stride: ((1.0 / RATE / header.step + 1e-9) as u64).max(1),
            last: (header.stop / header.step).round() as u64,
        };
        (drawing, charts)
    }

    /// Sends what does not change.
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.signals.describe(stream)?;
        self.states.describe(stream)?;
        self.planes.describe(stream)?;
        self.scene.as_ref().map_or(Ok(()), |it| it.describe(stream))
    }

    /// Takes one row and tells its moment, if it is replayed.
    pub fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Option<Moment> {
        let moment = self.clock.row(time, row);
        self.texts.push(moment, row.texts());
        if !tick.is_multiple_of(self.stride) && tick != self.last {
            return None;
        }
        self.moments.push(moment);
        self.signals.push(time, row);
        self.planes.push(moment, time, row);
        if let Some(scene) = &mut self.scene {
            scene.push(moment, time, row);
        }
        Some(moment)
    }

    pub fn event(&mut self, event: &Event) {
        self.events.push(self.clock.at(event.time), event);
    }

    pub fn status(&mut self, change: &StatusChange) {
        self.states.push(self.clock.at(change.time), change);
    }

    /// Sends what was collected and forgets it; `live` tells whether the driven line is to grow.
    pub fn send(&mut self, stream: &RecordingStream, live: bool) -> RecordingStreamResult<()> {
        self.send_rows(stream, live)?;
        self.texts.send(stream)?;
        self.states.send(stream)?;
        self.events.send(stream)
    }

    fn send_rows(&mut self, stream: &RecordingStream, live: bool) -> RecordingStreamResult<()> {
        if self.moments.is_empty() {
            return Ok(());
        }
        let axes = self.moments.axes();
        self.moments.clear();
        self.signals.send(stream, &axes)?;
        self.planes.send(stream, &axes)?;
        if let Some(scene) = &mut self.scene {
            scene.send(stream, &axes)?;
            if live {
                scene.draw(stream)?;
            }
        }
        Ok(())
    }

    /// Drops the rows that were collected and tells how many. Of states and texts the last one stays, which holds from then on.
    pub fn skip(&mut self) -> usize {
        let dropped = self.moments.len();
        // Sent to nobody, all of it is forgotten.
        let _ = self.send_rows(&RecordingStream::disabled(), true);
        self.texts.forget_past();
        self.states.forget_past();
        self.events.forget_past();
        dropped
    }
}
