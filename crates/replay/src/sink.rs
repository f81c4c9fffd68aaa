//! Writes a run for the Rerun viewer, into a file or over the network, in columns and with a layout.

use std::time::{Duration, Instant};

use diagnostics::Error;
use plugin::Diagram;
use recording::{Derived, Event, Recorded, Row, RunHeader, Sink, StatusChange};
use rerun::{
    ApplicationId, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, TextDocument,
};

use card::Card;
use contender::Contender;
use delivery::Delivery;
use diagrams::Diagrams;
use drawing::Drawing;
use layout::Layout;
use moments::Moments;
pub use target::Target;

mod arrows;
mod card;
mod contender;
mod courier;
mod delivery;
mod delta;
mod diagrams;
mod drawing;
mod events;
mod frame;
mod ground;
mod layout;
mod lead;
mod moments;
mod palette;
mod planes;
mod properties;
mod road;
mod scene;
mod signals;
mod states;
mod target;
mod texts;
mod thinned;
mod trace;
mod versus;

/// Rows of a second of simulated time that are replayed at most: more than any screen shows, and a fifth of the data of
/// a controller at 1 kHz. `run.mcap` has all rows.
const RATE: f64 = 200.0;
/// Rows that are sent at once to a file: enough that the cost per row is that of its numbers.
const FILE_BATCH: usize = 5_000;
/// A viewer gets what there is after this much wall clock: often enough for the eye, and seldom enough for a fast run, as each
/// batch costs the same for each curve, whatever it holds.
const LIVE_PERIOD: Duration = Duration::from_millis(100);
/// Numbers that are kept for a viewer that is slow; what comes on top of that it never gets.
const LIVE_NUMBERS: usize = 1_000_000;

// Okabe and Ito's colours, which can be told apart without red-green vision.
const REFERENCE: [u8; 3] = [230, 159, 0];
const PLANT: [u8; 3] = [86, 180, 233];
const ESTIMATE: [u8; 3] = [0, 158, 115];
const LIMIT: [u8; 3] = [213, 94, 0];
const MEASUREMENT: [u8; 3] = [170, 170, 170];
const WHITE: [u8; 3] = [235, 235, 235];

/// Takes a run and writes it for the Rerun viewer.
pub struct RerunSink {
    delivery: Delivery,
    /// Rows that may wait for a viewer.
    room: usize,
    /// Rows that were meant for the replay, and those of them that a viewer was too slow for.
    rows: [usize; 2],
    card: Card,
    layout: Layout,
    drawing: Drawing,
    sent: Instant,
}

impl RerunSink {
    /// Opens the recording and sends the layout, the run card and all that does not change.
    ///
    /// # Errors
    /// When the file cannot be made or no viewer listens at the address.
    pub fn new(header: &RunHeader, target: Target) -> Result<Self, Error> {
        let application = application(&header.scenario);
        // Its own properties hold the wall clock, and so does the timeline that is switched off there;
        // they would make every recording different. The random id must be: a viewer takes two
        // recordings of one id for one.
        let builder = RecordingStreamBuilder::new(application.clone()).send_properties(false);
        let delivery = Delivery::open(builder, &target)?;
        let live = delivery.is_live();
        let (drawing, charts) = Drawing::new(header, &Contender::default(), &[]);
        let mut sink = Self {
            delivery,
            room: (LIVE_NUMBERS / header.columns.numbers().len().max(1)).clamp(1, FILE_BATCH),
            rows: [0; 2],
            card: Card::new(header),
            layout: Layout {
                application,
                charts,
                derived: Vec::new(),
                planes: drawing.planes.shown(),
                diagrams: Diagrams::default(),
                states: !drawing.states.is_empty() || header.columns.texts().len() > 0,
                texts: drawing.texts.paths(),
                compared: false,
                body: header.view.pose.as_ref().map(|it| it.length as f32),
                live,
            },
            drawing,
            sent: Instant::now(),
        };
        let sent = sink.begin(header).map_err(|it| it.to_string());
        sink.delivery.begun(sent)?;
        Ok(sink)
    }

    fn begin(&self, header: &RunHeader) -> RecordingStreamResult<()> {
        let Some(stream) = self.delivery.stream() else {
            return Ok(());
        };
        // First, so that a viewer never shows a layout of its own.
        self.layout.send(&stream, None)?;
        stream.send_recording_name(header.title.as_str())?;
        stream.log_static("run", &self.card.running())?;
        stream.log_static("scenario", &TextDocument::new(header.source.whole()))?;
        self.drawing.describe(&stream)
    }

    /// Whether the rows since the last batch are worth a batch.
    fn due(&self) -> bool {
        let late = self.delivery.is_live() && self.sent.elapsed() >= LIVE_PERIOD;
        late || self.drawing.moments.len() >= FILE_BATCH
    }

    /// Sends what was collected, once what was sent before has arrived. For a viewer that is slow rows are kept, and then dropped.
    fn send(&mut self) -> Result<(), String> {
        let Some(stream) = self.delivery.stream() else {
            return Ok(());
        };
        if !self.delivery.accepts()? {
            if self.drawing.moments.len() >= self.room {
                self.rows[1] += self.drawing.skip();
            }
            return Ok(());
        }
        let sent = self.drawing.send(&stream, self.delivery.is_live());
        sent.map_err(|it| it.to_string())?;
        self.delivery.sent();
        self.sent = Instant::now();
        Ok(())
    }

    /// Sends what an analysis adds, after the last row.
    fn add(
        &mut self,
        send: impl FnOnce(&mut Self, &RecordingStream) -> RecordingStreamResult<()>,
    ) -> Result<(), Error> {
        let Some(stream) = self.delivery.stream() else {
            return Ok(());
        };
        let result = self.delivery.accepts_at_last().and_then(|accepts| {
            // A viewer that takes nothing is told of at the end.
            if accepts {
                send(self, &stream).map_err(|it| it.to_string())?;
                self.delivery.sent();
            }
            Ok(())
        });
        self.delivery.judge(result)
    }

    fn complete(&mut self, summary: &str, completed: bool) -> Result<(), String> {
        let Some(stream) = self.delivery.stream() else {
            return Ok(());
        };
        if !self.delivery.accepts_at_last()? {
            self.rows[1] += self.drawing.moments.len();
            self.delivery.stuck();
            return Ok(());
        }
        self.send()?;
        let end = || -> RecordingStreamResult<()> {
            let mut speeds = None;
            let mut bounds = None;
            if let Some(scene) = &self.drawing.scene {
                scene.finish(&stream)?;
                (speeds, bounds) = (scene.speeds(), scene.bounds());
            }
            // A viewer that watches keeps what its user made of the layout, unless there is more to see now.
            let added = !self.layout.derived.is_empty() || !self.layout.diagrams.is_empty();
            if added || !self.layout.live && self.drawing.scene.is_some() {
                self.layout.send(&stream, bounds)?;
            }
            stream.log_static("run", &self.card.finished(summary, completed, speeds))
        };
        end().map_err(|it| it.to_string())?;
        self.delivery.sent();
        drop(stream);
        self.delivery.end()
    }
}

impl Sink for RerunSink {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        if !self.delivery.is_open() {
            return Ok(());
        }
        self.card.end = time;
        if self.drawing.row(tick, time, row).is_none() {
            return Ok(());
        }
        self.rows[0] += 1;
        if !self.due() {
            return Ok(());
        }
        let result = self.send();
        self.delivery.judge(result)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        if self.delivery.is_open() {
            self.drawing.event(event);
        }
        Ok(())
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        if self.delivery.is_open() {
            self.drawing.status(change);
        }
        Ok(())
    }

    fn derived(&mut self, derived: &Derived) -> Result<(), Error> {
        self.add(|sink, stream| {
            let name = format!("{}: {}", derived.analysis, derived.group);
            sink.layout.derived.push((name, signals::derived_charts(derived)));
            let clock = &sink.drawing.clock;
            let moments: Moments = derived.time.iter().map(|time| clock.at(*time)).collect();
            signals::add(stream, derived, &moments.axes())
        })
    }

    fn diagram(&mut self, belongs: (&str, &str), diagram: &Diagram) -> Result<(), Error> {
        self.add(|sink, stream| sink.layout.diagrams.draw(stream, belongs, diagram))
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        let result = self.complete(summary, completed);
        self.delivery.judge(result)?;
        let [all, missing] = self.rows;
        if missing > 0 {
            self.delivery.warn(&format!("was too slow for {missing} of {all} rows"));
        }
        Ok(())
    }

    fn url(&self) -> Option<&str> {
        self.delivery.url()
    }

    fn warning(&self) -> Option<&str> {
        self.delivery.warning()
    }
}

/// The smallest of 1, 2, 5, 10, 20 .. or of 0.5, 0.2, 0.1 .. that is not below `least`.
fn round_number(least: f64) -> f64 {
    let decade = 10.0_f64.powf(least.max(f64::MIN_POSITIVE).log10().floor());
    let found = [1.0, 2.0, 5.0, 10.0].into_iter().find(|it| it * decade >= least);
    found.unwrap_or(10.0) * decade
}

/// The viewer keeps one layout per application, so every scenario is one.
fn application(scenario: &str) -> ApplicationId {
    let allowed = |it: char| it.is_ascii_lowercase() || it.is_ascii_digit();
    let name = scenario.to_ascii_lowercase();
    let name: String = name.chars().map(|it| if allowed(it) { it } else { '_' }).collect();
    ApplicationId::new_or_unknown(name)
}

#[cfg(test)]
mod tests {
    use super::round_number;

    #[test]
    fn round_numbers_are_those_of_a_ruler() {
        for (least, round) in [(0.03, 0.05), (0.2, 0.2), (0.66, 1.0), (7.0, 10.0), (4_321.0, 5e3)] {
            let found = round_number(least);
            assert!((found / round - 1.0).abs() < 1e-12, "{least}: {found}");
        }
    }
}
