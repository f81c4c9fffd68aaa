//! Draws two runs in one recording: curves and points over each other, a ghost car, and the time gap at each distance.

use std::path::Path;

use diagnostics::Error;
use re_sdk::{ApplicationId, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};
use re_sdk_types::archetypes::{Scalars, TextDocument};
use recording::view::CurveRole;
use recording::{RecordedVariables, Row, RunEvent, Sink};

use super::arrival_times::ArrivalTimes;
use super::diagrams::AnalysisDiagrams;
use super::drawing::RunDrawing;
use super::layout::ViewerLayout;
use super::run_slot::{OTHER, RunNamespace};
use super::signals::{ChartCurve, TimeChart};
use super::target::RecordingTarget;
use super::time_gap::TimeGap;
use super::timeline::TimePoints;
use super::transport::RecordingTransport;
use super::{FILE_BATCH, application_id};
use crate::comparison::{RecordedRun, RunComparison};

/// The entity of the time gap.
const TIME_GAP: &str = "time_gap";
/// Distances of runs whose first positions are further apart [m] do not compare.
const APART: f64 = 1.0;

impl RunComparison {
    /// Writes both runs into the file at `path`, with a layout. Oddities are added to the notes.
    ///
    /// # Errors
    /// When a run cannot be read to its end, or the file cannot be written.
    pub fn write_recording(&mut self, path: &Path) -> Result<(), Error> {
        let [a, b] = &self.runs;
        let name = format!("{}_{OTHER}_{}", a.header.scenario, b.header.scenario);
        let application = application_id(&name);
        let builder = RecordingStreamBuilder::new(application.clone()).send_properties(false);
        let mut transport = RecordingTransport::open(builder, &RecordingTarget::File(path.to_owned()))?;
        let Some(stream) = transport.stream() else { return Ok(()) };
        let mut pair = RunPair::new([a, b], application);
        pair.layout.opening_time = self.differences.first_time;
        let described = pair.send_static(&stream, [a, b]).map_err(|error| error.to_string());
        transport.confirm_begin(described)?;
        let RunPairResult { arrivals, begins, time_gap } = pair.draw_rows(&stream, &mut transport, [a, b])?;
        if let [Some(a), Some(b)] = begins
            && (a[0] - b[0]).hypot(a[1] - b[1]) > APART
        {
            self.notes.push(
                "the runs begin at different points, so their distances do not compare; give both scenarios a [view] distance \
                 from one line"
                    .to_owned(),
            );
        }
        let card = self.run_card_markdown(&comparison_facts(pair.timed, arrivals, time_gap.last_point()));
        let ended = pair.send_final_parts(&stream, &time_gap, card).map_err(|error| error.to_string());
        drop(stream);
        let ended = ended.and_then(|()| transport.close());
        transport.viewer_loss_to_warning(ended)
    }
}

/// The drawings of both runs and their common layout.
struct RunPair {
    slots: [RunNamespace; 2],
    first: RunDrawing,
    other: RunDrawing,
    layout: ViewerLayout,
    /// Whether both runs have a distance.
    timed: bool,
    /// The title of the time gap.
    title: String,
}

/// The outcome of drawing both runs.
struct RunPairResult {
    arrivals: [ArrivalTimes; 2],
    /// The first position of each body [m].
    begins: [Option<[f64; 2]>; 2],
    time_gap: TimeGap,
}

impl RunPair {
    fn new([a, b]: [&RecordedRun; 2], application: ApplicationId) -> Self {
        let slots = [RunNamespace::default(), RunNamespace(Some(b.name.clone()))];
        let [(first, charts), (other, more)] =
            [(a, &slots[0]), (b, &slots[1])].map(|(run, slot)| RunDrawing::new(&run.header, slot));
        let timed = [a, b].iter().all(|run| run.header.view.distance.is_some());
        let title = format!("{} behind {} at the same distance", b.name, a.name);
        let layout = ViewerLayout {
            application,
            charts: overlay_charts(timed.then_some(&title), charts, more),
            derived: Vec::new(),
            xy_plots: first.xy_plots.views_with(&other.xy_plots),
            diagrams: AnalysisDiagrams::default(),
            states: a.header.columns.text_columns().len() > 0,
            texts: [&first, &other].iter().flat_map(|it| it.texts.entity_paths()).collect(),
            graph: false,
            compared: true,
            body: first.scene.as_ref().and(a.header.view.pose.as_ref()).map(|it| it.length as f32),
            live: false,
            opening_time: None,
        };
        Self { slots, first, other, layout, timed, title }
    }

    /// Sends the layout and the static parts.
    fn send_static(&self, stream: &RecordingStream, runs: [&RecordedRun; 2]) -> RecordingStreamResult<()> {
        self.layout.send_blueprint(stream, None)?;
        stream.send_recording_name(format!("{} / {}", runs[0].name, runs[1].name))?;
        for (run, slot) in runs.iter().zip(&self.slots) {
            let text = TextDocument::new(run.header.source.concatenated_text());
            stream.log_static(slot.entity_path("scenario"), &text)?;
        }
        self.first.send_static(stream)?;
        self.other.send_static(stream)
    }

    /// Draws the rows of both.
    fn draw_rows(
        &mut self,
        stream: &RecordingStream,
        transport: &mut RecordingTransport,
        [a, b]: [&RecordedRun; 2],
    ) -> Result<RunPairResult, Error> {
        let mut sink = DrawingSink::new(stream, transport, &mut self.other);
        b.replay_into_sink(&mut sink)?;
        sink.finish("", true)?;
        let (of_b, begin_b) = (sink.arrivals, sink.begin);
        let mut sink = DrawingSink::new(stream, transport, &mut self.first);
        sink.reference = self.timed.then_some(&of_b);
        a.replay_into_sink(&mut sink)?;
        sink.finish("", true)?;
        let (of_a, begin_a, time_gap) = (sink.arrivals, sink.begin, sink.time_gap);
        Ok(RunPairResult { arrivals: [of_a, of_b], begins: [begin_a, begin_b], time_gap })
    }

    /// Sends the parts that depend on all rows, the layout again among them.
    fn send_final_parts(
        mut self,
        stream: &RecordingStream,
        time_gap: &TimeGap,
        card: String,
    ) -> RecordingStreamResult<()> {
        let scenes = [&self.first.scene, &self.other.scene].into_iter().flatten();
        scenes.clone().try_for_each(|scene| scene.send_final_driven_line(stream))?;
        let bounds = scenes.filter_map(|scene| scene.driven_line_bounds()).reduce(|a, b| a.union(b));
        let number = self.layout.xy_plots.len() + 1;
        self.layout.xy_plots.extend(time_gap.send_diagram(stream, number, &self.title)?);
        self.layout
            .fit_axes(|path| self.first.signals.value_range(path).or(self.other.signals.value_range(path)));
        self.first.signals.send_limits(stream, &self.first.clock)?;
        self.layout.send_blueprint(stream, bounds)?;
        stream.log_static("run", &TextDocument::from_markdown(card))
    }
}

/// Each plot of the first run with the curves of the other one, below the time gap.
fn overlay_charts(time_gap: Option<&String>, charts: Vec<TimeChart>, more: Vec<TimeChart>) -> Vec<TimeChart> {
    let mut charts: Vec<_> = charts
        .into_iter()
        .zip(more)
        .map(|(mut chart, other)| {
            chart.lines.extend(other.lines);
            chart
        })
        .collect();
    charts.retain(|chart| !chart.lines.is_empty());
    if let Some(title) = time_gap {
        let line = ChartCurve {
            path: EntityPath::from(TIME_GAP),
            slot: RunNamespace::default(),
            label: "Δt".to_owned(),
            role: CurveRole::Other,
            stepped: false,
            bound: false,
            limit_of: None,
        };
        let title = format!("{title} [s]");
        let group = charts.first().and_then(|chart| chart.group.clone());
        let legend = EntityPath::from(format!("legends/{TIME_GAP}"));
        let lines = vec![line];
        charts.insert(0, TimeChart { title, group, range: None, span: None, legend, lines });
    }
    charts
}

/// Facts for the run card: distances [m], and the time gap [s] at the last common one.
fn comparison_facts(
    timed: bool,
    arrivals: [ArrivalTimes; 2],
    last: Option<[f64; 2]>,
) -> Vec<(String, [String; 2])> {
    if !timed {
        let why = "unknown: [view] has no pose, distance or speed for both";
        return vec![("Distance".to_owned(), [why.to_owned(), String::new()])];
    }
    let ends = arrivals.map(|run| run.furthest_distance().map(|it| format!("{it:.1} m")));
    let mut facts = vec![("Distance".to_owned(), ends.map(Option::unwrap_or_default))];
    if let Some([distance, gap]) = last {
        let gap = format!("{gap:+.3} s");
        facts.push((format!("Time at {distance:.1} m"), [String::new(), gap]));
    }
    facts
}

/// Draws the rows of a run, and keeps its arrivals.
struct DrawingSink<'a> {
    stream: &'a RecordingStream,
    transport: &'a mut RecordingTransport,
    drawing: &'a mut RunDrawing,
    arrivals: ArrivalTimes,
    /// The first position of the body [m].
    begin: Option<[f64; 2]>,
    /// The arrivals of the run to compare with.
    reference: Option<&'a ArrivalTimes>,
    time_points: TimePoints,
    /// Unsent time gaps [s].
    gaps: Vec<f64>,
    time_gap: TimeGap,
}

impl<'a> DrawingSink<'a> {
    fn new(
        stream: &'a RecordingStream,
        transport: &'a mut RecordingTransport,
        drawing: &'a mut RunDrawing,
    ) -> Self {
        let (arrivals, time_points) = (ArrivalTimes::default(), TimePoints::default());
        let (begin, reference, time_gap) = (None, None, TimeGap::default());
        Self {
            stream,
            transport,
            drawing,
            arrivals,
            begin,
            reference,
            time_points,
            gaps: Vec::new(),
            time_gap,
        }
    }

    fn send_rows(&mut self) -> RecordingStreamResult<()> {
        self.drawing.send_collected_rows(self.stream, false)?;
        if !self.gaps.is_empty() {
            let gaps = Scalars::new(self.gaps.drain(..)).columns_of_unit_batches()?;
            self.stream.send_columns(TIME_GAP, self.time_points.time_columns(), gaps)?;
            self.time_points.clear();
        }
        Ok(())
    }
}

impl Sink for DrawingSink<'_> {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        if let (None, Some(scene)) = (self.begin, &self.drawing.scene) {
            self.begin = Some(scene.body_position(row));
        }
        let time_point = self.drawing.push_row(tick, time, row);
        if let Some(distance) = self.drawing.clock.last_distance() {
            let reached = self.arrivals.push(time, distance);
            let other = self.reference.and_then(|reference| reference.time_at(distance));
            if let (Some(time_point), Some(reached), Some(other)) = (time_point, reached, other) {
                self.time_points.push(time_point);
                self.gaps.push(other - reached);
                self.time_gap.push(time_point, [distance, other - reached]);
            }
        }
        if self.drawing.time_points.len() < FILE_BATCH {
            return Ok(());
        }
        let sent = self.send_rows().map_err(|error| error.to_string());
        let sent = sent.and_then(|()| self.transport.is_everything_delivered().map(drop));
        self.transport.viewer_loss_to_warning(sent)
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        self.drawing.push_event(event);
        Ok(())
    }

    fn finish(&mut self, _summary: &str, _completed: bool) -> Result<(), Error> {
        let sent = self.send_rows().map_err(|error| error.to_string());
        self.transport.viewer_loss_to_warning(sent)
    }
}
