//! Steps the scenario inside the FMU.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use cosim::exchange::{StepInterruption, call_failure_error};
use cosim::execution::Execution;
use cosim::node::{self, FmuProcessOptions, Node};
use cosim::system::{NodeBody, NodePlan, System, UsedColumns};
use diagnostics::Error;
use fmu_export::{FmiResult, Lifecycle, VariableValue, log, reject, warn};
use fmu_import::{CallError, MessageLevel, SUMMARY};
use recording::{AllVariables, ColumnIndex, NumberIndex};
use scenario::plan::RunPlan;
use scenario::resolve::{IsolationPolicy, Override, OverrideValue, Overrides};
use scenario::{BuildArtifacts, Scenario};

use crate::SCENARIO;
use crate::guided::{ExternalValues, ExternallyDrivenNode, InputValue};
use crate::interface::{ExposedVariableRole, ScenarioFmuInterface, SessionSettings};

/// The log category of what the FMUs of the scenario say.
pub(crate) const NODES: &str = "logNodes";

/// A call of an FMU in a process of its own that lasts longer than this is reported.
const PATIENCE: Duration = Duration::from_secs(10);

/// The scenario between two calls.
pub(crate) struct ScenarioExecution {
    pub execution: Execution,
    /// Inputs by node.
    inputs: Vec<ExternalInputs>,
    /// Connected inputs that the importer may set: their references and values.
    connected: Vec<(usize, InputValue)>,
    /// Outputs: their references and places in the row.
    outputs: Vec<(usize, ColumnIndex<AllVariables>)>,
}

/// Inputs that take the place of outputs of one node.
struct ExternalInputs {
    /// Their values for the node.
    external: ExternalValues,
    /// Their references and places in the row.
    places: Vec<(usize, NumberIndex<AllVariables>)>,
}

/// Why a step of the scenario did not come to its end.
pub(crate) enum EarlyEnd {
    /// A node ended the run, as planned.
    Terminated(String),
    /// A node failed, or a value fits no input.
    Failed(String),
}

impl ScenarioExecution {
    /// Reads the scenario among the resources and makes its nodes, with these values as start values.
    ///
    /// # Errors
    /// When the scenario cannot be resolved here, or an FMU makes no instance.
    pub fn assemble_scenario(
        resources: &Path,
        interface: &ScenarioFmuInterface,
        values: &[VariableValue],
        course: &Lifecycle,
    ) -> Result<Self, Error> {
        let scenario = Scenario::read(&resources.join(SCENARIO))?;
        let parameters = interface.variables.iter().zip(values);
        let changed = parameters.filter(|(exposed, value)| {
            exposed.role == ExposedVariableRole::Parameter && **value != exposed.start
        });
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
        let session = interface.session.as_ref();
        let given = session.map(|session| session.starts.clone()).unwrap_or_default();
        let overrides = Overrides {
            starts: given.into_iter().chain(starts).collect(),
            seed: session.and_then(|session| session.seed),
            tolerance: tolerance.filter(|tolerance| *tolerance > 0.0),
            isolate: session.map(SessionSettings::isolation_policy).unwrap_or_default(),
            ..Overrides::default()
        };
        let folder = resources.to_owned();
        let plan = RunPlan::resolve(&scenario, &BuildArtifacts::default(), &overrides, folder)?;
        let mut system = plan.system;
        system.clock.start = course.now;
        system.announced_stop = course.stop;
        let host = session.map(SessionSettings::process_options);
        system.restrict_outputs(exposed_columns(&system, interface));
        let mut nodes = node::instantiate_nodes(&mut system, host.as_ref())?;
        let connected = attach_input_values(&mut system, interface)?;
        let (inputs, outputs) = attach_external_values(&system, &mut nodes, interface)?;
        Ok(ScenarioExecution { execution: Execution::new(system, nodes), inputs, connected, outputs })
    }

    /// Initialises the nodes with these values of the inputs, by reference.
    ///
    /// # Errors
    /// When a node fails.
    pub fn initialise_nodes(&mut self, values: &[Option<f64>]) -> Result<(), Error> {
        self.set_inputs(values);
        let initialised = self.execution.with_exchange(|exchange, coupling| {
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
    pub fn do_steps(&mut self, values: &[Option<f64>], steps: u64) -> Result<(), EarlyEnd> {
        for _ in 0..steps {
            self.set_inputs(values);
            let tick = self.execution.tick;
            let stepped = self.execution.try_step();
            if self.execution.memory.take_message_flag() || stepped.is_err() {
                self.log_messages(false);
            }
            stepped.map_err(|interruption| match interruption {
                StepInterruption::Value(error) | StepInterruption::Unsolved(error) => {
                    EarlyEnd::Failed(error.to_string())
                }
                StepInterruption::Call { node, error } => {
                    let system = &self.execution.system;
                    let time = system.clock.time_at(tick + u64::from(error.is_at_step_end()));
                    early_end(&system.nodes[node], error, time)
                }
            })?;
        }
        Ok(())
    }

    /// Lets the coupling go on with what it remembered.
    ///
    /// # Errors
    /// When the bytes are of something else.
    pub fn restore_coupling(&mut self, coupling: &[u8]) -> FmiResult {
        match coupling {
            [] => Ok(()),
            bytes => {
                self.execution.coupling.restore_from_bytes(bytes).or_else(|error| reject(error.to_string()))
            }
        }
    }

    /// Reads the outputs.
    pub fn read_outputs(&self, values: &mut [VariableValue]) {
        let row = self.execution.row();
        for (reference, index) in &self.outputs {
            match (&mut values[*reference], index) {
                (VariableValue::String(text), ColumnIndex::Text(index)) => {
                    text.clone_from(&row[*index]);
                }
                (cell, ColumnIndex::Number(index)) => cell.set_from_f64(row[*index]),
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
    fn set_inputs(&mut self, values: &[Option<f64>]) {
        let row = &mut self.execution.memory.row;
        for ExternalInputs { external, places } in &self.inputs {
            external.set_values(places.iter().map(|(reference, _)| values[*reference]));
            for (reference, at) in places {
                if let Some(value) = values[*reference] {
                    row[*at] = value;
                }
            }
        }
        self.connected.iter().for_each(|(reference, input)| input.set(values[*reference]));
    }

    /// Logs what the nodes logged; messages of a kind that came before wait for others, or for the end.
    fn log_messages(&mut self, ends: bool) {
        let Execution { system, nodes, .. } = &mut self.execution;
        for (plan, node) in system.nodes.iter().zip(nodes) {
            if !(ends || node.has_messages()) {
                continue;
            }
            for message in node.take_messages() {
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

impl SessionSettings {
    fn isolation_policy(&self) -> IsolationPolicy {
        if self.isolate { IsolationPolicy::Everything } else { IsolationPolicy::Nothing }
    }

    fn process_options(&self) -> FmuProcessOptions {
        FmuProcessOptions {
            program: (self.program.clone(), vec!["isolated".to_owned()]),
            patience: PATIENCE,
            give_up: Arc::new(|| false),
        }
    }
}

/// How a node that did not come to the end of a step ended it, at a time [s].
fn early_end(plan: &NodePlan, error: CallError, time: f64) -> EarlyEnd {
    match error.terminated {
        Some(reached) => {
            let name = &plan.name;
            EarlyEnd::Terminated(format!("`{name}` ended the run at {reached} s: {}", error.what))
        }
        None => EarlyEnd::Failed(call_failure_error(plan, error, time).to_string()),
    }
}

/// The columns that the importer may read.
fn exposed_columns(system: &System, interface: &ScenarioFmuInterface) -> UsedColumns {
    let mut used = UsedColumns::default();
    for exposed in &interface.variables {
        match system.columns.find(&exposed.name) {
            Some(ColumnIndex::Number(number)) => drop(used.numbers.insert(number)),
            Some(ColumnIndex::Text(text)) => drop(used.texts.insert(text)),
            None => {}
        }
    }
    used
}

/// Inputs by node, and outputs with their references and places in the row.
type InputsAndOutputs = (Vec<ExternalInputs>, Vec<(usize, ColumnIndex<AllVariables>)>);

/// Puts the values of the interface in the place of the signals that they take the place of.
fn attach_external_values(
    system: &System,
    nodes: &mut Vec<Box<dyn Node>>,
    interface: &ScenarioFmuInterface,
) -> Result<InputsAndOutputs, Error> {
    let find = |name: &str| {
        let found = system.columns.find(name);
        found.ok_or_else(|| Error::invalid_input(format!("the scenario has no `{name}`")))
    };
    let mut wanted = Vec::new();
    let mut outputs = Vec::new();
    for (reference, exposed) in interface.variables.iter().enumerate() {
        match &exposed.role {
            ExposedVariableRole::Input(signal) => match find(signal)? {
                ColumnIndex::Number(index) => wanted.push((reference, index)),
                ColumnIndex::Text(_) => {
                    return Err(Error::invalid_input(format!("`{signal}` is a text, which no input holds")));
                }
            },
            ExposedVariableRole::Output | ExposedVariableRole::InputOverride => {
                outputs.push((reference, find(&exposed.name)?));
            }
            ExposedVariableRole::SignalOverride => {
                let index = find(&exposed.name)?;
                outputs.push((reference, index));
                if let ColumnIndex::Number(index) = index {
                    wanted.push((reference, index));
                }
            }
            ExposedVariableRole::Parameter => {}
        }
    }
    let mut inputs = Vec::new();
    let guided = std::mem::take(nodes).into_iter().zip(&system.nodes).map(|(node, plan)| {
        let is_source = !matches!(plan.body, NodeBody::Fmu { .. });
        let place = |at: NumberIndex<AllVariables>| plan.outputs.indices().position(|it| it == at);
        let own: Vec<_> = wanted.iter().filter(|(_, at)| is_source && place(*at).is_some()).collect();
        if own.is_empty() {
            return node;
        }
        let integer = |at| plan.exact.numbers.iter().position(|it| *it == at);
        let external =
            ExternalValues::new(own.iter().filter_map(|(_, at)| Some((place(*at)?, integer(*at)))));
        let places = own.into_iter().copied().collect();
        inputs.push(ExternalInputs { external: external.clone(), places });
        Box::new(ExternallyDrivenNode { node, external }) as Box<dyn Node>
    });
    *nodes = guided.collect();
    Ok((inputs, outputs))
}

/// Lets the importer set connected inputs, at the end of their ways.
fn attach_input_values(
    system: &mut System,
    interface: &ScenarioFmuInterface,
) -> Result<Vec<(usize, InputValue)>, Error> {
    let mut connected = Vec::new();
    for (reference, exposed) in interface.variables.iter().enumerate() {
        if exposed.role != ExposedVariableRole::InputOverride {
            continue;
        }
        let index = system.columns.find(&exposed.name);
        let link = system.nodes.iter_mut().find_map(|plan| {
            let place = plan.inputs.indices().position(|input| Some(ColumnIndex::Number(input)) == index)?;
            plan.connections.get_mut(place)
        });
        let Some(link) = link else {
            return Err(Error::invalid_input(format!(
                "the scenario has no connected input `{}`",
                exposed.name
            )));
        };
        let input = InputValue::default();
        link.input_chain.faults.push(input.to_input_fault());
        connected.push((reference, input));
    }
    Ok(connected)
}
