//! The checked plan of a run: a graph of indices, in which no look-up by name can fail.

mod accepts;
mod analysis;
mod check;
mod coupling;
mod treatment;

use std::sync::Arc;

use fmu_import::Fmu;
use recording::table::Table;
use recording::{
    Columns, Full, NumberIndex, NumberRange, RunHeader, Selection, TextIndex, TextRange,
};

use crate::signal::Signal;
use crate::words::{Algorithm, At};
pub use accepts::Accepts;
pub use analysis::{AnalysisPlan, Origin, Wired};
pub use check::{CheckPlan, ResultName, Subject};
pub use coupling::CouplingRules;
pub use treatment::{FaultKind, FaultPlan, Treatment};

/// The files of a run, whose names nothing else in its folder can have.
pub const FILES: [&str; 5] = ["report.json", "run.mcap", "run.rrd", "run.csv", "run.csv.partial"];

/// The communication points of a run: `t = k h`, computed and never accumulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Communication step [s].
    pub step: f64,
    /// Number of steps.
    pub steps: u64,
}

impl Clock {
    /// The time of communication point `tick` [s].
    #[must_use]
    pub fn at(&self, tick: u64) -> f64 {
        // Ticks stay far below 2^53.
        tick as f64 * self.step
    }

    /// The time of the last communication point [s].
    #[must_use]
    pub fn stop(&self) -> f64 {
        self.at(self.steps)
    }
}

/// Value references by type, in the order in which values travel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ports {
    /// Of `Real` variables.
    pub real: Vec<u32>,
    /// Of `Integer` and `Enumeration` variables.
    pub integer: Vec<u32>,
    /// Of `Boolean` variables.
    pub boolean: Vec<u32>,
    /// Of `String` variables, which travel beside the numbers.
    pub string: Vec<u32>,
}

impl Ports {
    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.real.len() + self.integer.len() + self.boolean.len()
    }

    /// Whether there is no number.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A start value of an FMU.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// The value reference.
    pub reference: u32,
    /// The value, of the variable's type.
    pub value: StartValue,
}

/// A value of any type of FMI 2.0.
#[derive(Debug, Clone, PartialEq)]
pub enum StartValue {
    /// `Real`.
    Real(f64),
    /// `Integer` or `Enumeration`.
    Integer(i32),
    /// `Boolean`.
    Boolean(bool),
    /// `String`.
    String(String),
}

/// What a node is.
#[derive(Debug)]
pub enum Body {
    /// An FMU with its start values and its recorded and connected variables.
    Fmu {
        /// The opened archive.
        fmu: Arc<Fmu>,
        /// The start values.
        starts: Vec<Start>,
        /// The connected inputs.
        inputs: Ports,
        /// All outputs.
        outputs: Ports,
        /// Whether it logs all it has to say.
        log: bool,
    },
    /// Generated signals, one for each output.
    Signals(Vec<Signal>),
    /// A table, one column for each output.
    Table(Table),
}

/// A node, and where its values are in the row.
#[derive(Debug)]
pub struct NodePlan {
    /// Its name.
    pub name: String,
    /// What it is.
    pub body: Body,
    /// Its outputs that are numbers.
    pub outputs: NumberRange<Full>,
    /// Its connected inputs that are numbers.
    pub inputs: NumberRange<Full>,
    /// What each of these inputs gets.
    pub links: Vec<Link>,
    /// The same for texts.
    pub texts: TextPlan,
}

/// Where a node's texts are in the row.
#[derive(Debug, Default)]
pub struct TextPlan {
    /// Its outputs.
    pub outputs: TextRange<Full>,
    /// Its connected inputs.
    pub inputs: TextRange<Full>,
    /// What each of the connected inputs gets.
    pub links: Vec<Source<TextIndex<Full>>>,
}

/// Where the value of an input comes from.
#[derive(Debug, Clone, Copy)]
pub struct Source<I> {
    /// The index of the output.
    pub index: I,
    /// Which end of the step the value is taken at.
    pub at: At,
}

/// What an input gets: the number that an output shows, converted and disturbed.
#[derive(Debug, Clone)]
pub struct Link {
    /// Where the number comes from.
    pub source: Source<NumberIndex<Full>>,
    /// What happens to it on its way.
    pub treatment: Treatment,
}

/// A scenario without names: what the master works with.
#[derive(Debug)]
pub struct System {
    /// The coupling algorithm.
    pub coupling: Algorithm,
    /// The communication points.
    pub clock: Clock,
    /// The nodes, in the order of the file.
    pub nodes: Vec<NodePlan>,
    /// The order in which they step.
    pub order: Vec<usize>,
    /// The variables of the run.
    pub columns: Columns<Full>,
    /// What is done with the recording.
    pub analyses: Vec<AnalysisPlan>,
    /// The checks.
    pub checks: Vec<CheckPlan>,
    /// The recorded variables.
    pub recorded: Selection,
    /// What recordings are told; its columns are the recorded ones.
    pub header: RunHeader,
    /// What is odd, but no error.
    pub warnings: Vec<String>,
}
