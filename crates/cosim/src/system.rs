//! A system of coupled nodes: what each node is, where its values are in the row, and how they are connected. A graph of indices, in
//! which no look-up by name can fail.

mod accepted_values;
mod coupling;
mod driver;
mod input_chain;
mod isolation;
mod used_columns;

use std::ops::Range;
use std::sync::Arc;

use diagnostics::Error;
use fmu_import::{Causality, Fmu, StorageType, Value};
use recording::table::TimeSeriesTable;
use recording::{
    AllVariables, Columns, IntegerIndex, IntegerRange, NumberIndex, NumberRange, TextIndex, TextRange,
};
use serde::{Deserialize, Serialize};

use crate::clock::{CommunicationClock, StepBoundary};
use crate::extrapolation::ExtrapolationOrder;
use crate::fault::CallFault;
use crate::signal::Signal;
pub use accepted_values::AcceptedValues;
pub use coupling::{
    Algorithm, BondPlan, ConnectionLoop, CouplingPlan, CouplingProperties, ErrorEstimate, LoopConnection,
    LoopIteration, LoopSolverMethod, NodeBlock, StepDivision, StepRatio, TearConnection,
};
pub use driver::DriverPlan;
pub use input_chain::{InputChain, InputChainState, InputFault};
pub use isolation::{FmuFailurePolicy, FmuIsolation, ProcessLimits};
pub use used_columns::UsedColumns;

/// Variables of one form, which are read and written at once: all elements of arrays.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct VariableGroup {
    /// The form.
    pub storage: StorageType,
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

impl VariableGroup {
    /// Whether all elements travel.
    #[must_use]
    #[inline]
    pub fn is_fully_transferred(&self) -> bool {
        self.places.len() == self.elements
    }

    /// Whether the values are integers of 64 bits, which travel exactly.
    #[must_use]
    #[inline]
    pub fn is_int64(&self) -> bool {
        matches!(self.storage, StorageType::Int64 | StorageType::UInt64)
    }
}

/// Variables of an FMU, in the order in which their values travel.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct VariableGroups {
    /// Those of numbers.
    pub numbers: Vec<VariableGroup>,
    /// Those of texts and bytes, which travel beside the numbers; each is one variable.
    pub texts: Vec<VariableGroup>,
}

/// A start value of an FMU.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StartValue {
    /// The variable.
    pub name: String,
    /// Its value reference.
    pub reference: u32,
    /// The form of its values.
    pub storage: StorageType,
    /// Its place in an array, and the number of elements there.
    pub element: (usize, usize),
    /// Who determines it during the run.
    pub causality: Causality,
    /// The value, of the variable's type.
    pub value: Value,
    /// Its place in a scenario; none when the command line gives it.
    #[serde(skip)]
    pub place: Option<SourceLocation>,
}

/// A place in the files of a scenario.
pub type SourceLocation = (Arc<diagnostics::SourceFiles>, Range<usize>);

impl StartValue {
    /// The error of an FMU called `node` that refuses the value, at the word that gives it.
    #[must_use]
    pub fn refusal_error(&self, node: &str, what: &str) -> Error {
        let name = &self.name;
        match &self.place {
            Some((source, place)) => {
                source.error_at(place.clone(), format!("`{node}` refuses `{name}`: {what}"), "")
            }
            None => Error::invalid_input(format!("--set {node}.{name}: the FMU refuses it: {what}")),
        }
    }
}

/// The error tolerance of one FMU.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FmuTolerance {
    /// The relative tolerance [-].
    pub relative: Option<f64>,
    /// In model exchange, the absolute tolerance of a state as a share of its nominal value [-].
    pub absolute: Option<f64>,
}

/// The kind of a node with its contents.
#[derive(Debug)]
pub enum NodeBody {
    /// An FMU with its start values and its recorded and connected variables.
    Fmu {
        /// The opened archive.
        fmu: Arc<Fmu>,
        /// The start values.
        starts: Vec<StartValue>,
        /// The connected inputs.
        inputs: VariableGroups,
        /// All outputs.
        outputs: VariableGroups,
        /// Whether it logs all it has to say.
        log: bool,
        /// Its error tolerance, where it is not that of all FMUs.
        tolerance: FmuTolerance,
        /// How it is kept apart from the others; without it, it is not.
        isolation: Option<FmuIsolation>,
    },
    /// Generated signals, one for each output.
    Signals(Vec<Signal>),
    /// A table, one column for each output.
    Table(TimeSeriesTable),
    /// The driver of a manoeuvre.
    Driver(DriverPlan),
    /// A node that the program brings along.
    Own,
    /// A connector, whose input is its output. It takes its value before the nodes that it leads to step.
    Inlet,
    /// The same; it takes its value after the node that it comes from has stepped.
    Outlet,
}

impl NodeBody {
    /// Whether it knows more than its inputs and the time.
    #[must_use]
    pub fn has_internal_state(&self) -> bool {
        matches!(self, NodeBody::Fmu { .. } | NodeBody::Driver(_) | NodeBody::Own)
    }
}

/// A node, and where its values are in the row.
#[derive(Debug)]
pub struct NodePlan {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub body: NodeBody,
    /// Its own step, if that is not the communication step.
    pub step_ratio: Option<StepRatio>,
    /// Its outputs that are numbers.
    pub outputs: NumberRange<AllVariables>,
    /// Those of them that somebody uses, none of which may be NaN.
    pub needed: Vec<NumberIndex<AllVariables>>,
    /// Its connected inputs that are numbers.
    pub inputs: NumberRange<AllVariables>,
    /// The connection of each of these inputs.
    pub connections: Vec<NumberConnection>,
    /// The same for texts.
    pub texts: NodeTextColumns,
    /// The same for integers of 64 bits, which are among the numbers, too.
    pub exact: NodeIntegerColumns,
    /// The faults of its calls.
    pub faults: Vec<CallFault>,
}

/// Indices of a node's integers of 64 bits in the row.
#[derive(Debug, Default)]
pub struct NodeIntegerColumns {
    /// Its outputs.
    pub outputs: IntegerRange<AllVariables>,
    /// The number of each output.
    pub numbers: Vec<NumberIndex<AllVariables>>,
    /// Its connected inputs.
    pub inputs: IntegerRange<AllVariables>,
    /// The connections with such an integer at one end or at both.
    pub connections: Vec<IntegerConnection>,
    /// Whether nobody uses any of its outputs.
    pub unneeded: bool,
}

/// What a connection of numbers is for an integer of 64 bits.
#[derive(Debug)]
pub struct IntegerConnection {
    /// Its place among the node's connections of numbers.
    pub place: usize,
    /// The output, if it is such an integer.
    pub source: Option<IntegerIndex<AllVariables>>,
    /// The input, if it is such an integer.
    pub input: Option<IntegerIndex<AllVariables>>,
    /// The integers that the input accepts when they arrive as they are; without it they go through the number, which has to
    /// hold them.
    pub as_it_is: Option<AcceptedValues>,
}

impl NodePlan {
    /// Whether it hands on a value and does nothing else.
    #[must_use]
    pub fn is_connector(&self) -> bool {
        matches!(self.body, NodeBody::Inlet | NodeBody::Outlet)
    }

    /// The node among `plans` that gives each connected input its value, numbers first, and at which end of the step it is taken.
    pub fn connected_sources<'a>(
        &'a self,
        plans: &'a [NodePlan],
    ) -> impl Iterator<Item = (usize, StepBoundary)> + 'a {
        let numbers = self.connections.iter().filter_map(|NumberConnection { source, .. }| {
            let gives = |plan: &NodePlan| plan.outputs.positions().contains(&source.index.position());
            Some((plans.iter().position(gives)?, source.at))
        });
        let texts = self.texts.connections.iter().filter_map(|source| {
            let gives = |plan: &NodePlan| plan.texts.outputs.positions().contains(&source.index.position());
            Some((plans.iter().position(gives)?, source.at))
        });
        numbers.chain(texts)
    }
}

/// Indices of a node's texts in the row.
#[derive(Debug, Default)]
pub struct NodeTextColumns {
    /// Its outputs.
    pub outputs: TextRange<AllVariables>,
    /// Its connected inputs.
    pub inputs: TextRange<AllVariables>,
    /// The source of each connected input.
    pub connections: Vec<InputSource<TextIndex<AllVariables>>>,
    /// Whether nobody uses any of its outputs.
    pub unneeded: bool,
}

/// Source of the value of an input.
#[derive(Debug, Clone, Copy)]
pub struct InputSource<I> {
    /// The index of the output.
    pub index: I,
    /// Which end of the step the value is taken at.
    pub at: StepBoundary,
}

/// A connection of numbers: source, unit conversion, effects and faults.
#[derive(Debug, Clone)]
pub struct NumberConnection {
    /// Source of the number.
    pub source: InputSource<NumberIndex<AllVariables>>,
    /// Its way to the input.
    pub input_chain: InputChain,
    /// The extrapolation of the input within a step; without one it holds its value.
    pub extrapolation: Option<ExtrapolationOrder>,
}

/// Coupled nodes: what the master works with.
#[derive(Debug)]
pub struct System {
    /// The coupling.
    pub coupling: CouplingPlan,
    /// The communication points.
    pub clock: CommunicationClock,
    /// The stop time that FMUs are told [s]; none when nobody knows it.
    pub announced_stop: Option<f64>,
    /// Relative tolerance that all FMUs are told [-].
    pub tolerance: Option<f64>,
    /// The nodes, in the order of the file.
    pub nodes: Vec<NodePlan>,
    /// The order in which they step.
    pub order: Vec<usize>,
    /// The variables of the run.
    pub columns: Columns<AllVariables>,
    /// Warnings.
    pub warnings: Vec<String>,
}
