//! Moves values between nodes and the row: the small steps that coupling algorithms are made of.

mod effort;
mod exact;
mod extrapolated;
mod histogram;
mod initial;
mod inputs;
mod limits;
mod loops;
mod snapshot;
mod step_node;

use std::ops::Range;
use std::time::Duration;

use diagnostics::Error;
use fmu_import::CallError;
use recording::{Columns, Full, Row};

pub use self::effort::Effort;
use self::effort::Efforts;
pub use self::initial::TearValue;
pub use self::inputs::GuessedInput;
use self::inputs::PlainConnections;
use self::limits::{accept, check_numbers};
pub use self::loops::ConnectionValues;
pub(crate) use self::loops::{check_failures, lacking, unsolved};
pub use self::snapshot::Snapshot;
use crate::clock::Clock;
use crate::extrapolation::ExtrapolatedInput;
use crate::node::{InputPolynomial, Node, SAME};
use crate::system::{Body, NodePlan, System};

/// Why a step did not come to its end.
#[derive(Debug)]
pub enum Interruption {
    /// A call of a node failed, or the node ended the run.
    Call {
        /// The index of the node.
        node: usize,
        /// The call.
        error: CallError,
    },
    /// A value does not fit its column.
    Value(Error),
    /// A loop has no values that fit, or a step is too long.
    Unsolved(Error),
}

/// The end of a run by a node at the end of a step.
#[derive(Debug, Clone)]
pub struct NodeStop {
    /// The index of the node.
    pub node: usize,
    /// Its call, with the reason.
    pub error: CallError,
}

/// What an exchange remembers from one step to the next.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    start: Row<Full>,
    /// The row at the last communication point.
    pub row: Row<Full>,
    efforts: Efforts,
    notices: Vec<String>,
    stop: Option<NodeStop>,
    /// The inputs that are extrapolated within a step, by node.
    pub extrapolated: Vec<Vec<ExtrapolatedInput>>,
    plain: PlainConnections,
}

impl Memory {
    /// Before the first step.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let row = system.columns.row();
        let efforts = Efforts::of(system.nodes.len());
        let extrapolated = system.nodes.iter().map(extrapolated::inputs).collect();
        let (notices, plain) = (Vec::new(), PlainConnections::of(&system.nodes));
        Memory { start: row.clone(), row, efforts, notices, stop: None, extrapolated, plain }
    }
}

/// The nodes and values of a run during one communication step. Nodes are addressed by their index in the
/// order of the file.
pub struct Exchange<'a> {
    pub(crate) plans: &'a mut [NodePlan],
    pub(crate) nodes: &'a mut [Box<dyn Node>],
    pub(crate) columns: &'a Columns<Full>,
    pub(crate) order: &'a [usize],
    clock: Clock,
    /// The row at the communication point where the step starts.
    start: Row<Full>,
    /// The row that becomes that of the end of the step.
    pub(crate) row: Row<Full>,
    tick: u64,
    /// The step that is done: the communication step from `tick` on, or a part of it, by its clock and the number of its first point.
    part: (Clock, u64),
    /// Whether the part begins at the communication point, where sensors take their samples.
    samples: bool,
    extrapolated: Vec<Vec<ExtrapolatedInput>>,
    /// Memory for the inputs of a node that is extrapolated, and for their polynomials.
    input_buffer: Vec<f64>,
    polynomial_buffer: Vec<InputPolynomial>,
    efforts: Efforts,
    /// What nodes did not keep of what they were told.
    notices: Vec<String>,
    stop: Option<NodeStop>,
    /// Whether a node has messages.
    message_flag: bool,
    plain: PlainConnections,
}

impl<'a> Exchange<'a> {
    /// Prepares the exchange between the nodes of a system.
    #[must_use]
    pub fn new(system: &'a mut System, nodes: &'a mut [Box<dyn Node>]) -> Self {
        let memory = Memory::new(system);
        Self::resume(system, nodes, memory)
    }

    /// Goes on with what an exchange of the same system remembered.
    #[must_use]
    pub fn resume(system: &'a mut System, nodes: &'a mut [Box<dyn Node>], memory: Memory) -> Self {
        let System { nodes: plans, order, columns, clock, .. } = system;
        let Memory { start, row, efforts, notices, stop, extrapolated, plain } = memory;
        let clock = *clock;
        Exchange {
            part: (clock, 0),
            samples: true,
            extrapolated,
            input_buffer: Vec::new(),
            polynomial_buffer: Vec::new(),
            plans,
            nodes,
            columns,
            order,
            clock,
            start,
            row,
            tick: 0,
            efforts,
            notices,
            stop,
            message_flag: true,
            plain,
        }
    }

    /// Whether a node may have messages that were there at the end of its step, or other ones; from here on none has.
    pub(crate) fn take_message_flag(&mut self) -> bool {
        std::mem::take(&mut self.message_flag)
    }

    /// What it remembers.
    #[must_use]
    pub fn into_memory(self) -> Memory {
        let Exchange { start, row, efforts, notices, stop, extrapolated, plain, .. } = self;
        Memory { start, row, efforts, notices, stop, extrapolated, plain }
    }

    /// The nodes in the order in which they step.
    #[must_use]
    pub fn order(&self) -> &'a [usize] {
        self.order
    }

    /// The plans of the nodes.
    #[must_use]
    pub fn plans(&self) -> &[NodePlan] {
        self.plans
    }

    /// The columns of the row.
    #[must_use]
    pub fn columns(&self) -> &'a Columns<Full> {
        self.columns
    }

    /// The communication points.
    #[must_use]
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// The row that becomes that of the end of the step.
    #[must_use]
    pub fn row(&self) -> &Row<Full> {
        &self.row
    }

    /// The effort of each node so far, after a step.
    #[must_use]
    pub fn efforts(&mut self) -> &[Effort] {
        self.efforts.all()
    }

    /// Counts from here on the steps of nodes that take longer than this, in real time.
    pub fn set_deadline(&mut self, deadline: Duration) {
        self.efforts.set_deadline(deadline);
    }

    /// What nodes did not keep of what they were told.
    #[must_use]
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// Begins the step from communication point `tick` on: the row is that of its start.
    pub fn begin(&mut self, tick: u64) {
        self.tick = tick;
        self.begin_part(self.clock, tick);
        self.efforts.begin();
    }

    /// Begins a part of the step: that from point `tick` of a finer clock on.
    pub fn begin_part(&mut self, clock: Clock, tick: u64) {
        self.part = (clock, tick);
        self.samples = clock.at(tick) == self.clock.at(self.tick);
        match self.plain.has_texts {
            true => self.start.copy_from(&self.row),
            false => self.start.copy_numbers_from(&self.row),
        }
    }

    /// The communication point at which the step begins.
    #[must_use]
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Begin and end of the part [s].
    #[must_use]
    pub fn span(&self) -> Range<f64> {
        let (clock, tick) = &self.part;
        clock.at(*tick)..clock.at(tick + 1)
    }

    /// Hands a node its inputs and lets it go to the end of the step. A node that ends the run there does so for all: the others
    /// come to the same time.
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step.
    pub fn do_step(&mut self, node: usize) -> Result<(), Interruption> {
        let (clock, tick) = self.part;
        self.efforts.count(node);
        let stepped = match self.extrapolated[node].is_empty() {
            true => self.call(node, |plan, node, row| {
                set_inputs(plan, node, row)?;
                node.do_step(&clock, tick)
            }),
            false => self.do_extrapolated_step(node),
        };
        match stepped {
            Err(Interruption::Call { error, .. }) => self.stop_or_fail(node, error),
            other => other,
        }
    }

    /// Takes the error of a node that stepped for its end, if it ended the run at the end of the step.
    fn stop_or_fail(&mut self, node: usize, error: CallError) -> Result<(), Interruption> {
        let end = self.span().end - SAME * self.part.0.step;
        if error.terminated.is_none_or(|at| at < end) {
            return Err(Interruption::Call { node, error });
        }
        self.stop.get_or_insert(NodeStop { node, error });
        Ok(())
    }

    /// The node that ended the run at the end of this step, and how.
    #[must_use]
    pub fn stop(&self) -> Option<&NodeStop> {
        self.stop.as_ref()
    }

    /// The row of a node that ended the run between the communication points: its outputs, with all else as at the start of the
    /// step; nothing when they cannot be read.
    pub fn row_at_stop(&mut self, node: usize) -> Option<&Row<Full>> {
        self.row.copy_from(&self.start);
        self.read_outputs(node).is_ok().then_some(&self.row)
    }

    /// Reads the outputs of a node into the row.
    ///
    /// # Errors
    /// When the node fails, or an output is NaN.
    pub fn read_outputs(&mut self, node: usize) -> Result<(), Interruption> {
        if matches!(self.plans[node].body, Body::Outlet) {
            self.gather(node, &[])?;
        }
        self.call(node, get_outputs)?;
        self.message_flag |= self.nodes[node].has_messages();
        self.check_outputs(node)
    }

    fn call(
        &mut self,
        node: usize,
        call: impl FnOnce(&NodePlan, &mut dyn Node, &mut Row<Full>) -> Result<(), CallError>,
    ) -> Result<(), Interruption> {
        self.efforts.turn_to(node);
        call(&self.plans[node], self.nodes[node].as_mut(), &mut self.row).map_err(|error| {
            self.efforts.rest();
            Interruption::Call { node, error }
        })
    }
}

/// The failed call of a node at a time [s].
#[must_use]
pub fn failure(plan: &NodePlan, error: CallError, time: f64) -> Error {
    let mut what = error.what;
    if error.discarded {
        what += "; with `on_discard = \"halve\"` in [coupling] all nodes go back and do the step in halves";
    }
    Error::component(&plan.name, &error.call, Some(time), what)
}

fn set_inputs(plan: &NodePlan, node: &mut dyn Node, row: &Row<Full>) -> Result<(), CallError> {
    node.set_inputs(&row[plan.inputs])?;
    set_typed_values(plan, node, row)
}

/// Gives a node its inputs besides the numbers.
fn set_typed_values(
    plan: &NodePlan,
    node: &mut dyn Node,
    row: &Row<Full>,
) -> Result<(), CallError> {
    let (integers, texts) = (!plan.exact.connections.is_empty(), &row[plan.texts.inputs]);
    if !integers && texts.is_empty() {
        return Ok(());
    }
    let Some(node) = node.typed_values() else { return Ok(()) };
    if integers {
        node.set_integers(&row[plan.exact.inputs])?;
    }
    if texts.is_empty() { Ok(()) } else { node.set_texts(texts) }
}

pub(crate) fn get_outputs(
    plan: &NodePlan,
    node: &mut dyn Node,
    row: &mut Row<Full>,
) -> Result<(), CallError> {
    node.get_outputs(&mut row[plan.outputs])?;
    let integers = !plan.exact.numbers.is_empty() && !plan.exact.unneeded;
    let texts = !plan.texts.unneeded && !plan.texts.outputs.positions().is_empty();
    if !integers && !texts {
        return Ok(());
    }
    let Some(node) = node.typed_values() else { return Ok(()) };
    if integers {
        node.get_integers(&mut row[plan.exact.outputs])?;
        for pair in plan.exact.outputs.indices().zip(plan.exact.numbers.iter().copied()) {
            row.put(pair, row[pair.0]);
        }
    }
    if texts { node.get_texts(&mut row[plan.texts.outputs]) } else { Ok(()) }
}
