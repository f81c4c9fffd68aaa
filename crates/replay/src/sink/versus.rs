//! Writes two runs into one recording: curves and points over each other, a ghost car, and who is ahead at which distance.

use std::path::Path;

use diagnostics::Error;
use recording::view::Role;
use recording::{Event, Recorded, Row, Sink};
use rerun::{
    EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, Scalars,
    TextDocument,
};

use super::contender::{Contender, OTHER};
use super::delivery::Delivery;
use super::delta::Course;
use super::diagrams::Diagrams;
use super::drawing::Drawing;
use super::layout::Layout;
use super::lead::Lead;
use super::moments::Moments;
use super::signals::{Chart, Line};
use super::target::Target;
use super::{FILE_BATCH, application};
use crate::comparison::Comparison;

/// Where the difference of the times is.
const DELTA: &str = "delta";
/// Runs that begin further apart than this [m] do not have their distances from one place.
const APART: f64 = 1.0;

impl Comparison {
    /// Writes both runs into the file at `path`, with a layout. What is odd about them is added to the notes.
    ///
    /// # Errors
    /// When a run cannot be read to its end, or the file cannot be written.
    pub fn write(&mut self, path: &Path) -> Result<(), Error> {
        let [a, b] = &self.runs;
        let name = format!("{}_{OTHER}_{}", a.header.scenario, b.header.scenario);
        let application = application(&name);
        let builder = RecordingStreamBuilder::new(application.clone()).send_properties(false);
        let mut delivery = Delivery::open(builder, &Target::File(path.to_owned()))?;
        let Some(stream) = delivery.stream() else { return Ok(()) };
        let contenders = [Contender::default(), Contender(Some(b.name.clone()))];
        let [(mut first, charts), (mut other, more)] = [(a, &contenders[0]), (b, &contenders[1])]
            .map(|(run, contender)| Drawing::new(&run.header, contender, &run.lacks()));
        let timed = [a, b].iter().all(|run| run.header.view.distance.is_some());
        let delta = format!("{} behind {} at the same distance", b.name, a.name);
        let mut layout = Layout {
            application,
            charts: overlaid(timed.then_some(&delta), charts, more),
            derived: Vec::new(),
            planes: first.planes.shown_with(&other.planes),
            diagrams: Diagrams::default(),
            states: a.header.columns.texts().len() > 0,
            texts: [&first, &other].iter().flat_map(|it| it.texts.paths()).collect(),
            compared: true,
            body: first.scene.as_ref().and(a.header.view.pose.as_ref()).map(|it| it.length as f32),
            live: false,
        };
        let open = || -> RecordingStreamResult<()> {
            layout.send(&stream, None)?;
            stream.send_recording_name(format!("{} / {}", a.name, b.name))?;
            for (run, contender) in [a, b].iter().zip(&contenders) {
                let text = TextDocument::new(run.header.source.whole());
                stream.log_static(contender.path("scenario"), &text)?;
            }
            first.describe(&stream)?;
            other.describe(&stream)
        };
        delivery.begun(open().map_err(|error| error.to_string()))?;
        let mut taker = Taker::new(&stream, &mut delivery, &mut other);
        b.play(&mut taker)?;
        taker.finish("", true)?;
        let (of_b, begin_b) = (taker.course, taker.begin);
        let mut taker = Taker::new(&stream, &mut delivery, &mut first);
        taker.reference = timed.then_some(&of_b);
        a.play(&mut taker)?;
        taker.finish("", true)?;
        let (of_a, begin_a, lead) = (taker.course, taker.begin, taker.lead);
        if let Some((a, b)) = begin_a.zip(begin_b)
            && (a[0] - b[0]).hypot(a[1] - b[1]) > APART
        {
            self.notes.push(
                "the runs begin at different places, so that equal distances are not equal places; give both scenarios a \
                 [view] distance that counts from one line"
                    .to_owned(),
            );
        }
        let found = told(timed, [&of_a, &of_b], lead.last());
        let mut end = || -> RecordingStreamResult<()> {
            let scenes = [&first.scene, &other.scene].into_iter().flatten();
            scenes.clone().try_for_each(|scene| scene.finish(&stream))?;
            let bounds = scenes.filter_map(|scene| scene.bounds()).reduce(|a, b| a.with(b));
            let number = layout.planes.len() + 1;
            layout.planes.extend(lead.send(&stream, number, &delta)?);
            layout.send(&stream, bounds)?;
            stream.log_static("run", &TextDocument::from_markdown(self.card(&found)))
        };
        let ended = end().map_err(|error| error.to_string());
        drop(stream);
        let ended = ended.and_then(|()| delivery.end());
        delivery.judge(ended)
    }
}

/// Each plot of the first run with the curves of the other one, below the difference of their times.
fn overlaid(delta: Option<&String>, charts: Vec<Chart>, more: Vec<Chart>) -> Vec<Chart> {
    let mut charts: Vec<_> = charts
        .into_iter()
        .zip(more)
        .map(|(mut chart, other)| {
            chart.lines.extend(other.lines);
            chart
        })
        .collect();
    charts.retain(|chart| !chart.lines.is_empty());
    if let Some(delta) = delta {
        let line = Line {
            path: EntityPath::from(DELTA),
            contender: Contender::default(),
            label: "Δt".to_owned(),
            role: Role::Other,
            stepped: false,
            bound: false,
        };
        let title = format!("{delta} [s]");
        let group = charts.first().and_then(|chart| chart.group.clone());
        charts.insert(0, Chart { title, group, range: None, lines: vec![line] });
    }
    charts
}

/// What the run card says of distances [m] and of the difference of times [s] at the last common one.
fn told(timed: bool, courses: [&Course; 2], last: Option<[f64; 2]>) -> Vec<(String, [String; 2])> {
    if !timed {
        let why = "unknown: [view] has no pose, distance or speed for both";
        return vec![("Distance".to_owned(), [why.to_owned(), String::new()])];
    }
    let ends = courses.map(|course| course.furthest().map(|it| format!("{it:.1} m")));
    let mut told = vec![("Distance".to_owned(), ends.map(Option::unwrap_or_default))];
    if let Some([distance, delta]) = last {
        let delta = format!("{delta:+.3} s");
        told.push((format!("Time at {distance:.1} m"), [String::new(), delta]));
    }
    told
}

/// Takes a run into its drawing, and notes when it came by where.
struct Taker<'a> {
    stream: &'a RecordingStream,
    delivery: &'a mut Delivery,
    drawing: &'a mut Drawing,
    course: Course,
    /// Where the body was first [m].
    begin: Option<[f64; 2]>,
    /// What the times are compared with.
    reference: Option<&'a Course>,
    moments: Moments,
    deltas: Vec<f64>,
    lead: Lead,
}

impl<'a> Taker<'a> {
    fn new(
        stream: &'a RecordingStream,
        delivery: &'a mut Delivery,
        drawing: &'a mut Drawing,
    ) -> Self {
        let (course, moments) = (Course::default(), Moments::default());
        let (begin, reference, lead) = (None, None, Lead::default());
        Self {
            stream,
            delivery,
            drawing,
            course,
            begin,
            reference,
            moments,
            deltas: Vec::new(),
            lead,
        }
    }

    fn send(&mut self) -> RecordingStreamResult<()> {
        self.drawing.send(self.stream, false)?;
        if !self.deltas.is_empty() {
            let deltas = Scalars::new(self.deltas.drain(..)).columns_of_unit_batches()?;
            self.stream.send_columns(DELTA, self.moments.axes(), deltas)?;
            self.moments.clear();
        }
        Ok(())
    }
}

impl Sink for Taker<'_> {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        if let (None, Some(scene)) = (self.begin, &self.drawing.scene) {
            self.begin = Some(scene.place(row));
        }
        let moment = self.drawing.row(tick, time, row);
        if let Some(distance) = self.drawing.clock.distance() {
            let reached = self.course.push(time, distance);
            let other = self.reference.and_then(|course| course.reached(distance));
            if let (Some(moment), Some(reached), Some(other)) = (moment, reached, other) {
                self.moments.push(moment);
                self.deltas.push(other - reached);
                self.lead.push(moment, [distance, other - reached]);
            }
        }
        if self.drawing.moments.len() < FILE_BATCH {
            return Ok(());
        }
        let sent = self.send().map_err(|error| error.to_string());
        let sent = sent.and_then(|()| self.delivery.accepts().map(drop));
        self.delivery.judge(sent)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.drawing.event(event);
        Ok(())
    }

    fn finish(&mut self, _summary: &str, _completed: bool) -> Result<(), Error> {
        let sent = self.send().map_err(|error| error.to_string());
        self.delivery.judge(sent)
    }
}
