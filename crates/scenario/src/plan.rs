//! The checked plan of a run: a graph of indices, in which no look-up by name can fail.

mod accepts;
mod analysis;
mod baseline;
mod call_fault;
mod check;
mod coupling;
mod driver;
mod input_chain;
mod isolation;
mod needed;
mod sweep;

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use diagnostics::Error;
use fmu_import::{Causality, Fmu, Storage, Value};
use recording::table::Table;
use recording::{
    Columns, Full, IntegerIndex, IntegerRange, NumberIndex, NumberRange, RunHeader, Selection,
    TextIndex, TextRange,
};
use serde::{Deserialize, Serialize};

use crate::document::{At, Extrapolate};
use crate::signal::Signal;
pub use accepts::Accepts;
pub use analysis::{Analyser, AnalysisPlan, Origin, Wired};
pub use baseline::{BaselinePlan, BaselineSignal, TubeSize};
pub use call_fault::{CallFault, CallFaultKind};
pub use check::{CheckPlan, Condition, ResultName, Results};
pub use coupling::{
    Block, BondPlan, CouplingPlan, CouplingRules, Division, Iteration, Link, Loop, Pace, Tear,
};
pub use driver::DriverPlan;
pub use input_chain::{ChainMemory, FaultPlan, InputChain};
pub use isolation::Isolation;
pub use sweep::{Axis, AxisValues, CollectPlan, Collected, Goal, SearchPlan, SweepPlan};

/// The report of a run, in its folder.
pub const REPORT: &str = "report.json";

/// What numbers of messages are called in checks: `messages.plant.warnings`.
pub const MESSAGES: &str = "messages";

/// Whether a name in the folder of a run belongs to its report, as `report.*` does, to its recordings, as `run.*` does, or to its
/// checkpoints, as `checkpoint_*` does.
#[must_use]
pub fn is_reserved(name: &str) -> bool {
    ["report.", "run.", "checkpoint_"].iter().any(|begin| name.starts_with(begin))
}

/// The communication points of a run: `t = t_0 + k h`, computed and never accumulated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    /// The first communication point [s].
    pub start: f64,
    /// Communication step [s].
    pub step: f64,
    /// Number of steps.
    pub steps: u64,
}

impl Clock {
    /// The time of communication point `tick` [s].
    #[must_use]
    #[inline]
    pub fn at(&self, tick: u64) -> f64 {
        // Ticks stay far below 2^53.
        self.start + tick as f64 * self.step
    }

    /// The time of the last communication point [s].
    #[must_use]
    pub fn stop(&self) -> f64 {
        self.at(self.steps)
    }

    /// The clock with steps that are so many times shorter.
    #[must_use]
    pub fn finer(&self, times: u64) -> Clock {
        // By a power of two, the times of communication points stay what they are to the last bit.
        Clock { start: self.start, step: self.step / times as f64, steps: self.steps * times }
    }

    /// The clock with steps that are so many times longer.
    #[must_use]
    pub fn coarser(&self, times: u64) -> Clock {
        Clock { start: self.start, step: self.step * times as f64, steps: self.steps / times }
    }

    /// The time from the first communication point to the last one [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.steps as f64 * self.step
    }

    /// The stop time that FMUs are told [s]: where the last step ends in their own sum of its start and its length. That can be a
    /// unit in the last place after [`stop`](Self::stop), and an FMU may refuse any step that ends later than it was told.
    #[must_use]
    pub fn announced_stop(&self) -> f64 {
        self.at(self.steps.saturating_sub(1)) + self.step
    }
}

/// Variables of one form, which are read and written at once: all elements of arrays.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// The form.
    pub storage: Storage,
    /// The value references.
    pub references: Vec<u32>,
    /// Number of elements in all.
    pub elements: usize,
    /// Whether they are inputs that change at events only, and the FMU has event mode.
    pub discrete: bool,
    /// Whether they are tunable parameters: the FMU is told of changes only, since it may work long on each.
    pub tunable: bool,
    /// The value references of the clocks at whose ticks alone they have values.
    pub clocks: Vec<u32>,
    /// Places of the values that travel among all elements, in the order in which they travel.
    pub places: Vec<usize>,
    /// Whether somebody uses one of the values; else nobody asks for them.
    pub needed: bool,
}

impl Group {
    /// Whether all elements travel.
    #[must_use]
    #[inline]
    pub fn is_whole(&self) -> bool {
        self.places.len() == self.elements
    }

    /// Whether the values are integers of 64 bits, which travel exactly.
    #[must_use]
    #[inline]
    pub fn is_exact(&self) -> bool {
        matches!(self.storage, Storage::Int64 | Storage::UInt64)
    }
}

/// Variables of an FMU, in the order in which their values travel.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ports {
    /// Those of numbers.
    pub numbers: Vec<Group>,
    /// Those of texts and bytes, which travel beside the numbers; each is one variable.
    pub texts: Vec<Group>,
}

/// A start value of an FMU.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Start {
    /// The variable.
    pub name: String,
    /// Its value reference.
    pub reference: u32,
    /// The form of its values.
    pub storage: Storage,
    /// Its place in an array, and the number of elements there.
    pub element: (usize, usize),
    /// Who determines it during the run.
    pub causality: Causality,
    /// The value, of the variable's type.
    pub value: Value,
    /// Its place in a scenario; none when the command line gives it.
    #[serde(skip)]
    pub place: Option<WordPlace>,
}

/// A place in the files of a scenario.
pub type WordPlace = (Arc<diagnostics::Source>, Range<usize>);

impl Start {
    /// The error of an FMU called `node` that refuses the value, at the word that gives it.
    #[must_use]
    pub fn refused(&self, node: &str, what: &str) -> Error {
        let name = &self.name;
        match &self.place {
            Some((source, place)) => {
                source.error(place.clone(), format!("`{node}` refuses `{name}`: {what}"), "")
            }
            None => Error::input(format!("--set {node}.{name}: the FMU refuses it: {what}")),
        }
    }
}

/// The kind of a node with its contents.
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
        /// How it is kept apart from the others; without it, it is not.
        isolation: Option<Isolation>,
    },
    /// Generated signals, one for each output.
    Signals(Vec<Signal>),
    /// A table, one column for each output.
    Table(Table),
    /// The driver of a manoeuvre.
    Driver(DriverPlan),
    /// A connector, whose input is its output. It takes its value before the nodes that it leads to step.
    Inlet,
    /// The same; it takes its value after the node that it comes from has stepped.
    Outlet,
}

impl Body {
    /// Whether it knows more than its inputs and the time.
    #[must_use]
    pub fn remembers(&self) -> bool {
        matches!(self, Body::Fmu { .. } | Body::Driver(_))
    }
}

/// A node, and where its values are in the row.
#[derive(Debug)]
pub struct NodePlan {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub body: Body,
    /// Its own step, if that is not the communication step.
    pub pace: Option<Pace>,
    /// Its outputs that are numbers.
    pub outputs: NumberRange<Full>,
    /// Those of them that somebody uses, none of which may be NaN.
    pub needed: Vec<NumberIndex<Full>>,
    /// Its connected inputs that are numbers.
    pub inputs: NumberRange<Full>,
    /// The connection of each of these inputs.
    pub connections: Vec<ResolvedConnection>,
    /// The same for texts.
    pub texts: TextPlan,
    /// The same for integers of 64 bits, which are among the numbers, too.
    pub exact: ExactPlan,
    /// The faults of its calls.
    pub faults: Vec<CallFault>,
}

/// Indices of a node's integers of 64 bits in the row.
#[derive(Debug, Default)]
pub struct ExactPlan {
    /// Its outputs.
    pub outputs: IntegerRange<Full>,
    /// The number of each output.
    pub numbers: Vec<NumberIndex<Full>>,
    /// Its connected inputs.
    pub inputs: IntegerRange<Full>,
    /// The connections with such an integer at one end or at both.
    pub connections: Vec<ExactConnection>,
    /// Whether nobody uses any of its outputs.
    pub unneeded: bool,
}

/// What a connection of numbers is for an integer of 64 bits.
#[derive(Debug)]
pub struct ExactConnection {
    /// Its place among the node's connections of numbers.
    pub place: usize,
    /// The output, if it is such an integer.
    pub source: Option<IntegerIndex<Full>>,
    /// The input, if it is such an integer.
    pub input: Option<IntegerIndex<Full>>,
    /// The integers that the input accepts when they arrive as they are; without it they go through the number, which has to
    /// hold them.
    pub as_it_is: Option<Accepts>,
}

impl NodePlan {
    /// Whether it hands on a value and does nothing else.
    #[must_use]
    pub fn is_connector(&self) -> bool {
        matches!(self.body, Body::Inlet | Body::Outlet)
    }
}

/// Indices of a node's texts in the row.
#[derive(Debug, Default)]
pub struct TextPlan {
    /// Its outputs.
    pub outputs: TextRange<Full>,
    /// Its connected inputs.
    pub inputs: TextRange<Full>,
    /// The source of each connected input.
    pub connections: Vec<Source<TextIndex<Full>>>,
    /// Whether nobody uses any of its outputs.
    pub unneeded: bool,
}

/// Source of the value of an input.
#[derive(Debug, Clone, Copy)]
pub struct Source<I> {
    /// The index of the output.
    pub index: I,
    /// Which end of the step the value is taken at.
    pub at: At,
}

/// A connection of numbers: source, unit conversion, effects and faults.
#[derive(Debug, Clone)]
pub struct ResolvedConnection {
    /// Source of the number.
    pub source: Source<NumberIndex<Full>>,
    /// Its way to the input.
    pub input_chain: InputChain,
    /// The course of the input within a step; without one it holds its value.
    pub course: Option<Extrapolate>,
}

/// A scenario without names: what the master works with.
#[derive(Debug)]
pub struct System {
    /// The coupling.
    pub coupling: CouplingPlan,
    /// The communication points.
    pub clock: Clock,
    /// The stop time that FMUs are told [s]; none when nobody knows it.
    pub announced_stop: Option<f64>,
    /// Relative tolerance that all FMUs are told [-].
    pub tolerance: Option<f64>,
    /// The nodes, in the order of the file.
    pub nodes: Vec<NodePlan>,
    /// The order in which they step.
    pub order: Vec<usize>,
    /// The variables of the run.
    pub columns: Columns<Full>,
    /// Analyses of the recording.
    pub analyses: Vec<AnalysisPlan>,
    /// The checks.
    pub checks: Vec<CheckPlan>,
    /// What the run leaves in the table of a sweep.
    pub collected: Vec<CollectPlan>,
    /// The recordings that it is compared with.
    pub baselines: Vec<BaselinePlan>,
    /// The recorded variables.
    pub recorded: Selection,
    /// Header of the recordings, with the recorded columns.
    pub header: RunHeader,
    /// The files whose texts are start values.
    pub texts: Vec<PathBuf>,
    /// Warnings.
    pub warnings: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::Clock;

    #[test]
    fn no_step_passes_the_announced_stop_time_and_the_last_one_ends_there() {
        for step in [0.1, 0.01, 0.001, 1.0 / 3.0] {
            for steps in 1..=10_000 {
                let clock = Clock { start: 0.0, step, steps };
                let stop = clock.announced_stop();
                assert_eq!(clock.at(steps - 1) + step, stop);
                assert!(steps < 2 || clock.at(steps - 2) + step < stop);
                assert!((stop - clock.stop()).abs() <= stop * f64::EPSILON);
            }
        }
    }

    #[test]
    fn a_run_that_starts_later_has_the_same_steps() {
        let clock = Clock { start: 100.0, step: 0.1, steps: 3 };
        assert_eq!([0, 1, 3].map(|tick| clock.at(tick)), [100.0, 100.1, 100.0 + 3.0 * 0.1]);
        assert_eq!((clock.stop(), clock.duration()), (100.0 + 3.0 * 0.1, 3.0 * 0.1));
    }
}
