//! Gives everything that is stepped one interface: FMUs, generated signals and recorded tables.
//!
//! A node takes numbers, steps, and gives numbers. What only some nodes can do beside that is a capability, which a node has or has not:
//! [`Stateful`], [`TypedValues`], [`ExtrapolatedInputs`], [`ConcurrentStep`], [`DirectionalDerivatives`], [`TunableParameters`],
//! [`FaultInjection`]. Each
//! function that can fail does so when the FMU behind the node refuses the call; signals and tables never refuse.

mod driver;
mod fault_injection;
mod fmu;
mod isolated;
mod isolated_copies;
mod refusal;
mod reusable;
mod source;
mod sub_stepping;

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use diagnostics::{Error, ErrorCollector};
use fmu_import::{CallError, Fmu, FmuMessage, Instance, StepRound};

use crate::clock::CommunicationClock;
use crate::extrapolation::ExtrapolationPolynomial;
use crate::fault::CallFault;
use crate::system::{FmuIsolation, FmuTolerance, NodeBody, NodePlan, StartValue, System, VariableGroups};
use driver::DriverNode;
pub use fault_injection::with_call_faults;
pub use fmu::FmuNode;
use isolated::IsolatedNode;
pub use isolated::{FmuProcessOptions, serve_host_process};
pub use isolated_copies::{isolated_copies, return_sources};
pub use refusal::FmuRefusal;
pub use reusable::ReusableInstances;
pub use source::{SourceNode, ValueSource};
use sub_stepping::SubSteppingNode;

/// Share of a step that times may differ by and still be the same.
pub(crate) const SAME: f64 = 1e-6;

/// A node of a system. The master calls [`enter_initialization`](Node::enter_initialization), then [`set_inputs`](Node::set_inputs) and
/// [`get_outputs`](Node::get_outputs) in the order of the data flow, then [`exit_initialization`](Node::exit_initialization), then
/// `set_inputs`, [`do_step`](Node::do_step), `get_outputs` for each communication step, and [`terminate`](Node::terminate).
pub trait Node: Send {
    /// The node inside, of a node that changes only some of what another one does: what it does not do itself, that one does.
    fn inner_node(&self) -> Option<&dyn Node> {
        None
    }

    /// The same, to be called.
    fn inner_mut(&mut self) -> Option<&mut dyn Node> {
        None
    }

    /// Begins the initialisation; what the node did not keep of its start values.
    fn enter_initialization(&mut self) -> Result<Vec<String>, Error> {
        self.inner_mut().map_or(Ok(Vec::new()), |node| node.enter_initialization())
    }

    /// Ends the initialisation.
    fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.inner_mut().map_or(Ok(()), |node| node.exit_initialization())
    }

    /// Takes the values of the connected inputs.
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inner_mut().map_or(Ok(()), |node| node.set_inputs(inputs))
    }

    /// Gives the values of all outputs.
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError>;

    /// Goes from communication point `tick` of the clock to the next one.
    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError>;

    /// [`set_inputs`](Node::set_inputs), [`do_step`](Node::do_step) and [`get_outputs`](Node::get_outputs) in one call, of a node without
    /// [`TypedValues`]. Says whether there are messages to take.
    fn exchange_and_step(
        &mut self,
        inputs: &[f64],
        clock: &CommunicationClock,
        tick: u64,
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        self.set_inputs(inputs)?;
        self.do_step(clock, tick)?;
        self.get_outputs(outputs)?;
        Ok(self.has_messages())
    }

    /// The same on the row of all numbers, whose inputs and outputs of the node begin at these places, without the look around that
    /// [`exchange_and_step`](Node::exchange_and_step) takes after its calls. Says whether it is done; else that function does it, or the
    /// rest of it.
    fn step_in_row(
        &mut self,
        _round: &mut StepRound,
        _numbers: &mut [f64],
        _places: [usize; 2],
        _time: f64,
        _step: f64,
    ) -> bool {
        false
    }

    /// Takes the values of the connected inputs at the end of a step, before its outputs are read: some follow them.
    fn update_outputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        match self.inner_mut() {
            Some(node) => node.update_outputs(inputs),
            None => self.set_inputs(inputs),
        }
    }

    /// Ends the run.
    fn terminate(&mut self) -> Result<(), CallError> {
        self.inner_mut().map_or(Ok(()), |node| node.terminate())
    }

    /// Whether there are messages to take now: of a kind that is new, or each one that it logs if it logs all it has to say.
    fn has_messages(&self) -> bool {
        self.inner_node().is_some_and(Node::has_messages)
    }

    /// Takes the messages that the node logged since the last time; repeated ones may have waited for it, see [`FmuMessage::again`].
    fn take_messages(&mut self) -> Vec<FmuMessage> {
        self.inner_mut().map(|node| node.take_messages()).unwrap_or_default()
    }

    /// Its state, of a node that can go back to an earlier one.
    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        self.inner_mut()?.as_stateful()
    }

    /// Its values that do not travel as numbers, of a node that has some.
    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        self.inner_mut()?.typed_values()
    }

    /// Its inputs that change within a step, of a node that does not hold them.
    fn extrapolated_inputs(&mut self) -> Option<&mut dyn ExtrapolatedInputs> {
        self.inner_mut()?.extrapolated_inputs()
    }

    /// Its step in two parts, of a node that steps while others do. One that changes what the node inside does in a step has none.
    fn as_concurrent_step(&mut self) -> Option<&mut dyn ConcurrentStep> {
        None
    }

    /// The derivatives of its outputs, of a node that may know them.
    fn as_directional_derivatives(&mut self) -> Option<&mut dyn DirectionalDerivatives> {
        self.inner_mut()?.as_directional_derivatives()
    }

    /// Its parameters, of a node that has some that change between two steps.
    fn as_tunable_parameters(&mut self) -> Option<&mut dyn TunableParameters> {
        self.inner_mut()?.as_tunable_parameters()
    }

    /// Its calls, of a node that lets them fail on demand.
    fn as_fault_injection(&mut self) -> Option<&mut dyn FaultInjection> {
        self.inner_mut()?.as_fault_injection()
    }

    /// Whether a process can hold one instance of it only.
    fn is_single_instance(&self) -> bool {
        self.inner_node().is_some_and(Node::is_single_instance)
    }

    /// The instance of an FMU in this process, for another run.
    fn into_instance(self: Box<Self>) -> Option<Instance> {
        None
    }
}

/// A node that saves its state and goes back to it, so that steps can be repeated.
pub trait Stateful {
    /// Whether it can do so now.
    fn can_save(&mut self) -> bool {
        true
    }

    /// Saves the state. Dropping the copy frees its memory.
    fn save_state(&mut self) -> Result<NodeState, CallError>;

    /// Saves the state in the place of one that this node saved.
    fn save_into(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        *state = self.save_state()?;
        Ok(())
    }

    /// Goes back to a state that this node saved.
    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError>;

    /// A saved state as bytes.
    fn serialise_state(&mut self, _state: &NodeState) -> Result<Vec<u8>, CallError> {
        Err(state_error("the node cannot turn its state into bytes"))
    }

    /// The state that [`serialise_state`](Self::serialise_state) gave as bytes, also of another instance.
    fn deserialise_state(&mut self, _bytes: &[u8]) -> Result<NodeState, CallError> {
        Err(state_error("the node cannot read its state from bytes"))
    }
}

/// A node with inputs or outputs that are texts, or integers of 64 bits, which no number holds exactly.
pub trait TypedValues {
    /// Takes the texts of the connected inputs.
    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError>;

    /// Gives the texts of all outputs.
    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError>;

    /// Takes the connected inputs that are integers of 64 bits, which [`Node::set_inputs`] leaves to this.
    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError>;

    /// Gives the outputs that are integers of 64 bits, which [`Node::get_outputs`] leaves to this.
    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError>;
}

/// A node whose inputs change within a step.
pub trait ExtrapolatedInputs {
    /// Takes the values of the connected inputs for a step between two times [s], in place of [`Node::set_inputs`]; some go on by their
    /// polynomials. `inputs` is left with any values.
    fn set_extrapolated_inputs(
        &mut self,
        inputs: &mut [f64],
        polynomials: &[InputPolynomial],
        span: Range<f64>,
    ) -> Result<(), CallError>;
}

/// A node that steps while others do: it has a process of its own.
pub trait ConcurrentStep {
    /// Begins [`Node::do_step`]. The next call of the node is [`finish_step`](Self::finish_step).
    fn begin_step(&mut self, clock: &CommunicationClock, tick: u64);

    /// Waits for the end of the step that was begun, with these arguments; how long it took.
    ///
    /// # Errors
    /// As of [`Node::do_step`].
    fn finish_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<Duration, CallError>;
}

/// A node that knows how its outputs change with its inputs.
pub trait DirectionalDerivatives {
    /// How outputs change with inputs at this moment, without a step in between: `changes` of the inputs, in the order of
    /// [`Node::set_inputs`], become those of the outputs, in the order of [`Node::get_outputs`]. False if the node does not know.
    fn directional_derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError>;
}

/// A node whose parameters may change between two steps.
pub trait TunableParameters {
    /// Takes other values of tunable parameters and of inputs that nothing is connected to, between two steps at `time` [s].
    fn tune_parameters(&mut self, values: &[StartValue], time: f64) -> Result<(), CallError>;
}

/// What a node does in its next step on demand.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum InjectedFault {
    /// It waits for this time first [s].
    Wait(f64),
    /// It crashes.
    Crash,
}

/// A node whose calls fail on demand.
pub trait FaultInjection {
    /// Asks the node to do this in its next step; whether it will.
    fn inject_fault(&mut self, _fault: InjectedFault) -> bool {
        false
    }

    /// Takes other faults of its calls, for a run with these communication points.
    fn set_call_faults(&mut self, _faults: &[CallFault], _clock: &CommunicationClock) {}
}

/// The polynomial of an input, by its place among those of a node that are numbers.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct InputPolynomial {
    /// The place of the input.
    pub place: usize,
    /// Its values over time.
    pub polynomial: ExtrapolationPolynomial,
}

/// The state of a node.
///
/// # Errors
/// When the node has none.
pub fn stateful_node(node: &mut dyn Node) -> Result<&mut dyn Stateful, CallError> {
    node.as_stateful().ok_or_else(|| state_error("the node cannot save its state"))
}

/// Gives a node its inputs for a step between two times [s]. One that holds them gets the mean of those that change.
pub(crate) fn set_extrapolated_inputs(
    node: &mut dyn Node,
    inputs: &mut [f64],
    polynomials: &[InputPolynomial],
    span: Range<f64>,
) -> Result<(), CallError> {
    if let Some(extrapolated) = node.extrapolated_inputs() {
        return extrapolated.set_extrapolated_inputs(inputs, polynomials, span);
    }
    for InputPolynomial { place, polynomial } in polynomials {
        inputs[*place] = polynomial.mean_over(&span);
    }
    node.set_inputs(inputs)
}

/// The saved state of a node, which that node alone can restore.
pub struct NodeState(Box<dyn Any + Send>);

impl NodeState {
    /// Wraps a node's own form of its state.
    #[must_use]
    pub fn new(state: impl Any + Send) -> Self {
        NodeState(Box::new(state))
    }

    /// The node's own form of its state.
    ///
    /// # Errors
    /// When another kind of node saved it.
    pub fn downcast_ref<T: Any>(&self) -> Result<&T, CallError> {
        self.0.downcast_ref().ok_or_else(|| state_error("the state is that of another kind of node"))
    }

    /// The same, to be replaced.
    ///
    /// # Errors
    /// When another kind of node saved it.
    pub fn downcast_mut<T: Any>(&mut self) -> Result<&mut T, CallError> {
        self.0.downcast_mut().ok_or_else(|| state_error("the state is that of another kind of node"))
    }
}

fn state_error(what: &str) -> CallError {
    CallError::new("the state", what)
}

/// Makes the nodes that the master steps. FMUs to be kept apart run in processes of `host`; without one, they run in this process, too.
///
/// # Errors
/// With the node's name, when an FMU does not load or refuses the experiment; at the word that gives it, when an FMU refuses a start
/// value.
pub fn instantiate_nodes(
    system: &mut System,
    host: Option<&FmuProcessOptions>,
) -> Result<Vec<Box<dyn Node>>, Error> {
    instantiate_reusing(system, host, &mut ReusableInstances::default())
}

/// The same with instances of an earlier run, where there are some.
///
/// # Errors
/// As of [`instantiate_nodes`].
pub fn instantiate_reusing(
    system: &mut System,
    host: Option<&FmuProcessOptions>,
    reusable: &mut ReusableInstances,
) -> Result<Vec<Box<dyn Node>>, Error> {
    let System { clock, announced_stop, tolerance, .. } = *system;
    let mut notices = Vec::new();
    prepare_libraries(&system.nodes, &mut notices)?;
    let nodes = system.nodes.iter_mut().map(|plan| {
        if let NodeBody::Fmu { fmu, isolation: isolation @ None, .. } = &mut plan.body
            && let Some(why) = host.and_then(|_| fmu.clash_in_process())
        {
            // Of an earlier run, or of the run that this one validates.
            notices.push(FmuIsolation::isolation_notice(&plan.name, &why));
            *isolation = Some(FmuIsolation::process_only());
        }
        // The last step of its own may end a unit in the last place later.
        let own = plan.step_ratio.map(|step_ratio| step_ratio.node_clock(&clock).announced_stop());
        let stop = announced_stop.map(|stop| own.map_or(stop, |own| own.max(stop)));
        let experiment = ExperimentSetup { start: clock.start, stop, tolerance, absolute_tolerance: None };
        let node = create_node(plan, experiment, host, reusable)?;
        Ok(wrap_sub_stepping(node, plan, clock))
    });
    let mut nodes = ErrorCollector::collect_all(nodes)?;
    system.warnings.append(&mut notices);
    with_call_faults(system, &mut nodes, false);
    Ok(nodes)
}

/// Compiles the FMUs that come with sources in place of a library, and tells where the libraries are.
fn prepare_libraries(plans: &[NodePlan], notices: &mut Vec<String>) -> Result<(), Error> {
    for NodePlan { name, body, .. } in plans {
        let NodeBody::Fmu { fmu, .. } = body else { continue };
        fmu.prepare_library()
            .map_err(|error| Error::node_failure(name, "loading", None, error.to_string()))?;
        let notice = fmu.compiled_library().map(|compiled| format!("{}: {compiled}", fmu.path.display()));
        notices.extend(notice.filter(|notice| !notices.contains(notice)));
    }
    Ok(())
}

/// The node with the step of its own, if it has one.
pub(crate) fn wrap_sub_stepping(
    node: Box<dyn Node>,
    plan: &NodePlan,
    clock: CommunicationClock,
) -> Box<dyn Node> {
    match plan.step_ratio {
        None => node,
        Some(step_ratio) => Box::new(SubSteppingNode::new(node, plan, step_ratio, clock)),
    }
}

/// The nodes of a system that are no FMUs, and in the places of FMUs nodes that show nothing.
#[must_use]
pub fn source_nodes(system: &mut System) -> Vec<Box<dyn Node>> {
    let source = |plan: &mut NodePlan| -> Box<dyn Node> {
        match &mut plan.body {
            NodeBody::Signals(signals) => Box::new(SourceNode::new(std::mem::take(signals))),
            NodeBody::Table(table) => Box::new(SourceNode::new(table.clone())),
            NodeBody::Driver(driver) => Box::new(DriverNode::new(driver)),
            // The exchange puts the values of connectors into the row.
            NodeBody::Own | NodeBody::Inlet | NodeBody::Outlet | NodeBody::Fmu { .. } => {
                Box::new(SourceNode::new(Vec::new()))
            }
        }
    };
    system.nodes.iter_mut().map(source).collect()
}

/// What an FMU is told of the run.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ExperimentSetup {
    /// The first communication point [s].
    pub start: f64,
    /// The stop time [s], if it is known.
    pub stop: Option<f64>,
    /// The relative tolerance [-]; that of its description without it.
    pub tolerance: Option<f64>,
    /// In model exchange, the absolute tolerance of a state as a share of its nominal value [-]; it follows from the relative one
    /// without it.
    pub absolute_tolerance: Option<f64>,
}

impl ExperimentSetup {
    /// The experiment of an FMU with a tolerance of its own.
    fn with_tolerance(self, own: FmuTolerance) -> Self {
        let tolerance = own.relative.or(self.tolerance);
        ExperimentSetup { tolerance, absolute_tolerance: own.absolute, ..self }
    }
}

/// What the node of an FMU is made of.
pub(crate) struct InstanceSettings<'a> {
    pub fmu: &'a Arc<Fmu>,
    pub name: &'a str,
    pub log: bool,
    pub inputs: VariableGroups,
    pub outputs: VariableGroups,
    pub experiment: ExperimentSetup,
    pub starts: Vec<StartValue>,
}

fn create_node(
    plan: &mut NodePlan,
    experiment: ExperimentSetup,
    host: Option<&FmuProcessOptions>,
    reusable: &mut ReusableInstances,
) -> Result<Box<dyn Node>, Error> {
    Ok(match &mut plan.body {
        NodeBody::Fmu { fmu, starts, inputs, outputs, log, tolerance, isolation } => {
            let experiment = experiment.with_tolerance(*tolerance);
            let settings = InstanceSettings {
                fmu,
                name: &plan.name,
                log: *log,
                inputs: inputs.clone(),
                outputs: outputs.clone(),
                experiment,
                starts: starts.clone(),
            };
            match (isolation, host) {
                (Some(isolation), Some(host)) => Box::new(IsolatedNode::new(settings, isolation, host)?),
                _ => Box::new(fmu_node(settings, reusable)?),
            }
        }
        NodeBody::Signals(signals) => Box::new(SourceNode::new(std::mem::take(signals))),
        NodeBody::Table(table) => Box::new(SourceNode::new(table.clone())),
        NodeBody::Driver(driver) => Box::new(DriverNode::new(driver)),
        // The exchange puts the values of connectors into the row; the program brings its own nodes.
        NodeBody::Own | NodeBody::Inlet | NodeBody::Outlet => Box::new(SourceNode::new(Vec::new())),
    })
}

/// The node of an FMU in this process, of an instance of an earlier run, if there is one.
fn fmu_node(settings: InstanceSettings, reusable: &mut ReusableInstances) -> Result<FmuNode, Error> {
    let InstanceSettings { fmu, name, log, inputs, outputs, experiment, starts } = settings;
    let failed = |refusal: FmuRefusal| refusal.into_error(name, experiment.start);
    let mut node = match reusable.take_instance(name, fmu, &starts) {
        Some(instance) => FmuNode::from_instance(instance, name, inputs, outputs),
        None => FmuNode::new(fmu, name, log, inputs, outputs).map_err(failed)?,
    };
    node.set_experiment_and_starts(experiment, starts).map_err(failed)?;
    Ok(node)
}

#[cfg(test)]
mod tests;
