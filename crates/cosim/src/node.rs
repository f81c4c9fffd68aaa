//! Gives everything that is stepped one face: FMUs, generated signals and recorded tables.

use std::sync::Arc;

use diagnostics::Error;
use fmu_import::{CallError, Fmu, Instance, Message};
use recording::table::Table;
use scenario::plan::{Body, Clock, NodePlan, Ports, Start, StartValue, System};
use scenario::signal::Signal;

/// A node of the run. The master calls [`enter`](Node::enter), then [`set`](Node::set) and
/// [`get`](Node::get) in the order of the data flow, then [`ready`](Node::ready), then `set`,
/// [`step`](Node::step), `get` for each communication step, and [`end`](Node::end).
pub trait Node {
    /// Begins the initialisation of a run over `start..stop` [s].
    ///
    /// # Errors
    /// When the node refuses.
    fn enter(&mut self, _start: f64, _stop: f64) -> Result<(), CallError> {
        Ok(())
    }

    /// Ends the initialisation.
    ///
    /// # Errors
    /// When the node refuses.
    fn ready(&mut self) -> Result<(), CallError> {
        Ok(())
    }

    /// Takes the values of the connected inputs.
    ///
    /// # Errors
    /// When the node refuses.
    fn set(&mut self, _inputs: &[f64]) -> Result<(), CallError> {
        Ok(())
    }

    /// Gives the values of all outputs.
    ///
    /// # Errors
    /// When the node refuses.
    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError>;

    /// Takes the texts of the connected inputs, beside the numbers of [`set`](Node::set).
    ///
    /// # Errors
    /// When the node refuses.
    fn set_texts(&mut self, _inputs: &[String]) -> Result<(), CallError> {
        Ok(())
    }

    /// Gives the texts of all outputs, beside the numbers of [`get`](Node::get).
    ///
    /// # Errors
    /// When the node refuses.
    fn get_texts(&mut self, _outputs: &mut [String]) -> Result<(), CallError> {
        Ok(())
    }

    /// Goes from communication point `tick` to the next one.
    ///
    /// # Errors
    /// When the node does not come to the end of the step.
    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError>;

    /// Ends the run.
    ///
    /// # Errors
    /// When the node refuses.
    fn end(&mut self) -> Result<(), CallError> {
        Ok(())
    }

    /// Takes the messages that the node logged since the last time.
    fn messages(&mut self) -> Vec<Message> {
        Vec::new()
    }
}

/// An FMU as a node. Its numbers travel in the order real, integer, boolean.
pub struct FmuNode {
    instance: Instance,
    inputs: Ports,
    outputs: Ports,
    integers: Vec<i32>,
}

impl FmuNode {
    /// Makes an instance called `name` and gives it its start values.
    ///
    /// # Errors
    /// When the library does not load, or the FMU refuses.
    pub fn new(
        fmu: &Arc<Fmu>,
        name: &str,
        logging: bool,
        starts: &[Start],
        (inputs, outputs): (Ports, Ports),
    ) -> Result<Self, CallError> {
        let library = fmu.load().map_err(|error| CallError::new("loading", error.to_string()))?;
        let mut instance = Instance::new(library, name, logging)?;
        for Start { reference, value } in starts {
            match value {
                StartValue::Real(value) => instance.set_real(&[*reference], &[*value])?,
                StartValue::Integer(value) => instance.set_integer(&[*reference], &[*value])?,
                StartValue::Boolean(value) => {
                    instance.set_boolean(&[*reference], &[i32::from(*value)])?
                }
                StartValue::String(value) => instance.set_string(*reference, value)?,
            }
        }
        let integers = Vec::with_capacity(inputs.len().max(outputs.len()));
        Ok(FmuNode { instance, inputs, outputs, integers })
    }
}

impl Node for FmuNode {
    fn enter(&mut self, start: f64, stop: f64) -> Result<(), CallError> {
        self.instance.setup_experiment(start, stop)?;
        self.instance.enter_initialization()
    }

    fn ready(&mut self) -> Result<(), CallError> {
        self.instance.exit_initialization()
    }

    fn set(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        let (reals, rest) = inputs.split_at(self.inputs.real.len());
        self.instance.set_real(&self.inputs.real, reals)?;
        if rest.is_empty() {
            return Ok(());
        }
        self.integers.clear();
        // The links let nothing through but integers, which `f64` holds exactly.
        self.integers.extend(rest.iter().map(|&value| value as i32));
        let (integers, booleans) = self.integers.split_at(self.inputs.integer.len());
        self.instance.set_integer(&self.inputs.integer, integers)?;
        self.instance.set_boolean(&self.inputs.boolean, booleans)
    }

    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        let (reals, rest) = outputs.split_at_mut(self.outputs.real.len());
        self.instance.get_real(&self.outputs.real, reals)?;
        if rest.is_empty() {
            return Ok(());
        }
        self.integers.clear();
        self.integers.resize(rest.len(), 0);
        let (integers, booleans) = self.integers.split_at_mut(self.outputs.integer.len());
        self.instance.get_integer(&self.outputs.integer, integers)?;
        self.instance.get_boolean(&self.outputs.boolean, booleans)?;
        for (output, integer) in rest.iter_mut().zip(&self.integers) {
            *output = f64::from(*integer);
        }
        Ok(())
    }

    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        let mut inputs = self.inputs.string.iter().zip(inputs);
        inputs.try_for_each(|(reference, text)| self.instance.set_string(*reference, text))
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        for (reference, text) in self.outputs.string.iter().zip(outputs) {
            *text = self.instance.get_string(*reference)?;
        }
        Ok(())
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.instance.do_step(clock.at(tick), clock.step)?.into_result()
    }

    fn end(&mut self) -> Result<(), CallError> {
        self.instance.terminate()
    }

    fn messages(&mut self) -> Vec<Message> {
        self.instance.messages()
    }
}

/// Generated signals as a node.
#[derive(Debug)]
pub struct SignalNode {
    signals: Vec<Signal>,
    time: f64,
}

impl SignalNode {
    /// One output for each signal.
    #[must_use]
    pub fn new(signals: Vec<Signal>) -> Self {
        SignalNode { signals, time: 0.0 }
    }
}

impl Node for SignalNode {
    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        for (output, signal) in outputs.iter_mut().zip(&self.signals) {
            *output = signal.value(self.time);
        }
        Ok(())
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.time = clock.at(tick + 1);
        Ok(())
    }
}

/// A recorded table as a node.
#[derive(Debug)]
pub struct TableNode {
    table: Table,
    time: f64,
}

impl TableNode {
    /// One output for each column of the table.
    #[must_use]
    pub fn new(table: Table) -> Self {
        TableNode { table, time: 0.0 }
    }
}

impl Node for TableNode {
    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        for (column, output) in outputs.iter_mut().enumerate() {
            *output = self.table.value(column, self.time);
        }
        Ok(())
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.time = clock.at(tick + 1);
        Ok(())
    }
}

/// Makes the nodes that the master steps.
///
/// # Errors
/// With the node's name, when an FMU does not load or refuses its start values.
pub fn instantiate(system: &mut System) -> Result<Vec<Box<dyn Node>>, Error> {
    let nodes = system.nodes.iter_mut().map(|plan| {
        node(plan).map_err(|error| Error::component(&plan.name, error.call, None, error.what))
    });
    nodes.collect()
}

fn node(plan: &mut NodePlan) -> Result<Box<dyn Node>, CallError> {
    Ok(match &mut plan.body {
        Body::Fmu { fmu, starts, inputs, outputs, log } => {
            let ports = (inputs.clone(), outputs.clone());
            Box::new(FmuNode::new(fmu, &plan.name, *log, starts, ports)?)
        }
        Body::Signals(signals) => Box::new(SignalNode::new(std::mem::take(signals))),
        Body::Table(table) => Box::new(TableNode::new(table.clone())),
    })
}
