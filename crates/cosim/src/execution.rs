//! Steps a system of nodes from communication point to communication point, for programs that want the values in between.

use diagnostics::{Error, rounded_time};
use fmu_import::CallError;
use recording::{AllVariables, ColumnIndex, Row};

use crate::coupling::{self, CouplingAlgorithm};
use crate::exchange::{Exchange, ExchangeState, NodeTermination, StepInterruption, call_failure_error};
use crate::node::Node;
use crate::system::System;

/// A system of nodes on its way. [`initialise`](Self::initialise) comes first, then steps, then [`terminate`](Self::terminate).
pub struct Execution {
    /// The system.
    pub system: System,
    /// Its nodes, in its order.
    pub nodes: Vec<Box<dyn Node>>,
    /// Its coupling algorithm.
    pub coupling: Box<dyn CouplingAlgorithm>,
    /// What the exchange remembers; with the row of the last communication point.
    pub memory: ExchangeState,
    /// The last communication point.
    pub tick: u64,
}

impl Execution {
    /// Before the initialisation.
    #[must_use]
    pub fn new(system: System, nodes: Vec<Box<dyn Node>>) -> Self {
        let coupling = coupling::create_coupling(&system);
        let memory = ExchangeState::new(&system);
        Execution { system, nodes, coupling, memory, tick: 0 }
    }

    /// The time of the last communication point [s].
    #[must_use]
    pub fn time(&self) -> f64 {
        self.system.clock.time_at(self.tick)
    }

    /// The values at the last communication point.
    #[must_use]
    pub fn row(&self) -> &Row<AllVariables> {
        &self.memory.row
    }

    /// The number that a variable has at the last communication point, by its name `node.variable`; none if there is no such number.
    #[must_use]
    pub fn variable_value(&self, name: &str) -> Option<f64> {
        match self.system.columns.find(name)? {
            ColumnIndex::Number(index) => Some(self.row()[index]),
            ColumnIndex::Text(_) => None,
        }
    }

    /// Initialises the nodes and lets the values of the first communication point settle.
    ///
    /// # Errors
    /// With the node and the call, when a node fails; when a value fits no input.
    pub fn initialise(&mut self) -> Result<(), Error> {
        self.with_exchange(|exchange, coupling| coupling.initialise(exchange))
    }

    /// Goes on by one communication step.
    ///
    /// # Errors
    /// Why the step did not come to its end; a node that ends the run as planned is one of the reasons.
    pub fn try_step(&mut self) -> Result<(), StepInterruption> {
        let tick = self.tick;
        self.tick += 1;
        self.with_exchange(|exchange, coupling| {
            exchange.begin_step(tick);
            coupling.step(exchange)?;
            match exchange.node_termination().cloned() {
                Some(NodeTermination { node, error }) => Err(StepInterruption::Call { node, error }),
                None => Ok(()),
            }
        })
    }

    /// Goes on by one communication step.
    ///
    /// # Errors
    /// With the node, the call and the time, when a node fails or ends the run; when a value fits no input, or a loop is not solved.
    pub fn step(&mut self) -> Result<(), Error> {
        let (clock, tick) = (self.system.clock, self.tick);
        self.try_step().map_err(|interruption| match interruption {
            StepInterruption::Value(error) | StepInterruption::Unsolved(error) => error,
            StepInterruption::Call { node, error } => {
                let time = clock.time_at(tick + u64::from(error.is_at_step_end()));
                self.node_failure_error(node, error, time)
            }
        })
    }

    /// Goes on to the last communication point that is not after a time [s].
    ///
    /// # Errors
    /// As of [`step`](Self::step); when the system ends before that time.
    pub fn simulate_until(&mut self, time: f64) -> Result<(), Error> {
        let clock = self.system.clock;
        // A millionth of a step is rounding.
        let last = ((time - clock.start) / clock.step + 1e-6).floor().max(0.0) as u64;
        if last > clock.steps {
            let (stop, time) = (rounded_time(clock.stop_time()), rounded_time(time));
            return Err(Error::invalid_input(format!("the system ends at {stop} s, before {time} s")));
        }
        while self.tick < last {
            self.step()?;
        }
        Ok(())
    }

    /// Ends the run of all nodes.
    ///
    /// # Errors
    /// With the first node that refuses.
    pub fn terminate(&mut self) -> Result<(), Error> {
        let time = self.time();
        let mut all = self.system.nodes.iter().zip(&mut self.nodes);
        all.try_for_each(|(plan, node)| {
            node.terminate().map_err(|error| call_failure_error(plan, error, time))
        })
    }

    /// Works on the nodes with the coupling.
    pub fn with_exchange<T>(
        &mut self,
        work: impl FnOnce(&mut Exchange, &mut dyn CouplingAlgorithm) -> T,
    ) -> T {
        let memory = std::mem::take(&mut self.memory);
        let mut exchange = Exchange::resume_from_state(&mut self.system, &mut self.nodes, memory);
        let done = work(&mut exchange, self.coupling.as_mut());
        self.memory = exchange.into_state();
        done
    }

    /// The error of a node whose call failed, or that ended the run, at a time [s].
    #[must_use]
    pub fn node_failure_error(&self, node: usize, error: CallError, time: f64) -> Error {
        call_failure_error(&self.system.nodes[node], error, time)
    }
}
