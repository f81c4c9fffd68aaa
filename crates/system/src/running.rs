//! Steps the scenario inside the FMU.

use std::path::Path;

use cosim::exchange::{Interruption, failure};
use cosim::execution::Execution;
use cosim::node::{self, Node};
use cosim::system::{Body, NodePlan, System};
use diagnostics::Error;
use fmu_export::{FmiResult, Lifecycle, VariableValue, log, reject, warn};
use fmu_import::{CallError, MessageLevel, SUMMARY};
use recording::{ColumnIndex, Full, NumberIndex};
use scenario::plan::RunPlan;
use scenario::resolve::{Override, OverrideValue, Overrides};
use scenario::{BuildArtifacts, Scenario};

use crate::SCENARIO;
use crate::guided::{ExternalInputNode, ExternalValues};
use crate::interface::{Interface, Role};

/// The log category of what the FMUs of the scenario say.
pub(crate) const NODES: &str = "logNodes";

/// The scenario between two calls.
pub(crate) struct Running {
    pub execution: Execution,
    /// Inputs by node.
    inputs: Vec<Inputs>,
    /// Outputs: their references and places in the row.
    outputs: Vec<(usize, ColumnIndex<Full>)>,
}

/// Inputs that take the place of outputs of one node.
struct Inputs {
    /// Their values for the node.
    external: ExternalValues,
    /// Their references and places in the row.
    places: Vec<(usize, NumberIndex<Full>)>,
}

/// Why a step of the scenario did not come to its end.
pub(crate) enum Ended {
    /// A node ended the run, as planned.
    Terminated(String),
    /// A node failed, or a value fits no input.
    Failed(String),
}

impl Running {
    /// Reads the scenario among the resources and makes its nodes, with these values as start values.
    ///
    /// # Errors
    /// When the scenario cannot be resolved here, or an FMU makes no instance.
    pub fn assemble(
        resources: &Path,
        interface: &Interface,
        values: &[VariableValue],
        course: &Lifecycle,
    ) -> Result<Self, Error> {
        let scenario = Scenario::read(&resources.join(SCENARIO))?;
        let parameters = interface.variables.iter().zip(values);
        let changed = parameters
            .filter(|(exposed, value)| exposed.role == Role::Parameter && **value != exposed.start);
        let starts = changed.filter_map(|(exposed, value)| {
            let value = match value {
                VariableValue::Real(value) => OverrideValue::Number { value: *value, unit: None },
                VariableValue::Integer(value) => OverrideValue::Integer((*value).into()),
                VariableValue::Boolean(value) => OverrideValue::Boolean(*value),
                VariableValue::String(text) => OverrideValue::parse(text),
            };
            exposed.name.contains('.').then(|| Override::new(&exposed.name, value))
        });
        let tolerance = course.tolerance.filter(|tolerance| (0.0..1.0).contains(tolerance));
        let overrides = Overrides {
            starts: starts.collect(),
            tolerance: tolerance.filter(|tolerance| *tolerance > 0.0),
            ..Overrides::default()
        };
        let folder = resources.to_owned();
        let plan = RunPlan::resolve(&scenario, &BuildArtifacts::default(), &overrides, folder)?;
        let mut system = plan.system;
        system.clock.start = course.now;
        system.announced_stop = course.stop;
        let mut nodes = node::instantiate(&mut system, None)?;
        let (inputs, outputs) = guide(&system, &mut nodes, interface)?;
        Ok(Running { execution: Execution::new(system, nodes), inputs, outputs })
    }

    /// Initialises the nodes with these values of the inputs.
    ///
    /// # Errors
    /// When a node fails.
    pub fn initialise(&mut self, values: &[VariableValue]) -> Result<(), Error> {
        self.set_inputs(values);
        let initialised = self.execution.exchange(|exchange, coupling| {
            coupling.initialise(exchange)?;
            exchange.notices().iter().for_each(|notice| warn(notice.clone()));
            Ok(())
        });
        self.log_messages(false);
        initialised
    }

    /// Goes on by a number of communication steps, with the inputs held.
    ///
    /// # Errors
    /// When a step does not come to its end.
    pub fn step(&mut self, values: &[VariableValue], steps: u64) -> Result<(), Ended> {
        for _ in 0..steps {
            self.set_inputs(values);
            let tick = self.execution.tick;
            let stepped = self.execution.try_step();
            self.log_messages(false);
            stepped.map_err(|interruption| match interruption {
                Interruption::Value(error) | Interruption::Unsolved(error) => {
                    Ended::Failed(error.to_string())
                }
                Interruption::Call { node, error } => {
                    let system = &self.execution.system;
                    let time = system.clock.at(tick + u64::from(error.at_end_of_step()));
                    ended(&system.nodes[node], error, time)
                }
            })?;
        }
        Ok(())
    }

    /// Lets the coupling go on with what it remembered.
    ///
    /// # Errors
    /// When the bytes are of something else.
    pub fn recall(&mut self, coupling: &[u8]) -> FmiResult {
        match coupling {
            [] => Ok(()),
            bytes => {
                self.execution.coupling.recall(bytes).or_else(|error| reject(error.to_string()))
            }
        }
    }

    /// Reads the outputs.
    pub fn show(&self, values: &mut [VariableValue]) {
        let row = self.execution.row();
        for (reference, index) in &self.outputs {
            match (&mut values[*reference], index) {
                (VariableValue::String(text), ColumnIndex::Text(index)) => {
                    text.clone_from(&row[*index]);
                }
                (cell, ColumnIndex::Number(index)) => cell.set_number(row[*index]),
                _ => {}
            }
        }
    }

    /// Ends the run of all nodes.
    ///
    /// # Errors
    /// With the first node that refuses.
    pub fn terminate(&mut self) -> Result<(), Error> {
        let terminated = self.execution.terminate();
        self.log_messages(true);
        terminated
    }

    /// Puts the values of the inputs where the nodes find them, also at the start of the next step.
    fn set_inputs(&mut self, values: &[VariableValue]) {
        let row = &mut self.execution.memory.row;
        for Inputs { external, places } in &self.inputs {
            let number = |reference: usize| values[reference].number().unwrap_or_default();
            external.set(places.iter().map(|(reference, _)| number(*reference)));
            places.iter().for_each(|(reference, at)| row[*at] = number(*reference));
        }
    }

    /// Logs what the nodes logged; messages of a kind that came before wait for others, or for the end.
    fn log_messages(&mut self, ends: bool) {
        let Execution { system, nodes, .. } = &mut self.execution;
        for (plan, node) in system.nodes.iter().zip(nodes) {
            if !(ends || node.has_messages()) {
                continue;
            }
            for message in node.messages() {
                let times = match message.again {
                    0 => String::new(),
                    again => format!(", {again} times more"),
                };
                let text = format!("{}{times}: {}", plan.name, message.text);
                match message.level() {
                    MessageLevel::Info if message.category == SUMMARY => log(SUMMARY, text),
                    MessageLevel::Info => log(NODES, text),
                    MessageLevel::Warning | MessageLevel::Error => warn(text),
                }
            }
        }
    }
}

/// How a node that did not come to the end of a step ended it, at a time [s].
fn ended(plan: &NodePlan, error: CallError, time: f64) -> Ended {
    match error.terminated {
        Some(reached) => {
            let name = &plan.name;
            Ended::Terminated(format!("`{name}` ended the run at {reached} s: {}", error.what))
        }
        None => Ended::Failed(failure(plan, error, time).to_string()),
    }
}

/// Inputs by node, and outputs with their references and places in the row.
type Places = (Vec<Inputs>, Vec<(usize, ColumnIndex<Full>)>);

/// Puts the values of the interface in the place of the signals that they take the place of.
fn guide(
    system: &System,
    nodes: &mut Vec<Box<dyn Node>>,
    interface: &Interface,
) -> Result<Places, Error> {
    let find = |name: &str| {
        let found = system.columns.find(name);
        found.ok_or_else(|| Error::input(format!("the scenario has no `{name}`")))
    };
    let mut wanted = Vec::new();
    let mut outputs = Vec::new();
    for (reference, exposed) in interface.variables.iter().enumerate() {
        match &exposed.role {
            Role::Input(signal) => match find(signal)? {
                ColumnIndex::Number(index) => wanted.push((reference, index)),
                ColumnIndex::Text(_) => {
                    return Err(Error::input(format!(
                        "`{signal}` is a text, which no input holds"
                    )));
                }
            },
            Role::Output => outputs.push((reference, find(&exposed.name)?)),
            Role::Parameter => {}
        }
    }
    let mut inputs = Vec::new();
    let guided = std::mem::take(nodes).into_iter().zip(&system.nodes).map(|(node, plan)| {
        let is_source = !matches!(plan.body, Body::Fmu { .. });
        let place = |at: NumberIndex<Full>| plan.outputs.indices().position(|it| it == at);
        let own: Vec<_> =
            wanted.iter().filter(|(_, at)| is_source && place(*at).is_some()).collect();
        if own.is_empty() {
            return node;
        }
        let integer = |at| plan.exact.numbers.iter().position(|it| *it == at);
        let external =
            ExternalValues::new(own.iter().filter_map(|(_, at)| Some((place(*at)?, integer(*at)))));
        let places = own.into_iter().copied().collect();
        inputs.push(Inputs { external: external.clone(), places });
        Box::new(ExternalInputNode { node, external }) as Box<dyn Node>
    });
    *nodes = guided.collect();
    Ok((inputs, outputs))
}
