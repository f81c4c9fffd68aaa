//! Moves values between nodes and the row: the small steps that coupling algorithms are made of.

mod along;
mod effort;
mod exact;
mod histogram;
mod initial;
mod judge;
mod loops;
mod route;
mod snapshot;
mod visit;

use std::time::Duration;

use diagnostics::Error;
use fmu_import::CallError;
use recording::{Columns, Full, Row};

pub use self::effort::Effort;
use self::effort::Efforts;
pub use self::initial::Solved;
use self::judge::{accept, check_numbers};
pub(crate) use self::loops::{check_failures, lacking, unsolved};
use self::route::Routes;
pub use self::snapshot::Snapshot;
use crate::clock::{At, Clock};
use crate::course::{Course, Moving};
use crate::node::{Node, SAME};
use crate::system::{Body, NodePlan, ResolvedConnection, System};

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

/// What an exchange remembers from one step to the next.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    start: Row<Full>,
    /// The row at the last communication point.
    pub row: Row<Full>,
    efforts: Efforts,
    notices: Vec<String>,
    last: Option<(usize, CallError)>,
    /// The inputs that have courses within a step, by node.
    pub moving: Vec<Vec<Moving>>,
    routes: Routes,
}

impl Memory {
    /// Before the first step.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let row = system.columns.row();
        let efforts = Efforts::of(system.nodes.len());
        let moving = system.nodes.iter().map(along::moving).collect();
        let (notices, routes) = (Vec::new(), Routes::of(&system.nodes));
        Memory { start: row.clone(), row, efforts, notices, last: None, moving, routes }
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
    moving: Vec<Vec<Moving>>,
    /// Inputs of the node that takes courses, and these.
    scratch: (Vec<f64>, Vec<(usize, Course)>),
    efforts: Efforts,
    /// What nodes did not keep of what they were told.
    notices: Vec<String>,
    /// The node that ended the run at the end of this step, and how.
    last: Option<(usize, CallError)>,
    /// Whether a node has messages.
    spoke: bool,
    routes: Routes,
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
        let Memory { start, row, efforts, notices, last, moving, routes } = memory;
        let clock = *clock;
        Exchange {
            part: (clock, 0),
            samples: true,
            moving,
            scratch: Default::default(),
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
            last,
            spoke: true,
            routes,
        }
    }

    /// Whether a node may have messages that were there at the end of its step, or other ones; from here on none has.
    pub(crate) fn take_spoke(&mut self) -> bool {
        std::mem::take(&mut self.spoke)
    }

    /// What it remembers.
    #[must_use]
    pub fn into_memory(self) -> Memory {
        let Exchange { start, row, efforts, notices, last, moving, routes, .. } = self;
        Memory { start, row, efforts, notices, last, moving, routes }
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
    pub fn keep_to(&mut self, deadline: Duration) {
        self.efforts.keep_to(deadline);
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
        match self.routes.texts {
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
    pub fn span(&self) -> (f64, f64) {
        let (clock, tick) = &self.part;
        (clock.at(*tick), clock.at(tick + 1))
    }

    /// Puts the inputs of a node for this step into the row. Effects and faults of its connections go on by one
    /// step with each call.
    ///
    /// # Errors
    /// When an input does not accept its value.
    pub fn feed(&mut self, node: usize) -> Result<(), Interruption> {
        self.efforts.turn_to(node);
        if self.lead_directly(node) {
            return Ok(());
        }
        match self.plans[node].body {
            // It gets its value when that is there.
            Body::Outlet => Ok(()),
            _ => self.lead(node, &[]),
        }
    }

    /// Leads values to the inputs of a node; those of some connections, by their places, are given.
    fn lead(&mut self, node: usize, given: &[(usize, f64)]) -> Result<(), Interruption> {
        self.efforts.turn_to(node);
        let span = self.span();
        let shown = |at| if at == At::End { span.1 } else { span.0 };
        let (plan, row) = (&mut self.plans[node], &mut self.row);
        if !plan.exact.connections.is_empty() {
            exact::check(plan, self.columns, (Some(&self.start), row), &shown)
                .map_err(Interruption::Value)?;
        }
        // Faults begin and end at communication points.
        let time = self.clock.at(self.tick);
        let links = plan.connections.iter_mut().zip(plan.inputs.indices()).enumerate();
        for (place, (ResolvedConnection { source, input_chain, .. }, input)) in links {
            if let Some((_, value)) = given.iter().find(|(own, _)| *own == place) {
                row[input] = *value;
                continue;
            }
            if !self.samples && !input_chain.effects.is_empty() {
                continue;
            }
            let from = if source.at == At::Start { &self.start } else { &*row };
            row[input] = input_chain.value(from[source.index], time);
            let (ends, shown) = ((source.index, input), || shown(source.at));
            accept(input_chain, self.columns, ends, row[input], shown)
                .map_err(Interruption::Value)?;
        }
        exact::carry(plan, Some(&self.start), row);
        for (source, input) in plan.texts.connections.iter().zip(plan.texts.inputs.indices()) {
            match source.at {
                At::Start => row[input].clone_from(&self.start[source.index]),
                At::End => row.copy_text(source.index, input),
            }
        }
        Ok(())
    }

    /// Hands a node its inputs and lets it go to the end of the step. A node that ends the run there does so for all: the others
    /// come to the same time.
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step.
    pub fn step(&mut self, node: usize) -> Result<(), Interruption> {
        let (clock, tick) = self.part;
        self.efforts.count(node);
        let stepped = match self.moving[node].is_empty() {
            true => self.call(node, |plan, node, row| {
                set(plan, node, row)?;
                node.step(&clock, tick)
            }),
            false => self.step_along(node),
        };
        match stepped {
            Err(Interruption::Call { error, .. }) => self.ended(node, error),
            other => other,
        }
    }

    /// Takes the error of a node that stepped for its end, if it ended the run at the end of the step.
    fn ended(&mut self, node: usize, error: CallError) -> Result<(), Interruption> {
        let end = self.span().1 - SAME * self.part.0.step;
        if error.terminated.is_none_or(|at| at < end) {
            return Err(Interruption::Call { node, error });
        }
        self.last.get_or_insert((node, error));
        Ok(())
    }

    /// The node that ended the run at the end of this step, and how.
    #[must_use]
    pub fn last(&self) -> Option<&(usize, CallError)> {
        self.last.as_ref()
    }

    /// The row of a node that ended the run between the communication points: its outputs, with all else as at the start of the
    /// step; nothing when they cannot be read.
    pub fn cut_short(&mut self, node: usize) -> Option<&Row<Full>> {
        self.row.copy_from(&self.start);
        self.read(node).is_ok().then_some(&self.row)
    }

    /// Reads the outputs of a node into the row.
    ///
    /// # Errors
    /// When the node fails, or an output is NaN.
    pub fn read(&mut self, node: usize) -> Result<(), Interruption> {
        if matches!(self.plans[node].body, Body::Outlet) {
            self.lead(node, &[])?;
        }
        self.call(node, get)?;
        self.spoke |= self.nodes[node].has_messages();
        self.check(node)
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

fn set(plan: &NodePlan, node: &mut dyn Node, row: &Row<Full>) -> Result<(), CallError> {
    node.set(&row[plan.inputs])?;
    set_others(plan, node, row)
}

/// Gives a node its inputs besides the numbers.
fn set_others(plan: &NodePlan, node: &mut dyn Node, row: &Row<Full>) -> Result<(), CallError> {
    if !plan.exact.connections.is_empty() {
        node.set_integers(&row[plan.exact.inputs])?;
    }
    node.set_texts(&row[plan.texts.inputs])
}

pub(crate) fn get(
    plan: &NodePlan,
    node: &mut dyn Node,
    row: &mut Row<Full>,
) -> Result<(), CallError> {
    node.get(&mut row[plan.outputs])?;
    if !plan.exact.numbers.is_empty() && !plan.exact.unneeded {
        node.get_integers(&mut row[plan.exact.outputs])?;
        for pair in plan.exact.outputs.indices().zip(plan.exact.numbers.iter().copied()) {
            row.put(pair, row[pair.0]);
        }
    }
    match plan.texts.unneeded {
        true => Ok(()),
        false => node.get_texts(&mut row[plan.texts.outputs]),
    }
}
