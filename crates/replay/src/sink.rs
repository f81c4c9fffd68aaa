//! Writes a run with its layout for the Rerun viewer, into a file or over the network.

use std::time::{Duration, Instant};

use diagnostics::Error;
use plugin::Diagram;
use re_sdk::{ApplicationId, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};
use re_sdk_types::archetypes::TextDocument;
use recording::{
    AnalysisColumns, RecordedVariables, Row, RunEvent, RunHeader, Sink, SinkNotice, StatusChange,
    TestTrackLayout,
};

use card::RunCard;
use diagrams::AnalysisDiagrams;
use drawing::RunDrawing;
use layout::ViewerLayout;
use run_slot::RunNamespace;
use scene::GhostPath;
pub use target::RecordingTarget;
use timeline::TimePoints;
use transport::RecordingTransport;

mod arrival_times;
mod arrows;
mod axis;
mod cameras;
mod card;
mod chart_sizes;
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
mod test_track;
mod texts;
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
    transport: RecordingTransport,
    /// Rows that may wait for a viewer, at most.
    room: usize,
    /// Rows for the replay, and how many of them a slow viewer missed.
    rows: [usize; 2],
    card: RunCard,
    layout: ViewerLayout,
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
    pub fn new(header: &RunHeader, target: RecordingTarget) -> Result<Self, Error> {
        let application = application_id(&header.scenario);
        // Its own properties hold the wall clock, and so does the timeline that is switched off there;
        // they would make every recording different. The random id must be: a viewer takes two
        // recordings of one id for one.
        let builder = RecordingStreamBuilder::new(application.clone()).send_properties(false);
        let transport = RecordingTransport::open(builder, &target)?;
        let live = transport.is_live();
        let (drawing, charts) = RunDrawing::new(header, &RunNamespace::default());
        let mut sink = Self {
            transport,
            room: (LIVE_NUMBERS / header.columns.number_columns().len().max(1)).clamp(1, FILE_BATCH),
            rows: [0; 2],
            card: RunCard::new(header),
            layout: ViewerLayout {
                application,
                charts,
                derived: Vec::new(),
                xy_plots: drawing.xy_plots.diagram_views(),
                diagrams: AnalysisDiagrams::default(),
                states: !drawing.states.is_empty() || header.columns.text_columns().len() > 0,
                texts: drawing.texts.entity_paths(),
                compared: false,
                body: header.view.pose.as_ref().map(|it| it.length as f32),
                graph: !header.view.graph.nodes.is_empty(),
                live,
                opening_time: None,
            },
            batch: even_batch_size(drawing.expected_row_count()),
            drawing,
            opened: Instant::now(),
            sent: Instant::now(),
            laid_out: false,
        };
        let sent = sink.send_static(header).map_err(|it| it.to_string());
        sink.transport.confirm_begin(sent)?;
        Ok(sink)
    }

    fn send_static(&mut self, header: &RunHeader) -> RecordingStreamResult<()> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        if self.transport.is_live() {
            // First: else the viewer would show a layout of its own.
            self.send_layout(&stream)?;
        }
        stream.send_recording_name(header.title.as_str())?;
        stream.log_static("run", &self.card.card_while_running())?;
        stream.log_static("scenario", &TextDocument::new(header.source.concatenated_text()))?;
        graph::draw_node_graph(&header.view.graph, &stream)?;
        self.drawing.send_static(&stream)
    }

    /// Sends the layout of a run that goes on.
    fn send_layout(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.laid_out = true;
        self.layout.send_blueprint(stream, None)
    }

    /// Whether a batch is due.
    fn is_batch_due(&self) -> bool {
        let late = self.transport.is_live() && self.sent.elapsed() >= LIVE_PERIOD;
        late || self.drawing.time_points.len() >= self.batch
    }

    /// Sends the collected rows, once the previous batch has arrived. For a slow viewer rows wait while there is room; then they are dropped.
    fn send_batch(&mut self) -> Result<(), String> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        if !self.transport.is_everything_delivered()? {
            if self.drawing.time_points.len() >= self.room {
                self.rows[1] += self.drawing.drop_collected_rows();
            }
            return Ok(());
        }
        if !self.laid_out && self.opened.elapsed() >= LAY_OUT {
            self.send_layout(&stream).map_err(|it| it.to_string())?;
        }
        let sent = self.drawing.send_collected_rows(&stream, self.transport.is_live());
        sent.map_err(|it| it.to_string())?;
        self.transport.request_confirmation();
        self.sent = Instant::now();
        Ok(())
    }

    /// Sends data of an analysis, after the last row.
    fn send_after_rows(
        &mut self,
        send: impl FnOnce(&mut Self, &RecordingStream) -> RecordingStreamResult<()>,
    ) -> Result<(), Error> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        let result = self.transport.is_delivered_at_end().and_then(|accepts| {
            // A viewer that accepts nothing gets a warning at the end.
            if accepts {
                send(self, &stream).map_err(|it| it.to_string())?;
                self.transport.request_confirmation();
            }
            Ok(())
        });
        self.transport.viewer_loss_to_warning(result)
    }

    fn complete_recording(&mut self, summary: &str, completed: bool) -> Result<(), String> {
        let Some(stream) = self.transport.stream() else {
            return Ok(());
        };
        // A file is written while the rest is drawn; what goes wrong is told when it is closed.
        let live = self.transport.is_live();
        if live && !self.transport.is_delivered_at_end()? {
            self.rows[1] += self.drawing.time_points.len();
            self.transport.give_up_stuck_viewer();
            return Ok(());
        }
        let mut end = || -> RecordingStreamResult<()> {
            self.drawing.send_collected_rows(&stream, live)?;
            self.drawing.signals.send_limits(&stream, &self.drawing.clock)?;
            let mut speeds = None;
            let mut bounds = None;
            if let Some(scene) = &self.drawing.scene {
                scene.send_final_driven_line(&stream)?;
                (speeds, bounds) = (scene.speed_range(), scene.driven_line_bounds());
            }
            // A connected viewer keeps the layout of its user, unless there are new views.
            let added = !self.layout.derived.is_empty() || !self.layout.diagrams.is_empty();
            if added || !self.layout.live {
                self.layout.fit_axes(|path| self.drawing.signals.value_range(path));
                self.layout.send_blueprint(&stream, bounds)?;
            }
            stream.log_static("run", &self.card.card_after_end(summary, completed, speeds))
        };
        end().map_err(|it| it.to_string())?;
        self.transport.request_confirmation();
        drop(stream);
        self.transport.close()
    }
}

impl Sink for RerunSink {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        if !self.transport.is_open() {
            return Ok(());
        }
        self.card.end = time;
        if self.drawing.push_row(tick, time, row).is_none() {
            return Ok(());
        }
        self.rows[0] += 1;
        if !self.is_batch_due() {
            return Ok(());
        }
        let result = self.send_batch();
        self.transport.viewer_loss_to_warning(result)
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        if self.transport.is_open() {
            self.drawing.push_event(event);
        }
        Ok(())
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        if self.transport.is_open() {
            self.drawing.push_status_change(change);
        }
        Ok(())
    }

    fn push_derived_columns(&mut self, derived: &AnalysisColumns) -> Result<(), Error> {
        self.send_after_rows(|sink, stream| {
            let clock = &sink.drawing.clock;
            let time_points: TimePoints =
                derived.time.iter().map(|time| clock.time_point_at(*time)).collect();
            match sink.drawing.scene.as_ref().zip(GhostPath::among(derived)) {
                // Curves of a position tell nobody anything.
                Some((scene, path)) => {
                    let name = format!("{} {}", derived.analysis, derived.group);
                    scene.send_ghost(stream, &name, &path, &time_points)?;
                }
                None => sink.layout.add_analysis_charts(derived),
            }
            signals::send_derived_columns(stream, derived, &time_points)
        })
    }

    fn push_diagram(&mut self, analysis: &str, group: &str, diagram: &Diagram) -> Result<(), Error> {
        self.send_after_rows(|sink, stream| {
            sink.layout.diagrams.send_diagram(stream, analysis, group, diagram)
        })
    }

    fn push_test_track(&mut self, track: &TestTrackLayout) -> Result<(), Error> {
        // Where no body is shown, there is no ground to stand on.
        if self.drawing.scene.is_none() {
            return Ok(());
        }
        self.send_after_rows(|_, stream| test_track::send_test_track(stream, track))
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        let result = self.complete_recording(summary, completed);
        self.transport.viewer_loss_to_warning(result)?;
        let [all, missing] = self.rows;
        if missing > 0 {
            self.transport.add_viewer_warning(&format!("was too slow for {missing} of {all} rows"));
        }
        Ok(())
    }

    fn take_notices(&mut self) -> Vec<SinkNotice> {
        self.transport.notices()
    }
}

/// The rows of each batch to a file when there are so many rows: batches are alike, as the run waits for the last one.
fn even_batch_size(rows: usize) -> usize {
    rows.max(1).div_ceil(rows.div_ceil(FILE_BATCH).max(1))
}

/// The smallest of 1, 2, 5, 10, 20 .. or of 0.5, 0.2, 0.1 .. that is not below `least`.
fn round_up_to_1_2_5(least: f64) -> f64 {
    let decade = 10.0_f64.powf(least.max(f64::MIN_POSITIVE).log10().floor());
    let found = [1.0, 2.0, 5.0, 10.0].into_iter().find(|it| it * decade >= least);
    found.unwrap_or(10.0) * decade
}

/// The viewer keeps one layout per application, so every scenario is one.
fn application_id(scenario: &str) -> ApplicationId {
    let allowed = |it: char| it.is_ascii_lowercase() || it.is_ascii_digit();
    let name = scenario.to_ascii_lowercase();
    let name: String = name.chars().map(|it| if allowed(it) { it } else { '_' }).collect();
    ApplicationId::new_or_unknown(name)
}

#[cfg(test)]
mod tests {
    use super::{even_batch_size, round_up_to_1_2_5};

    #[test]
    fn batches_of_a_run_are_alike() {
        for (rows, batch) in [(0, 1), (1, 1), (5_000, 5_000), (10_401, 3_467), (20_000, 5_000)] {
            assert_eq!(even_batch_size(rows), batch, "{rows} rows");
        }
        assert!((4_990..=5_000).contains(&even_batch_size(usize::MAX)));
    }

    #[test]
    fn round_numbers_are_those_of_a_ruler() {
        for (least, round) in [(0.03, 0.05), (0.2, 0.2), (0.66, 1.0), (7.0, 10.0), (4_321.0, 5e3)] {
            let found = round_up_to_1_2_5(least);
            assert!((found / round - 1.0).abs() < 1e-12, "{least}: {found}");
        }
    }
}
