//! Receives a run row by row: the trait of recordings and checks, and the values that they take and give.

use std::path::{Path, PathBuf};

use diagnostics::{Error, SourceFiles};

use crate::columns::{Column, Columns, ValueKind, VariableDirection};
use crate::row::{RecordedVariables, Row};
use crate::view::ReplayView;

pub mod csv;
pub mod ld;
pub mod mcap;
pub mod mdf;
pub mod parquet;
pub mod threaded_sink;

/// The description of a run, which every sink gets before the first row.
#[derive(Debug, Clone)]
pub struct RunHeader {
    /// The scenario file's stem: `double_lane_change`.
    pub scenario: String,
    /// The scenario's title.
    pub title: String,
    /// The scenario's files, kept with the recording.
    pub source: SourceFiles,
    /// Start values from outside of the scenario, as `node.variable=value`.
    pub given: Vec<String>,
    /// Communication step [s].
    pub step: f64,
    /// Last communication point [s].
    pub stop: f64,
    /// The seed of every random stream of the run.
    pub seed: u64,
    /// The recorded variables.
    pub columns: Columns<RecordedVariables>,
    /// The checks and the inputs with faults whose status is recorded, in the order of the file.
    pub status_tracks: Vec<StatusSource>,
    /// How the replay is laid out.
    pub view: ReplayView,
    /// The folder that recordings go to.
    pub folder: PathBuf,
}

/// How much attention an event deserves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventLevel {
    /// Something that was asked for.
    Info,
    /// What a node is, in its own words, said when it is initialised.
    Summary,
    /// Something to look at.
    Warning,
    /// Something that ended the run or failed a check.
    Error,
}

/// Something that happened at a time: a message of an FMU, a fault, a failed check.
#[derive(Debug, Clone, PartialEq)]
pub struct RunEvent {
    /// Simulated time [s].
    pub time: f64,
    /// How much attention it deserves.
    pub level: EventLevel,
    /// The node or the part of the program that it comes from.
    pub source: String,
    /// What happened.
    pub message: String,
    /// 0 of an event of its own; else, how often such an event came again that is not told one by one.
    pub again: u64,
}

/// A check or an input whose status is recorded over time.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum StatusSource {
    /// A check, by its name.
    Check(String),
    /// The faults of an input, by the input's name.
    Fault(String),
}

impl StatusSource {
    /// The name of the check or of the input.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            StatusSource::Check(name) | StatusSource::Fault(name) => name,
        }
    }
}

/// The status of a check or a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckOrFaultStatus {
    /// Outside of its window.
    Idle,
    /// The check is about its window as a whole, and not decided yet.
    Pending,
    /// The check holds.
    Holds,
    /// The check does not hold.
    Violated,
    /// The fault acts.
    Active,
}

/// The status of a check or a fault from a time on.
#[derive(Debug, Clone, PartialEq)]
pub struct StatusChange {
    /// Simulated time [s].
    pub time: f64,
    /// The check or the input.
    pub track: StatusSource,
    /// Its status from now on.
    pub status: CheckOrFaultStatus,
}

/// Columns that an analysis adds to a recording.
#[derive(Debug, Clone, Copy)]
pub struct AnalysisColumns<'a> {
    /// The analysis' name in the scenario.
    pub analysis: &'a str,
    /// What the columns have in common.
    pub group: &'a str,
    /// When their values hold [s], rising from 0 on.
    pub time: &'a [f64],
    /// Names, units and values.
    pub columns: &'a [plugin::Signal<'a>],
}

impl AnalysisColumns<'_> {
    /// The columns, as recordings describe them.
    pub fn columns(&self) -> impl Iterator<Item = Column> {
        self.columns.iter().map(|signal| Column {
            node: self.analysis.to_owned(),
            variable: signal.name.to_owned(),
            direction: VariableDirection::Output,
            kind: ValueKind::Real,
            unit: (!signal.unit.is_empty()).then(|| signal.unit.to_owned()),
            description: None,
        })
    }
}

/// Takes what a run produces, with rows of space `S`: full ones or, unless given, recorded ones.
///
/// # Errors
/// Every method fails when its argument cannot be written. Any error ends the run.
pub trait Sink<S = RecordedVariables> {
    /// Takes the values of all columns at communication point `tick`, which is at `time` [s].
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<S>) -> Result<(), Error>;

    /// Takes an event; events come in the order of their time, between the rows.
    fn push_event(&mut self, _event: &RunEvent) -> Result<(), Error> {
        Ok(())
    }

    /// Takes a change of status. Changes come after the row of their time; the status of checks on a window as a whole comes
    /// after the last row.
    fn push_status_change(&mut self, _change: &StatusChange) -> Result<(), Error> {
        Ok(())
    }

    /// Takes columns of an analysis, after the last row.
    fn push_derived_columns(&mut self, _derived: &AnalysisColumns) -> Result<(), Error> {
        Ok(())
    }

    /// Takes a diagram, after the last row, with the names of its analysis and its group.
    fn push_diagram(
        &mut self,
        _analysis: &str,
        _group: &str,
        _diagram: &plugin::Diagram,
    ) -> Result<(), Error> {
        Ok(())
    }

    /// Takes the test track of a manoeuvre, after the last row.
    fn push_test_track(&mut self, _course: &TestTrackLayout) -> Result<(), Error> {
        Ok(())
    }

    /// Completes the recording. `summary` is the verdict as Markdown. `completed` is false when an error ended the run, and true
    /// when it reached its last communication point or an FMU ended it as planned.
    fn finish(&mut self, _summary: &str, _completed: bool) -> Result<(), Error> {
        Ok(())
    }

    /// Notices since the last call, in the order of their time. They are fetched after opening, after rows and after the end.
    fn take_notices(&mut self) -> Vec<SinkNotice> {
        Vec::new()
    }
}

/// The test track of a manoeuvre (ISO 3888) on the ground, east and north [m].
#[derive(Debug, Clone, Copy)]
pub struct TestTrackLayout<'a> {
    /// Where cones stand that the car does not touch.
    pub cones: &'a [[f64; 2]],
    /// Where cones stand that it hits.
    pub hit_cones: &'a [[f64; 2]],
    /// The line to follow.
    pub path: &'a [[f64; 2]],
}

/// A message of a sink, for the other sinks or for the user.
#[derive(Debug, Clone, PartialEq)]
pub enum SinkNotice {
    /// For the other sinks: a change of status.
    Status(StatusChange),
    /// For the other sinks: an event.
    Event(RunEvent),
    /// For the user: viewers can connect to this URL.
    Serving(String),
    /// For the user: a problem that does not end the run, such as a closed viewer.
    Warning(String),
}

/// The name of a file that is not complete.
fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".partial");
    PathBuf::from(name)
}

/// Gives a file its name. An incomplete one looks like a complete one, so it does not get it.
fn rename_completed_file(partial: &Path, path: &Path, completed: bool) -> Result<(), Error> {
    match completed {
        true => std::fs::rename(partial, path).map_err(|error| Error::output_failure(path, error)),
        false => Ok(()),
    }
}

/// A recording of a run.
pub type BoxedSink = Box<dyn Sink + Send>;

/// A way to record a run, as a list of all ways names it; `O` are the options of a run.
pub struct SinkFactory<O> {
    /// The files that it may leave in the folder of a run. Their names begin with `run.`.
    pub files: &'static [&'static str],
    /// Opens the recording, if the options ask for it.
    pub open: fn(&RunHeader, &O) -> Result<Option<BoxedSink>, Error>,
}
