//! Gives everything that is stepped one interface: FMUs, generated signals and recorded tables.
//!
//! Each function that can fail does so when the FMU behind the node refuses the call; signals and tables never refuse.

mod apart;
mod driver;
mod faulty;
mod fmu;
mod isolated;
mod kept;
mod paced;
mod refusal;
mod source;

use std::any::Any;

use diagnostics::{Error, Mistakes};
use fmu_import::{CallError, Instance, Message};
use scenario::plan::{Body, CallFault, Clock, Isolation, NodePlan, Start, System};

use crate::course::Course;
pub use apart::{apart, return_sources};
use driver::DriverNode;
pub use faulty::{Provocation, with_faults};
pub use fmu::FmuNode;
pub use isolated::{Host, serve};
use isolated::{IsolatedNode, Making};
pub use kept::Kept;
use paced::Paced;
pub use refusal::Refusal;
pub use source::{Source, SourceNode};

/// Share of a step that times may differ by and still be the same.
pub(crate) const SAME: f64 = 1e-6;

/// A node of the run. The master calls [`enter`](Node::enter), then [`set`](Node::set) and
/// [`get`](Node::get) in the order of the data flow, then [`ready`](Node::ready), then `set`,
/// [`step`](Node::step), `get` for each communication step, and [`end`](Node::end).
pub trait Node: Send {
    /// Begins the initialisation; what the node did not keep of what it was told.
    fn enter(&mut self) -> Result<Vec<String>, Error> {
        Ok(Vec::new())
    }

    /// Ends the initialisation.
    fn ready(&mut self) -> Result<(), CallError> {
        Ok(())
    }

    /// Takes the values of the connected inputs.
    fn set(&mut self, _inputs: &[f64]) -> Result<(), CallError> {
        Ok(())
    }

    /// Takes the values of the connected inputs, some of which have courses in a step between two times [s], by their places. Without
    /// more, they hold the mean. `inputs` is left with any values.
    fn set_courses(
        &mut self,
        inputs: &mut [f64],
        courses: &[(usize, Course)],
        span: (f64, f64),
    ) -> Result<(), CallError> {
        self.set(means(inputs, courses, span))
    }

    /// Takes the values of the connected inputs at the end of a step, before its outputs are read: some follow them.
    fn settle(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.set(inputs)
    }

    /// How outputs change with inputs at this moment, without a step in between: `changes` of the inputs, in the order of
    /// [`set`](Self::set), become those of the outputs, in the order of [`get`](Self::get). False if the node does not know.
    fn derivatives(&mut self, _changes: &[f64], _outputs: &mut [f64]) -> Result<bool, CallError> {
        Ok(false)
    }

    /// Gives the values of all outputs.
    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError>;

    /// Takes the texts of the connected inputs, beside the numbers of [`set`](Node::set).
    fn set_texts(&mut self, _inputs: &[String]) -> Result<(), CallError> {
        Ok(())
    }

    /// Gives the texts of all outputs, beside the numbers of [`get`](Node::get).
    fn get_texts(&mut self, _outputs: &mut [String]) -> Result<(), CallError> {
        Ok(())
    }

    /// Takes the connected inputs that are integers of 64 bits, which [`set`](Node::set) leaves to this.
    fn set_integers(&mut self, _inputs: &[i128]) -> Result<(), CallError> {
        Ok(())
    }

    /// Gives the outputs that are integers of 64 bits, which [`get`](Node::get) leaves to this.
    fn get_integers(&mut self, _outputs: &mut [i128]) -> Result<(), CallError> {
        Ok(())
    }

    /// Goes from communication point `tick` to the next one.
    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError>;

    /// Takes the values of the connected inputs, goes from communication point `tick` of the clock to the next one, and gives the values of
    /// all outputs: [`set`](Node::set), [`step`](Node::step) and [`get`](Node::get) of a node without texts and integers of 64 bits.
    /// Says whether there are messages to take.
    fn visit(
        &mut self,
        inputs: &[f64],
        (clock, tick): (&Clock, u64),
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        self.set(inputs)?;
        self.step(clock, tick)?;
        self.get(outputs)?;
        Ok(self.has_messages())
    }

    /// Whether a process can hold one instance of it only.
    fn only_once(&self) -> bool {
        false
    }

    /// Takes other values of tunable parameters and of inputs that nothing is connected to, between two steps at `time` [s].
    fn tune(&mut self, _values: &[Start], _time: f64) -> Result<(), CallError> {
        Err(CallError::new("the node", "has no parameters"))
    }

    /// Asks the node to do this in its next step; whether it will.
    fn provoke(&mut self, _what: Provocation) -> bool {
        false
    }

    /// Takes other faults of its calls, for a run with these communication points.
    fn take_faults(&mut self, _faults: &[CallFault], _clock: &Clock) {}

    /// Ends the run.
    fn end(&mut self) -> Result<(), CallError> {
        Ok(())
    }

    /// Whether the node can save and restore its state.
    fn can_save(&self) -> bool {
        false
    }

    /// Saves the state, so that steps from here on can be repeated. Dropping the copy frees its memory.
    fn save(&mut self) -> Result<NodeState, CallError> {
        Err(state_error("the node cannot save its state"))
    }

    /// Saves the state in the place of one that this node saved.
    fn save_again(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        *state = self.save()?;
        Ok(())
    }

    /// Goes back to a state that this node saved.
    fn restore(&mut self, _state: &NodeState) -> Result<(), CallError> {
        Err(state_error("the node cannot restore its state"))
    }

    /// Whether a saved state can be turned into bytes.
    fn can_serialise(&self) -> bool {
        false
    }

    /// A saved state as bytes.
    fn serialise(&mut self, _state: &NodeState) -> Result<Vec<u8>, CallError> {
        Err(state_error("the node cannot turn its state into bytes"))
    }

    /// The state that [`serialise`](Self::serialise) gave as bytes, also of another instance.
    fn deserialise(&mut self, _bytes: &[u8]) -> Result<NodeState, CallError> {
        Err(state_error("the node cannot read its state from bytes"))
    }

    /// Whether there are messages to take now: of a kind that is new, or each one that it logs if it logs all it has to say.
    fn has_messages(&self) -> bool {
        false
    }

    /// Takes the messages that the node logged since the last time; repeated ones may have waited for it, see [`Message::again`].
    fn messages(&mut self) -> Vec<Message> {
        Vec::new()
    }

    /// The instance of an FMU in this process, for another run.
    fn into_instance(self: Box<Self>) -> Option<Instance> {
        None
    }
}

/// Inputs that hold the mean of their courses between two times [s].
fn means<'i>(inputs: &'i mut [f64], courses: &[(usize, Course)], span: (f64, f64)) -> &'i [f64] {
    courses.iter().for_each(|(place, course)| inputs[*place] = course.mean(span));
    inputs
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
    pub fn get<T: Any>(&self) -> Result<&T, CallError> {
        self.0
            .downcast_ref()
            .ok_or_else(|| state_error("the state is that of another kind of node"))
    }

    /// The same, to be replaced.
    ///
    /// # Errors
    /// When another kind of node saved it.
    pub fn get_mut<T: Any>(&mut self) -> Result<&mut T, CallError> {
        self.0
            .downcast_mut()
            .ok_or_else(|| state_error("the state is that of another kind of node"))
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
pub fn instantiate(system: &mut System, host: Option<&Host>) -> Result<Vec<Box<dyn Node>>, Error> {
    instantiate_again(system, host, &mut Kept::default())
}

/// The same with instances of an earlier run, where there are some.
///
/// # Errors
/// As of [`instantiate`].
pub fn instantiate_again(
    system: &mut System,
    host: Option<&Host>,
    kept: &mut Kept,
) -> Result<Vec<Box<dyn Node>>, Error> {
    let System { clock, announced_stop, tolerance, .. } = *system;
    let times = (clock.start, announced_stop);
    let mut notices = Vec::new();
    let nodes = system.nodes.iter_mut().map(|plan| {
        if let Body::Fmu { fmu, isolation: isolation @ None, .. } = &mut plan.body
            && let Some(why) = host.and_then(|_| fmu.clash_in_process())
        {
            // Of an earlier run, or of the run that this one validates.
            notices.push(Isolation::notice(&plan.name, &why));
            *isolation = Some(Isolation::plain());
        }
        // The last step of its own may end a unit in the last place later.
        let own = plan.pace.map(|pace| pace.of(&clock).announced_stop());
        let stop = times.1.map(|stop| own.map_or(stop, |own| own.max(stop)));
        let node = node(plan, ((times.0, stop), tolerance), host, kept)?;
        Ok(paced(node, plan, clock))
    });
    let mut nodes = Mistakes::all(nodes)?;
    system.warnings.append(&mut notices);
    with_faults(system, &mut nodes, false);
    Ok(nodes)
}

/// The node with the step of its own, if it has one.
pub(crate) fn paced(node: Box<dyn Node>, plan: &NodePlan, clock: Clock) -> Box<dyn Node> {
    match plan.pace {
        None => node,
        Some(pace) => Box::new(Paced::new(node, plan, pace, clock)),
    }
}

/// The nodes of a system that are no FMUs, and in the places of FMUs nodes that show nothing.
#[must_use]
pub fn sources(system: &mut System) -> Vec<Box<dyn Node>> {
    let source = |plan: &mut NodePlan| -> Box<dyn Node> {
        match &mut plan.body {
            Body::Signals(signals) => Box::new(SourceNode::new(std::mem::take(signals))),
            Body::Table(table) => Box::new(SourceNode::new(table.clone())),
            Body::Driver(driver) => Box::new(DriverNode::new(driver)),
            // The exchange puts the values of connectors into the row.
            Body::Inlet | Body::Outlet | Body::Fmu { .. } => Box::new(SourceNode::new(Vec::new())),
        }
    };
    system.nodes.iter_mut().map(source).collect()
}

fn node(
    plan: &mut NodePlan,
    (times, tolerance): ((f64, Option<f64>), Option<f64>),
    host: Option<&Host>,
    kept: &mut Kept,
) -> Result<Box<dyn Node>, Error> {
    Ok(match &mut plan.body {
        Body::Fmu { fmu, starts, inputs, outputs, log, isolation } => {
            let (log, name, ports) = (*log, &plan.name, (inputs.clone(), outputs.clone()));
            let starts = starts.clone();
            if let (Some(isolation), Some(host)) = (isolation, host) {
                let making = Making { fmu, name, log, ports, times, tolerance, starts };
                return Ok(Box::new(IsolatedNode::new(making, isolation, host)?));
            }
            let told = |refusal: Refusal| refusal.told(name, times.0);
            let mut node = match kept.take(name, fmu, &starts) {
                Some(instance) => FmuNode::of(instance, name, ports),
                None => FmuNode::new(fmu, name, log, ports).map_err(told)?,
            };
            node.prepare(times, tolerance, starts).map_err(told)?;
            Box::new(node)
        }
        Body::Signals(signals) => Box::new(SourceNode::new(std::mem::take(signals))),
        Body::Table(table) => Box::new(SourceNode::new(table.clone())),
        Body::Driver(driver) => Box::new(DriverNode::new(driver)),
        // The exchange puts their values into the row.
        Body::Inlet | Body::Outlet => Box::new(SourceNode::new(Vec::new())),
    })
}

#[cfg(test)]
mod tests;
