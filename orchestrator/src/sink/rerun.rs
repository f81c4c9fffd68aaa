//! Writes a run for the Rerun viewer, into a file or over the network, in columns and with a layout.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use rerun::{
    ApplicationId, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, TextDocument,
};

use crate::error::Error;
use crate::sink::{Change, Derived, Event, Header, Row, Sink};
use card::Card;
use contender::Contender;
use drawing::Drawing;
use layout::Layout;
use moments::Moments;
pub use target::Target;
use target::{CONNECT_PATIENCE, open};

mod arrows;
mod card;
mod contender;
mod delta;
mod drawing;
mod events;
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
/// Simulated time that is sent at once to a viewer [ns].
const LIVE_BATCH: i64 = 1_000_000_000;
/// A viewer gets what there is after this much wall clock, so that a slow run moves smoothly.
const LIVE_PERIOD: Duration = Duration::from_millis(100);
/// How long the disk or the viewer may take to accept a batch.
const PATIENCE: Duration = Duration::from_secs(10);

// Okabe and Ito's colours, which can be told apart without red-green vision.
const REFERENCE: [u8; 3] = [230, 159, 0];
const PLANT: [u8; 3] = [86, 180, 233];
const ESTIMATE: [u8; 3] = [0, 158, 115];
const LIMIT: [u8; 3] = [213, 94, 0];
const MEASUREMENT: [u8; 3] = [170, 170, 170];
const WHITE: [u8; 3] = [235, 235, 235];

/// Takes a run and writes it for the Rerun viewer.
pub struct RerunSink {
    /// `None` once nothing more can or shall be written.
    stream: Option<RecordingStream>,
    /// What errors call the recording.
    place: PathBuf,
    live: bool,
    url: Option<String>,
    warning: Option<String>,
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
    pub fn new(header: &Header, target: Target) -> Result<Self, Error> {
        let (place, live) = (target.place(), target.is_live());
        let application = application(&header.scenario);
        // Its own properties hold the wall clock, and so does the timeline that is switched off below;
        // they would make every recording different. The random id must be: a viewer takes two
        // recordings of one id for one.
        let builder = RecordingStreamBuilder::new(application.clone()).send_properties(false);
        let failed = |what: String| Error::output(&place, what);
        let (stream, url) = open(builder, &target).map_err(failed)?;
        if !stream.is_enabled() {
            return Err(failed("the environment variable RERUN switches it off".into()));
        }
        stream.set_log_time_enabled(false);
        let (drawing, charts) = Drawing::new(header, &Contender::default(), &[]);
        let mut sink = Self {
            stream: Some(stream),
            live,
            url,
            warning: None,
            card: Card::new(header),
            layout: Layout {
                application,
                charts,
                derived: Vec::new(),
                planes: drawing.planes.shown(),
                states: !drawing.states.is_empty() || !header.texts.is_empty(),
                texts: drawing.texts.paths(),
                compared: false,
                body: header.view.pose.as_ref().map(|it| it.length as f32),
                live,
            },
            drawing,
            sent: Instant::now(),
            place,
        };
        sink.open_recording(header).map_err(|what| Error::output(&sink.place, what))?;
        Ok(sink)
    }

    fn open_recording(&mut self, header: &Header) -> Result<(), String> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let begin = || -> RecordingStreamResult<()> {
            // First, so that a viewer never shows a layout of its own.
            self.layout.send(stream, None)?;
            stream.send_recording_name(header.title.as_str())?;
            stream.log_static("run", &self.card.running())?;
            stream.log_static("scenario", &TextDocument::new(header.source.whole()))?;
            self.drawing.describe(stream)
        };
        let result = begin().map_err(|it| it.to_string());
        let result = result.and_then(|()| settle(stream, CONNECT_PATIENCE));
        if result.is_err() {
            self.abandon();
        }
        result
    }

    /// Whether the rows since the last batch are worth a batch.
    fn due(&self) -> bool {
        if !self.live {
            return self.drawing.moments.len() >= FILE_BATCH;
        }
        self.drawing.moments.span() >= LIVE_BATCH || self.sent.elapsed() >= LIVE_PERIOD
    }

    /// Sends what was collected, once the batch before has arrived: so errors are noticed, a slow
    /// reader holds up the run instead of filling the memory, and writing overlaps with computing.
    fn send(&mut self) -> Result<(), String> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        settle(stream, PATIENCE)?;
        self.drawing.send(stream, self.live).map_err(|it| it.to_string())?;
        self.sent = Instant::now();
        Ok(())
    }

    fn add(&self, derived: &Derived) -> Result<(), String> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let moments: Moments =
            derived.time.iter().map(|time| self.drawing.clock.at(*time)).collect();
        signals::add(stream, derived, &moments.axes()).map_err(|it| it.to_string())?;
        settle(stream, PATIENCE)
    }

    fn complete(&mut self, summary: &str, completed: bool) -> Result<(), String> {
        self.send()?;
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let end = || -> RecordingStreamResult<()> {
            let mut speeds = None;
            let mut bounds = None;
            if let Some(scene) = &self.drawing.scene {
                scene.finish(stream)?;
                (speeds, bounds) = (scene.speeds(), scene.bounds());
            }
            // A viewer that watches keeps what its user made of the layout.
            if !self.live && (self.drawing.scene.is_some() || !self.layout.derived.is_empty()) {
                self.layout.send(stream, bounds)?;
            }
            stream.log_static("run", &self.card.finished(summary, completed, speeds))
        };
        end().map_err(|it| it.to_string())?;
        settle(stream, PATIENCE)
    }

    /// Gives up the stream without waiting for it: dropping one whose reader is stuck blocks for ever.
    fn abandon(&mut self) {
        std::mem::forget(self.stream.take());
    }

    /// A viewer that is lost does not concern the run; a file that cannot be written does.
    fn judge(&mut self, result: Result<(), String>) -> Result<(), Error> {
        let Err(what) = result else {
            return Ok(());
        };
        self.abandon();
        if self.live {
            let place = self.place.display();
            self.warning = Some(format!("the viewer at {place} was lost: {what}"));
            return Ok(());
        }
        Err(Error::output(&self.place, what))
    }
}

impl Sink for RerunSink {
    fn row(&mut self, tick: u64, time: f64, row: &Row) -> Result<(), Error> {
        if self.stream.is_none() {
            return Ok(());
        }
        self.card.end = time;
        if self.drawing.row(tick, time, row).is_none() || !self.due() {
            return Ok(());
        }
        let result = self.send();
        self.judge(result)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        if self.stream.is_some() {
            self.drawing.event(event);
        }
        Ok(())
    }

    fn change(&mut self, change: &Change) -> Result<(), Error> {
        self.drawing.change(change);
        Ok(())
    }

    fn derived(&mut self, derived: &Derived) -> Result<(), Error> {
        let name = format!("{}: {}", derived.analysis, derived.group);
        self.layout.derived.push((name, signals::derived_charts(derived)));
        let result = self.add(derived);
        self.judge(result)
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        let result = self.complete(summary, completed);
        self.judge(result)?;
        if !self.live {
            // The last stream that goes writes the footer and closes the file.
            self.stream = None;
        }
        Ok(())
    }

    fn url(&self) -> Option<&str> {
        self.url.as_deref()
    }

    fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }
}

/// The smallest of 1, 2, 5, 10, 20 .. or of 0.5, 0.2, 0.1 .. that is not below `least`.
fn round_number(least: f64) -> f64 {
    let decade = 10.0_f64.powf(least.max(f64::MIN_POSITIVE).log10().floor());
    let found = [1.0, 2.0, 5.0, 10.0].into_iter().find(|it| it * decade >= least);
    found.unwrap_or(10.0) * decade
}

/// Waits until all that was sent is written or handed over.
fn settle(stream: &RecordingStream, patience: Duration) -> Result<(), String> {
    let accepted = stream.flush_with_timeout(patience);
    accepted.map_err(|it| format!("it takes no more data (disk full, or connection lost?): {it}"))
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
