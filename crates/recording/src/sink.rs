//! Receives a run row by row: the trait that recordings and checks implement, and what they are told beforehand.

use std::path::PathBuf;

use diagnostics::{Error, Source};

use crate::row::{Column, Columns, Direction, Recorded, Row, ValueKind};
use crate::view::View;

pub mod csv;
pub mod mcap;
pub mod threaded_sink;

/// What every sink is told before the first row.
#[derive(Debug, Clone)]
pub struct RunHeader {
    /// The scenario file's stem: `double_lane_change`.
    pub scenario: String,
    /// The scenario's title.
    pub title: String,
    /// The scenario's files, kept with the recording.
    pub source: Source,
    /// Start values from outside of the scenario, as `node.variable=value`.
    pub given: Vec<String>,
    /// Communication step [s].
    pub step: f64,
    /// Last communication point [s].
    pub stop: f64,
    /// The seed of every random stream of the run.
    pub seed: u64,
    /// The recorded variables.
    pub columns: Columns<Recorded>,
    /// The checks and the inputs with faults whose status is recorded, in the order of the file.
    pub status_tracks: Vec<StatusTrack>,
    /// How the replay is laid out.
    pub view: View,
    /// The folder that recordings go to.
    pub folder: PathBuf,
}

/// How much attention an event deserves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Something that was asked for.
    Info,
    /// Something to look at.
    Warning,
    /// Something that ended the run or failed a check.
    Error,
}

/// Something that happened at a time: a message of an FMU, a fault, a failed check.
#[derive(Debug, Clone)]
pub struct Event {
    /// Simulated time [s].
    pub time: f64,
    /// How much attention it deserves.
    pub level: Level,
    /// The node or the part of the program that it comes from.
    pub source: String,
    /// What happened.
    pub message: String,
}

/// A check or an input whose status is recorded over time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StatusTrack {
    /// A check, by its name.
    Check(String),
    /// The faults of an input, by the input's name.
    Fault(String),
}

impl StatusTrack {
    /// The name of the check or of the input.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            StatusTrack::Check(name) | StatusTrack::Fault(name) => name,
        }
    }
}

/// The status of a check or a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Outside of its window.
    Idle,
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
    pub track: StatusTrack,
    /// Its status from now on.
    pub status: Status,
}

/// Columns that an analysis adds to a recording.
#[derive(Debug, Clone, Copy)]
pub struct Derived<'a> {
    /// The analysis' name in the scenario.
    pub analysis: &'a str,
    /// What the columns have in common.
    pub group: &'a str,
    /// When their values hold [s], rising from 0 on.
    pub time: &'a [f64],
    /// Names, units and values.
    pub columns: &'a [plugin::Signal<'a>],
}

impl Derived<'_> {
    /// The columns, as recordings describe them.
    pub fn columns(&self) -> impl Iterator<Item = Column> {
        self.columns.iter().map(|signal| Column {
            node: self.analysis.to_owned(),
            variable: signal.name.to_owned(),
            direction: Direction::Output,
            kind: ValueKind::Real,
            unit: (!signal.unit.is_empty()).then(|| signal.unit.to_owned()),
            description: None,
        })
    }
}

/// Takes what a run produces, with rows of space `S`: full ones or, unless given, recorded ones. Any error stops the run.
pub trait Sink<S = Recorded> {
    /// Takes the values of all columns at communication point `tick`, which is at `time` [s].
    ///
    /// # Errors
    /// When the row cannot be written.
    fn row(&mut self, tick: u64, time: f64, row: &Row<S>) -> Result<(), Error>;

    /// Takes an event; events come in the order of their time, between the rows.
    ///
    /// # Errors
    /// When the event cannot be written.
    fn event(&mut self, _event: &Event) -> Result<(), Error> {
        Ok(())
    }

    /// Takes a change of status. Changes come after the row of their time; those of checks that are about a window as a whole come
    /// after the last row.
    ///
    /// # Errors
    /// When it cannot be written.
    fn status(&mut self, _change: &StatusChange) -> Result<(), Error> {
        Ok(())
    }

    /// Takes what an analysis adds, after the last row.
    ///
    /// # Errors
    /// When it cannot be written.
    fn derived(&mut self, _derived: &Derived) -> Result<(), Error> {
        Ok(())
    }

    /// Takes a diagram of an analysis and a group of diagrams, after the last row.
    ///
    /// # Errors
    /// When it cannot be written.
    fn diagram(&mut self, _belongs: (&str, &str), _diagram: &plugin::Diagram) -> Result<(), Error> {
        Ok(())
    }

    /// Completes what was written. `summary` is the verdict as Markdown; `completed` tells whether the
    /// run came to its end, be it the last communication point or where an FMU ended it as planned.
    ///
    /// # Errors
    /// When the recording cannot be completed.
    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error>;

    /// Where viewers can connect to what is received.
    fn url(&self) -> Option<&str> {
        None
    }

    /// What went wrong that the run goes on without, such as a viewer that was closed.
    fn warning(&self) -> Option<&str> {
        None
    }
}
