//! Moves values between nodes and the row: the small steps that coupling algorithms are made of.

mod concurrent;
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
use fmu_import::{CallError, StepMemory};
use recording::{AllVariables, Columns, Row};

pub use self::concurrent::ConcurrencySummary;
use self::concurrent::ConcurrentSteps;
pub use self::effort::NodeStepTiming;
use self::effort::TimingCollector;
pub use self::initial::TearValue;
use self::inputs::DirectConnections;
pub use self::inputs::GuessedInput;
use self::limits::{check_accepted_value, check_outputs_not_nan};
pub use self::loops::ConnectionValues;
pub(crate) use self::loops::{check_failures, quoted_node_names, unsolved_loop_interruption};
pub use self::snapshot::ExchangeSnapshot;
use crate::clock::CommunicationClock;
use crate::extrapolation::ExtrapolatedInput;
use crate::node::{InputPolynomial, Node, SAME};
use crate::system::{NodeBody, NodePlan, System};

/// Why a step did not come to its end.
#[derive(Debug)]
pub enum StepInterruption {
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
#[non_exhaustive]
pub struct NodeTermination {
    /// The index of the node.
    pub node: usize,
    /// Its call, with the reason.
    pub error: CallError,
}

/// What an exchange remembers from one step to the next.
#[derive(Debug, Clone, Default)]
pub struct ExchangeState {
    start: Row<AllVariables>,
    /// The row at the last communication point.
    pub row: Row<AllVariables>,
    efforts: TimingCollector,
    notices: Vec<String>,
    stop: Option<NodeTermination>,
    /// The inputs that are extrapolated within a step, by node.
    pub extrapolated: Vec<Vec<ExtrapolatedInput>>,
    plain: DirectConnections,
    concurrent: ConcurrentSteps,
    /// Whether a node has messages.
    message_flag: bool,
    /// So many messages of FMUs of this process were seen.
    seen_messages: u64,
    step_memory: StepMemory,
}

impl ExchangeState {
    /// Before the first step.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let row = system.columns.zero_row();
        let efforts = TimingCollector::for_nodes(system.nodes.len());
        let extrapolated: Vec<_> =
            system.nodes.iter().map(extrapolated::extrapolated_inputs_of_node).collect();
        let (notices, plain) = (Vec::new(), DirectConnections::from_plans(&system.nodes, &extrapolated));
        let start = row.clone();
        let message_flag = true;
        ExchangeState {
            start,
            row,
            efforts,
            notices,
            stop: None,
            extrapolated,
            plain,
            concurrent: ConcurrentSteps::default(),
            message_flag,
            seen_messages: 0,
            step_memory: StepMemory::default(),
        }
    }

    /// Whether a node may have messages that were there at the end of its step, or other ones; from here on none has.
    #[inline]
    pub fn take_message_flag(&mut self) -> bool {
        std::mem::take(&mut self.message_flag)
    }
}

/// The nodes and values of a run during one communication step. Nodes are addressed by their index in the
/// order of the file.
pub struct Exchange<'a> {
    pub(crate) plans: &'a mut [NodePlan],
    pub(crate) nodes: &'a mut [Box<dyn Node>],
    pub(crate) columns: &'a Columns<AllVariables>,
    pub(crate) order: &'a [usize],
    clock: CommunicationClock,
    /// What it remembers from one step to the next.
    pub(crate) state: ExchangeState,
    tick: u64,
    /// The step that is done: the communication step from `tick` on, or a part of it, by its clock and the number of its first point.
    part: (CommunicationClock, u64),
    /// Memory for the inputs of a node that is extrapolated, and for their polynomials.
    input_buffer: Vec<f64>,
    polynomial_buffer: Vec<InputPolynomial>,
}

impl<'a> Exchange<'a> {
    /// Prepares the exchange between the nodes of a system.
    #[must_use]
    pub fn new(system: &'a mut System, nodes: &'a mut [Box<dyn Node>]) -> Self {
        let mut state = ExchangeState::new(system);
        state.concurrent = ConcurrentSteps::new(&system.nodes, &system.order, nodes);
        Self::resume_from_state(system, nodes, state)
    }

    /// Goes on with what an exchange of the same system remembered.
    #[must_use]
    pub fn resume_from_state(
        system: &'a mut System,
        nodes: &'a mut [Box<dyn Node>],
        state: ExchangeState,
    ) -> Self {
        let System { nodes: plans, order, columns, clock, .. } = system;
        let clock = *clock;
        Exchange {
            part: (clock, 0),
            input_buffer: Vec::new(),
            polynomial_buffer: Vec::new(),
            plans,
            nodes,
            columns,
            order,
            clock,
            state,
            tick: 0,
        }
    }

    /// What it remembers.
    #[must_use]
    pub fn into_state(self) -> ExchangeState {
        self.state
    }

    /// The nodes in the order in which they step.
    #[must_use]
    pub fn node_order(&self) -> &'a [usize] {
        self.order
    }

    /// The plans of the nodes.
    #[must_use]
    pub fn node_plans(&self) -> &[NodePlan] {
        self.plans
    }

    /// The columns of the row.
    #[must_use]
    pub fn columns(&self) -> &'a Columns<AllVariables> {
        self.columns
    }

    /// The communication points.
    #[must_use]
    pub fn clock(&self) -> CommunicationClock {
        self.clock
    }

    /// The row that becomes that of the end of the step.
    #[must_use]
    pub fn row(&self) -> &Row<AllVariables> {
        &self.state.row
    }

    /// The effort of each node so far, after a step.
    #[must_use]
    pub fn node_timings(&mut self) -> &[NodeStepTiming] {
        self.state.efforts.node_timings()
    }

    /// Counts from here on the steps of nodes that take longer than this, in real time.
    pub fn set_deadline(&mut self, deadline: Duration) {
        self.state.efforts.set_deadline(deadline);
    }

    /// What nodes did not keep of what they were told.
    #[must_use]
    pub fn notices(&self) -> &[String] {
        &self.state.notices
    }

    /// Begins the step from communication point `tick` on: the row is that of its start.
    #[inline]
    pub fn begin_step(&mut self, tick: u64) {
        self.tick = tick;
        self.begin_substep(self.clock, tick);
        self.state.efforts.begin_step();
    }

    /// Begins a part of the step: that from point `tick` of a finer clock on.
    #[inline]
    pub fn begin_substep(&mut self, clock: CommunicationClock, tick: u64) {
        self.part = (clock, tick);
        match self.state.plain.has_texts {
            true => self.state.start.copy_from(&self.state.row),
            false => self.state.start.copy_numbers_from(&self.state.row),
        }
    }

    /// Whether the part begins at the communication point, where sensors take their samples.
    fn begins_at_communication_point(&self) -> bool {
        self.step_interval().start == self.clock.time_at(self.tick)
    }

    /// The communication point at which the step begins.
    #[must_use]
    pub fn start_tick(&self) -> u64 {
        self.tick
    }

    /// Begin and end of the part [s].
    #[must_use]
    pub fn step_interval(&self) -> Range<f64> {
        let (clock, tick) = &self.part;
        clock.time_at(*tick)..clock.time_at(tick + 1)
    }

    /// Hands a node its inputs and lets it go to the end of the step. A node that ends the run there does so for all: the others
    /// come to the same time.
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step.
    pub fn do_step(&mut self, node: usize) -> Result<(), StepInterruption> {
        let (clock, tick) = self.part;
        self.state.efforts.count_step(node);
        let stepped = match self.state.extrapolated[node].is_empty() {
            true => self.call_node(node, |plan, node, row| {
                set_inputs(plan, node, row)?;
                node.do_step(&clock, tick)
            }),
            false => self.do_extrapolated_step(node),
        };
        match stepped {
            Err(StepInterruption::Call { error, .. }) => self.handle_step_error(node, error),
            other => other,
        }
    }

    /// Takes the error of a node that stepped for its end, if it ended the run at the end of the step.
    fn handle_step_error(&mut self, node: usize, error: CallError) -> Result<(), StepInterruption> {
        let end = self.step_interval().end - SAME * self.part.0.step;
        if error.terminated.is_none_or(|at| at < end) {
            return Err(StepInterruption::Call { node, error });
        }
        self.state.stop.get_or_insert(NodeTermination { node, error });
        Ok(())
    }

    /// The node that ended the run at the end of this step, and how.
    #[must_use]
    pub fn node_termination(&self) -> Option<&NodeTermination> {
        self.state.stop.as_ref()
    }

    /// The row of a node that ended the run between the communication points: its outputs, with all else as at the start of the
    /// step; nothing when they cannot be read.
    pub fn row_at_termination(&mut self, node: usize) -> Option<&Row<AllVariables>> {
        self.state.row.copy_from(&self.state.start);
        self.read_outputs(node).is_ok().then_some(&self.state.row)
    }

    /// Reads the outputs of a node into the row.
    ///
    /// # Errors
    /// When the node fails, or an output is NaN.
    pub fn read_outputs(&mut self, node: usize) -> Result<(), StepInterruption> {
        if matches!(self.plans[node].body, NodeBody::Outlet) {
            self.gather_all_inputs(node, &[])?;
        }
        self.call_node(node, get_outputs)?;
        self.state.message_flag |= self.nodes[node].has_messages();
        self.check_outputs(node)
    }

    fn call_node(
        &mut self,
        node: usize,
        call: impl FnOnce(&NodePlan, &mut dyn Node, &mut Row<AllVariables>) -> Result<(), CallError>,
    ) -> Result<(), StepInterruption> {
        self.state.efforts.start_timing_node(node);
        call(&self.plans[node], self.nodes[node].as_mut(), &mut self.state.row).map_err(|error| {
            self.state.efforts.stop_timing_node();
            StepInterruption::Call { node, error }
        })
    }
}

/// The failed call of a node at a time [s].
#[must_use]
pub fn call_failure_error(plan: &NodePlan, error: CallError, time: f64) -> Error {
    let mut what = error.what;
    if error.discarded {
        what += "; with `on_discard = \"halve\"` in [coupling] all nodes go back and do the step in halves";
    }
    Error::node_failure(&plan.name, &error.call, Some(time), what)
}

fn set_inputs(plan: &NodePlan, node: &mut dyn Node, row: &Row<AllVariables>) -> Result<(), CallError> {
    node.set_inputs(&row[plan.inputs])?;
    set_typed_values(plan, node, row)
}

/// Gives a node its inputs besides the numbers.
fn set_typed_values(plan: &NodePlan, node: &mut dyn Node, row: &Row<AllVariables>) -> Result<(), CallError> {
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
    row: &mut Row<AllVariables>,
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
        for (integer, number) in plan.exact.outputs.indices().zip(plan.exact.numbers.iter().copied()) {
            row.set_integer(integer, number, row[integer]);
        }
    }
    if texts { node.get_texts(&mut row[plan.texts.outputs]) } else { Ok(()) }
}
