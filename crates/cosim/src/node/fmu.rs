//! Steps an FMU as a node.

use std::sync::Arc;

use diagnostics::Error;
use fmu_import::{CallError, Causality, Fmu, Instance, Message, Value};
use scenario::plan::{Clock, Ports, Start};

use super::{Node, NodeState};

/// An FMU as a node. Its numbers travel in the order real, integer, boolean.
pub struct FmuNode {
    name: String,
    instance: Instance,
    inputs: Ports,
    outputs: Ports,
    starts: Vec<Start>,
    integers: Vec<i32>,
}

impl FmuNode {
    /// Makes an instance called `name`.
    ///
    /// # Errors
    /// When the library does not load, or the FMU makes no instance.
    pub fn new(
        fmu: &Arc<Fmu>,
        name: &str,
        logging: bool,
        (inputs, outputs): (Ports, Ports),
    ) -> Result<Self, Error> {
        let failure = |error: CallError| Error::component(name, error.call, None, error.what);
        let library =
            fmu.load().map_err(|error| failure(CallError::new("loading", error.to_string())))?;
        let instance = Instance::new(library, name, logging).map_err(failure)?;
        let integers = Vec::with_capacity(inputs.len().max(outputs.len()));
        let (name, starts) = (name.to_owned(), Vec::new());
        Ok(FmuNode { name, instance, inputs, outputs, starts, integers })
    }

    /// Tells the instance the experiment, and then its start values: some FMUs forget what they were told before it. Inputs get
    /// theirs in [`enter`](Node::enter), since before that only what is exact or approximate may be set (FMI 2.0.4, section
    /// 4.2.4). The tolerance is that of the description unless there is another.
    ///
    /// # Errors
    /// When the FMU refuses the experiment, and, at the word that gives it, when it refuses a start value.
    pub fn prepare(
        &mut self,
        clock: &Clock,
        tolerance: Option<f64>,
        starts: Vec<Start>,
    ) -> Result<(), Error> {
        self.starts = starts;
        let tolerance = tolerance.or(self.instance.description().default_tolerance);
        let setup = self.instance.setup_experiment(clock.at(0), clock.announced_stop(), tolerance);
        setup.map_err(|error| failure(&self.name, error))?;
        let FmuNode { name, instance, starts, .. } = self;
        let mut early = starts.iter().filter(|start| start.causality != Causality::Input);
        early.try_for_each(|start| give(instance, name, start))
    }
}

/// Gives the instance called `name` a start value.
fn give(instance: &mut Instance, name: &str, start: &Start) -> Result<(), Error> {
    let given = instance.write(start.reference, &start.value);
    given.map_err(|error| start.refused(name, &format!("{} {}", error.call, error.what)))
}

/// The value that the instance called `name` has where it was given this one. It may not be called after an error.
fn kept(instance: &mut Instance, name: &str, start: &Start) -> Result<Value, Error> {
    let kept = instance.read(start.value.kind(), start.reference);
    kept.map_err(|error| failure(name, error))
}

/// Gives a parameter its start value once more, if the instance did not keep it; what to tell if it does not keep it then.
fn insist(instance: &mut Instance, name: &str, start: &Start) -> Result<Option<String>, Error> {
    let Start { name: variable, value, .. } = start;
    if kept(instance, name, start)? == *value {
        return Ok(None);
    }
    give(instance, name, start)?;
    let now = kept(instance, name, start)?;
    Ok((now != *value).then(|| {
        format!("`{name}` does not keep the start value {value} of `{variable}`: it has {now}")
    }))
}

/// The error of a call before the first step.
fn failure(name: &str, error: CallError) -> Error {
    Error::component(name, error.call, Some(0.0), error.what)
}

impl Node for FmuNode {
    fn enter(&mut self) -> Result<Vec<String>, Error> {
        let FmuNode { name, instance, starts, .. } = self;
        instance.enter_initialization().map_err(|error| failure(name, error))?;
        let mut notices = Vec::new();
        for start in std::mem::take(starts) {
            match start.causality {
                Causality::Input => give(instance, name, &start)?,
                Causality::Parameter => notices.extend(insist(instance, name, &start)?),
                _ => {}
            }
        }
        Ok(notices)
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
        // The connections let nothing through but integers, which `f64` holds exactly.
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

    fn can_save(&self) -> bool {
        self.instance.can_save()
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        self.instance.save().map(NodeState::new)
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.instance.restore(state.get()?)
    }

    fn messages(&mut self) -> Vec<Message> {
        self.instance.messages()
    }
}
