//! Moves values between nodes and the row: the small steps that coupling algorithms are made of.

mod effort;
mod exact;
mod histogram;
mod route;
mod visit;

use std::time::Duration;

use diagnostics::{Error, rounded};
use fmu_import::{CallError, Version};
use recording::{Columns, Full, NumberIndex, Row};
use scenario::plan::{Body, Clock, InputChain, NodePlan, ResolvedConnection, System};
use scenario::words::At;

use crate::node::{Node, SAME};

pub use self::effort::Effort;
use self::effort::Efforts;
use self::route::Routes;

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
}

/// What an exchange remembers from one step to the next.
#[derive(Debug, Clone)]
pub struct Memory {
    start: Row<Full>,
    /// The row at the last communication point.
    pub row: Row<Full>,
    efforts: Efforts,
    notices: Vec<String>,
    last: Option<(usize, CallError)>,
    routes: Routes,
}

impl Memory {
    /// Before the first step.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let row = system.columns.row();
        let efforts = Efforts::of(system.nodes.len());
        let routes = Routes::of(&system.nodes);
        Memory { start: row.clone(), row, efforts, notices: Vec::new(), last: None, routes }
    }
}

/// The nodes and values of a run during one communication step. Nodes are addressed by their index in the
/// order of the file.
pub struct Exchange<'a> {
    pub(crate) plans: &'a mut [NodePlan],
    pub(crate) nodes: &'a mut [Box<dyn Node>],
    pub(crate) columns: &'a Columns<Full>,
    order: &'a [usize],
    clock: Clock,
    /// The row at the communication point where the step starts.
    start: Row<Full>,
    /// The row that becomes that of the end of the step.
    row: Row<Full>,
    tick: u64,
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
        let Memory { start, row, efforts, notices, last, routes } = memory;
        let clock = *clock;
        Exchange {
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
        let Exchange { start, row, efforts, notices, last, routes, .. } = self;
        Memory { start, row, efforts, notices, last, routes }
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
        match self.routes.texts {
            true => self.start.copy_from(&self.row),
            false => self.start.copy_numbers_from(&self.row),
        }
        self.efforts.begin();
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
            _ => self.lead(node),
        }
    }

    fn lead(&mut self, node: usize) -> Result<(), Interruption> {
        self.efforts.turn_to(node);
        let (clock, tick) = (self.clock, self.tick);
        let shown = |at| clock.at(tick + u64::from(at == At::End));
        let (plan, row) = (&mut self.plans[node], &mut self.row);
        if !plan.exact.connections.is_empty() {
            exact::check(plan, self.columns, (Some(&self.start), row), &shown)
                .map_err(Interruption::Value)?;
        }
        let time = clock.at(tick);
        for (ResolvedConnection { source, input_chain }, input) in
            plan.connections.iter_mut().zip(plan.inputs.indices())
        {
            let from = if source.at == At::Start { &self.start } else { &*row };
            row[input] = input_chain.value(from[source.index], time);
            accept(input_chain, self.columns, (source.index, input), row, || shown(source.at))
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
        let (clock, tick) = (self.clock, self.tick);
        self.efforts.count(node);
        let stepped = self.call(node, |plan, node, row| {
            set(plan, node, row)?;
            node.step(&clock, tick)
        });
        match stepped {
            Err(Interruption::Call { error, .. }) => self.ended(node, error),
            other => other,
        }
    }

    /// Takes the error of a node that stepped for its end, if it ended the run at the end of the step.
    fn ended(&mut self, node: usize, error: CallError) -> Result<(), Interruption> {
        let end = self.clock.at(self.tick + 1) - SAME * self.clock.step;
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
            self.lead(node)?;
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

    /// Lets the values of the first communication point settle: all nodes show their start values, then each
    /// pass hands them on in the order of the system.
    ///
    /// # Errors
    /// With the node, when one fails, or shows a value that is no number.
    pub fn initialise(&mut self, passes: usize) -> Result<(), Error> {
        for node in 0..self.nodes.len() {
            self.notices.extend(self.nodes[node].enter()?);
            self.initial_call(node, get)?;
        }
        for pass in 1..=passes {
            for &node in self.order {
                self.feed_initially(node)?;
                self.initial_call(node, |plan, node, row| {
                    set(plan, node, row)?;
                    if pass == passes {
                        node.ready()?;
                    }
                    get(plan, node, row)
                })?;
            }
        }
        let mut plans = self.plans.iter();
        let start = || self.clock.start;
        plans.try_for_each(|plan| check_numbers(plan, self.columns, &self.row, start))
    }

    fn initial_call(
        &mut self,
        node: usize,
        call: impl FnOnce(&NodePlan, &mut dyn Node, &mut Row<Full>) -> Result<(), CallError>,
    ) -> Result<(), Error> {
        let plan = &self.plans[node];
        call(plan, self.nodes[node].as_mut(), &mut self.row)
            .map_err(|error| failure(plan, error, self.clock.start))
    }

    /// Puts converted values into the inputs of a node, without effects and faults: they act from the first
    /// step on.
    fn feed_initially(&mut self, node: usize) -> Result<(), Error> {
        let (plan, row) = (&self.plans[node], &mut self.row);
        exact::check(plan, self.columns, (None, row), &|_| self.clock.start)?;
        for (ResolvedConnection { source, input_chain }, input) in
            plan.connections.iter().zip(plan.inputs.indices())
        {
            row[input] = input_chain.convert(row[source.index]);
            let start = || self.clock.start;
            accept(input_chain, self.columns, (source.index, input), row, start)?;
        }
        exact::carry(plan, None, row);
        for (source, input) in plan.texts.connections.iter().zip(plan.texts.inputs.indices()) {
            row.copy_text(source.index, input);
        }
        Ok(())
    }
}

/// The failed call of a node at a time [s].
#[must_use]
pub fn failure(plan: &NodePlan, error: CallError, time: f64) -> Error {
    Error::component(&plan.name, &error.call, Some(time), error.what)
}

fn set(plan: &NodePlan, node: &mut dyn Node, row: &Row<Full>) -> Result<(), CallError> {
    node.set(&row[plan.inputs])?;
    if !plan.exact.connections.is_empty() {
        node.set_integers(&row[plan.exact.inputs])?;
    }
    node.set_texts(&row[plan.texts.inputs])
}

fn get(plan: &NodePlan, node: &mut dyn Node, row: &mut Row<Full>) -> Result<(), CallError> {
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

/// A NaN spoils everything that it reaches, so the run ends where it appears.
#[inline]
fn check_numbers(
    plan: &NodePlan,
    columns: &Columns<Full>,
    row: &Row<Full>,
    time: impl FnOnce() -> f64,
) -> Result<(), Error> {
    match plan.needed.iter().copied().find(|&output| row[output].is_nan()) {
        None => Ok(()),
        Some(output) => Err(no_number(plan, &columns[output].variable, time())),
    }
}

#[cold]
fn no_number(plan: &NodePlan, output: &str, time: f64) -> Error {
    let version = match &plan.body {
        Body::Fmu { fmu, .. } => fmu.description.version,
        _ => Version::Two,
    };
    failure(plan, CallError::not_a_number(version, output), time)
}

/// Ends the run when a number is no value of the input's type: rounded it would look like a result. `time`
/// is when the source showed it [s].
#[inline]
fn accept(
    input_chain: &InputChain,
    columns: &Columns<Full>,
    (source, input): (NumberIndex<Full>, NumberIndex<Full>),
    row: &Row<Full>,
    time: impl FnOnce() -> f64,
) -> Result<(), Error> {
    let value = row[input];
    if input_chain.accepts.holds(value) {
        return Ok(());
    }
    Err(no_value(input_chain, [columns[input].name(), columns[source].name()], value, time()))
}

#[cold]
fn no_value(input_chain: &InputChain, [to, from]: [String; 2], value: f64, time: f64) -> Error {
    let (time, expected) = (rounded(time), input_chain.accepts.expected());
    let error = Error::input(format!(
        "`{to}` would get {value} from `{from}` at t = {time} s, but it is {expected}"
    ));
    error.help("let the source have such values only; `quantise = 1.0` on the connection rounds to whole numbers")
}
