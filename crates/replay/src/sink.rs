//! Writes a run with its layout for the Rerun viewer, into a file or over the network.

use std::time::{Duration, Instant};

use diagnostics::Error;
use plugin::Diagram;
use re_sdk::{ApplicationId, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};
use re_sdk_types::archetypes::TextDocument;
use recording::{DerivedColumns, Event, Notice, Recorded, Row, RunHeader, Sink, StatusChange};

use card::RunCard;
use diagrams::Diagrams;
use drawing::RunDrawing;
use layout::Layout;
use run_slot::RunSlot;
pub use target::Target;
use timeline::TimePoints;
use transport::Transport;

mod arrival_times;
mod arrows;
mod axis;
mod cameras;
mod card;
mod comparison_drawing;
mod decimation;
mod diagrams;
mod drawing;
mod events;
mod flush_worker;
mod frame;
mod graph;
mod ground;
mod layout;
mod legend;
mod palette;
mod properties;
mod road;
mod run_slot;
mod scene;
mod signals;
mod status_tracks;
mod target;
mod texts;
mod thinned_samples;
mod time_gap;
mod timeline;
mod trace;
mod transport;
mod xy_plots;

/// Replayed rows per second of simulated time at most: more than any screen shows, and a fifth of the data of a controller at
/// 1 kHz. `run.mcap` has all rows.
const RATE: f64 = 200.0;
/// Pictures per second of simulated time at most, of the scene and the diagrams.
const FRAME_RATE: f64 = 50.0;
/// Rows of a batch to a file at most: enough to make the cost per batch small, and few enough to be written while the run goes on.
const FILE_BATCH: usize = 5_000;
/// A file gets its layout at the end, with axes that fit. After so much time by the clock a killed run is to have one, too: to
/// send it takes as long as a second of simulated time does.
const LAY_OUT: Duration = Duration::from_secs(1);
/// Wall-clock time between batches to a viewer: often enough for the eye, and seldom enough for a fast run, as the cost of a batch
/// does not depend on its rows.
const LIVE_PERIOD: Duration = Duration::from_millis(100);
/// Numbers kept for a slow viewer; beyond that it misses rows.
const LIVE_NUMBERS: usize = 1_000_000;

// Okabe and Ito's colours, distinct without red-green vision.
const REFERENCE: [u8; 3] = [230, 159, 0];
const PLANT: [u8; 3] = [86, 180, 233];
const ESTIMATE: [u8; 3] = [0, 158, 115];
const LIMIT: [u8; 3] = [213, 94, 0];
const MEASUREMENT: [u8; 3] = [170, 170, 170];
const WHITE: [u8; 3] = [235, 235, 235];

/// Writes a run for the Rerun viewer.
pub struct RerunSink {
    transport: Transport,
    /// Rows that may wait for a viewer, at most.
    room: usize,
    /// Rows for the replay, and how many of them a slow viewer missed.
    rows: [usize; 2],
    card: RunCard,
    layout: Layout,
    drawing: RunDrawing,
    /// Rows of a batch to a file.
    batch: usize,
    /// When it was opened, and when the last batch was sent.
    opened: Instant,
    sent: Instant,
    /// The layout was sent.
    laid_out: bool,
}

impl RerunSink {
    /// Opens the recording and sends its static parts, the layout first.
    ///
    /// # Errors
    /// When the file cannot be made or no viewer listens at the address.
    pub fn new(header: &RunHeader, target: Target) -> Result<Self, Error> {
        let application = application(&header.scenario);
        // Its own properties hold the wall clock, and so does the timeline that is switched off there;
        // they would make every recording different. The random id must be: a viewer takes two
        // recordings of one id for one.
        let builder = RecordingStreamBuilder::new(application.clone()).send_properties(false);
        let transport = Transport::open(builder, &target)?;
        let live = transport.is_live();
        let (drawing, charts) = RunDrawing::new(header, &RunSlot::default(), &[]);
        let mut sink = Self {
            transport,
            room: (LIVE_NUMBERS / header.columns.numbers().len().max(1)).clamp(1, FILE_BATCH),
            rows: [0; 2],
            card: RunCard::new(header),
            layout: Layout {
                application,
                charts,
                derived: Vec::new(),
                xy_plots: drawing.xy_plots.views(),
                diagrams: Diagrams::default(),
                states: !drawing.states.is_empty() || header.columns.texts().len() > 0,
                texts: drawing.texts.paths(),
                compared: false,
                body: header.view.pose.as_ref().map(|it| it.length as f32),
                graph: !header.view.graph.nodes.is_empty(),
                live,
            },
            batch: even(drawing.rows()),
            drawing,
            opened: Instant::now(),
            sent: Instant::now(),
            laid_out: false,
        };
        let sent = sink.begin(header).map_err(|it| it.to_string());
        sink.transport.begun(sent)?;
        Ok(sink)
    }

    fn begin(&mut self, header: &RunHeader) -> RecordingStreamResult<()> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        if self.transport.is_live() {
            // First: else the viewer would show a layout of its own.
            self.lay_out(&stream)?;
        }
        stream.send_recording_name(header.title.as_str())?;
        stream.log_static("run", &self.card.running())?;
        stream.log_static("scenario", &TextDocument::new(header.source.concatenated()))?;
        graph::draw(&header.view.graph, &stream)?;
        self.drawing.describe(&stream)
    }

    /// Sends the layout of a run that goes on.
    fn lay_out(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.laid_out = true;
        self.layout.send(stream, None)
    }

    /// Whether a batch is due.
    fn due(&self) -> bool {
        let late = self.transport.is_live() && self.sent.elapsed() >= LIVE_PERIOD;
        late || self.drawing.time_points.len() >= self.batch
    }

    /// Sends the collected rows, once the previous batch has arrived. For a slow viewer rows wait while there is room; then they are dropped.
    fn send(&mut self) -> Result<(), String> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        if !self.transport.accepts()? {
            if self.drawing.time_points.len() >= self.room {
                self.rows[1] += self.drawing.skip();
            }
            return Ok(());
        }
        if !self.laid_out && self.opened.elapsed() >= LAY_OUT {
            self.lay_out(&stream).map_err(|it| it.to_string())?;
        }
        let sent = self.drawing.send(&stream, self.transport.is_live());
        sent.map_err(|it| it.to_string())?;
        self.transport.sent();
        self.sent = Instant::now();
        Ok(())
    }

    /// Sends data of an analysis, after the last row.
    fn add(
        &mut self,
        send: impl FnOnce(&mut Self, &RecordingStream) -> RecordingStreamResult<()>,
    ) -> Result<(), Error> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        let result = self.transport.accepts_at_last().and_then(|accepts| {
            // A viewer that accepts nothing gets a warning at the end.
            if accepts {
                send(self, &stream).map_err(|it| it.to_string())?;
                self.transport.sent();
            }
            Ok(())
        });
        self.transport.judge(result)
    }

    fn complete(&mut self, summary: &str, completed: bool) -> Result<(), String> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        // A file is written while the rest is drawn; what goes wrong is told when it is closed.
        let live = self.transport.is_live();
        if live && !self.transport.accepts_at_last()? {
            self.rows[1] += self.drawing.time_points.len();
            self.transport.stuck();
            return Ok(());
        }
        let mut end = || -> RecordingStreamResult<()> {
            self.drawing.send(&stream, live)?;
            self.drawing.signals.send_limits(&stream, &self.drawing.clock)?;
            let mut speeds = None;
            let mut bounds = None;
            if let Some(scene) = &self.drawing.scene {
                scene.finish(&stream)?;
                (speeds, bounds) = (scene.speeds(), scene.bounds());
            }
            // A connected viewer keeps the layout of its user, unless there are new views.
            let added = !self.layout.derived.is_empty() || !self.layout.diagrams.is_empty();
            if added || !self.layout.live {
                self.layout.fit(|path| self.drawing.signals.span(path));
                self.layout.send(&stream, bounds)?;
            }
            stream.log_static("run", &self.card.finished(summary, completed, speeds))
        };
        end().map_err(|it| it.to_string())?;
        self.transport.sent();
        drop(stream);
        self.transport.end()
    }
}

impl Sink for RerunSink {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        if !self.transport.is_open() {
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
        self.transport.judge(result)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        if self.transport.is_open() {
            self.drawing.event(event);
        }
        Ok(())
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        if self.transport.is_open() {
            self.drawing.status(change);
        }
        Ok(())
    }

    fn derived(&mut self, derived: &DerivedColumns) -> Result<(), Error> {
        self.add(|sink, stream| {
            sink.layout.add(derived);
            let clock = &sink.drawing.clock;
            let time_points: TimePoints = derived.time.iter().map(|time| clock.at(*time)).collect();
            signals::add(stream, derived, &time_points)
        })
    }

    fn diagram(&mut self, analysis: &str, group: &str, diagram: &Diagram) -> Result<(), Error> {
        self.add(|sink, stream| sink.layout.diagrams.draw(stream, analysis, group, diagram))
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        let result = self.complete(summary, completed);
        self.transport.judge(result)?;
        let [all, missing] = self.rows;
        if missing > 0 {
            self.transport.warn(&format!("was too slow for {missing} of {all} rows"));
        }
        Ok(())
    }

    fn notices(&mut self) -> Vec<Notice> {
        self.transport.notices()
    }
}

/// The rows of each batch to a file when there are so many rows: batches are alike, as the run waits for the last one.
fn even(rows: usize) -> usize {
    rows.max(1).div_ceil(rows.div_ceil(FILE_BATCH).max(1))
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
    use super::{even, round_number};

    #[test]
    fn batches_of_a_run_are_alike() {
        for (rows, batch) in [(0, 1), (1, 1), (5_000, 5_000), (10_401, 3_467), (20_000, 5_000)] {
            assert_eq!(even(rows), batch, "{rows} rows");
        }
        assert!((4_990..=5_000).contains(&even(usize::MAX)));
    }

    #[test]
    fn round_numbers_are_those_of_a_ruler() {
        for (least, round) in [(0.03, 0.05), (0.2, 0.2), (0.66, 1.0), (7.0, 10.0), (4_321.0, 5e3)] {
            let found = round_number(least);
            assert!((found / round - 1.0).abs() < 1e-12, "{least}: {found}");
        }
    }
}
