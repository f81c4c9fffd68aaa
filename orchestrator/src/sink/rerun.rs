//! Writes a run for the Rerun viewer, into a file or over the network, in columns and with a layout.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use rerun::{
    ApplicationId, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, TextDocument,
    TextLog, TextLogLevel, TimeColumn,
};

use crate::error::Error;
use crate::sink::{Derived, Event, Header, Level, Row, Sink};
use card::Card;
use layout::Layout;
use scene::Scene;
use signals::Signals;
pub use target::Target;
use target::{CONNECT_PATIENCE, open};
use texts::Texts;

mod card;
mod layout;
mod scene;
mod signals;
mod target;
mod texts;
mod trace;

/// Timeline of the simulated time.
const TIME: &str = "sim_time";
/// Timeline of the communication points' numbers.
const STEP: &str = "step";

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
    signals: Signals,
    texts: Texts,
    scene: Option<Scene>,
    times: Vec<i64>,
    steps: Vec<i64>,
    events: Vec<(i64, Event)>,
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
        let (signals, charts) = Signals::new(header);
        let texts = Texts::new(header);
        let pose = header.view.pose.clone();
        let body = pose.as_ref().map(|it| it.length as f32);
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
                texts: texts.paths(),
                body,
                live,
            },
            signals,
            texts,
            scene: pose.map(Scene::new),
            times: Vec::new(),
            steps: Vec::new(),
            events: Vec::new(),
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
            stream.log_static("scenario", &TextDocument::new(header.text.as_str()))?;
            self.signals.describe(stream)?;
            self.scene.as_ref().map_or(Ok(()), |it| it.describe(stream))
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
            return self.times.len() >= FILE_BATCH;
        }
        let (first, last) = (self.times.first(), self.times.last());
        let span = first.zip(last).map_or(0, |(first, last)| last - first);
        span >= LIVE_BATCH || self.sent.elapsed() >= LIVE_PERIOD
    }

    /// Sends what was collected, once the batch before has arrived: so errors are noticed, a slow
    /// reader holds up the run instead of filling the memory, and writing overlaps with computing.
    fn send(&mut self) -> Result<(), String> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        settle(stream, PATIENCE)?;
        let axes = axes(&self.times, &self.steps);
        let mut columns = || -> RecordingStreamResult<()> {
            if !self.times.is_empty() {
                self.signals.send(stream, &axes)?;
            }
            if let Some(scene) = self.scene.as_mut().filter(|_| !self.times.is_empty()) {
                scene.send(stream, &axes)?;
                if self.live {
                    scene.draw(stream)?;
                }
            }
            self.texts.send(stream)?;
            send_events(stream, &mut self.events, self.card.step)
        };
        columns().map_err(|it| it.to_string())?;
        self.times.clear();
        self.steps.clear();
        self.sent = Instant::now();
        Ok(())
    }

    fn add(&self, derived: &Derived) -> Result<(), String> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let times: Vec<_> = derived.time.iter().map(|time| nanoseconds(*time)).collect();
        let steps: Vec<_> =
            derived.time.iter().map(|time| (time / self.card.step).round() as i64).collect();
        signals::add(stream, derived, &axes(&times, &steps)).map_err(|it| it.to_string())?;
        settle(stream, PATIENCE)
    }

    fn complete(&mut self, summary: &str, completed: bool) -> Result<(), String> {
        let end = self.times.last().copied();
        self.card.end = end.map_or(self.card.end, |it| it as f64 * 1e-9);
        self.send()?;
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let end = || -> RecordingStreamResult<()> {
            let mut speeds = None;
            let mut bounds = None;
            if let Some(scene) = &self.scene {
                scene.finish(stream)?;
                (speeds, bounds) = (scene.speeds(), scene.bounds());
            }
            // A viewer that watches keeps what its user made of the layout.
            if !self.live && (self.scene.is_some() || !self.layout.derived.is_empty()) {
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
        let instant = (nanoseconds(time), tick as i64);
        self.times.push(instant.0);
        self.steps.push(instant.1);
        self.signals.push(&row.numbers);
        self.texts.push(instant, &row.texts);
        if let Some(scene) = &mut self.scene {
            scene.push(instant, &row.numbers);
        }
        if !self.due() {
            return Ok(());
        }
        self.card.end = time;
        let result = self.send();
        self.judge(result)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        if self.stream.is_some() {
            self.events.push((nanoseconds(event.time), event.clone()));
        }
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

fn nanoseconds(time: f64) -> i64 {
    (time * 1e9).round() as i64
}

/// The two time axes that every column has; without either of them it would vanish from that timeline.
fn axes(times: &[i64], steps: &[i64]) -> [TimeColumn; 2] {
    [
        TimeColumn::new_duration_nanos(TIME, times.iter().copied()),
        TimeColumn::new_sequence(STEP, steps.iter().copied()),
    ]
}

fn send_events(
    stream: &RecordingStream,
    events: &mut Vec<(i64, Event)>,
    step: f64,
) -> RecordingStreamResult<()> {
    if events.is_empty() {
        return Ok(());
    }
    let times: Vec<i64> = events.iter().map(|(time, _)| *time).collect();
    let steps: Vec<i64> = events.iter().map(|(_, it)| (it.time / step).round() as i64).collect();
    let texts = events.iter().map(|(_, it)| format!("{}: {}", it.source, it.message));
    let levels = events.iter().map(|(_, it)| match it.level {
        Level::Info => TextLogLevel::INFO,
        Level::Warning => TextLogLevel::WARN,
        Level::Error => TextLogLevel::ERROR,
    });
    let log = TextLog::update_fields().with_many_text(texts).with_many_level(levels);
    stream.send_columns("events", axes(&times, &steps), log.columns_of_unit_batches()?)?;
    events.clear();
    Ok(())
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
