//! Steps an FMU as a node.

use std::sync::Arc;

use fmu_import::{CallError, Fmu, Instance, Message};
use scenario::plan::{Clock, Ports, StartValue};

use super::{Node, NodeState};

/// An FMU as a node. Its numbers travel in the order real, integer, boolean.
pub struct FmuNode {
    instance: Instance,
    inputs: Ports,
    outputs: Ports,
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
    ) -> Result<Self, CallError> {
        let library = fmu.load().map_err(|error| CallError::new("loading", error.to_string()))?;
        let instance = Instance::new(library, name, logging)?;
        let integers = Vec::with_capacity(inputs.len().max(outputs.len()));
        Ok(FmuNode { instance, inputs, outputs, integers })
    }

    /// Gives the instance a start value.
    ///
    /// # Errors
    /// When the FMU refuses it.
    pub fn start(&mut self, reference: u32, value: &StartValue) -> Result<(), CallError> {
        match value {
            StartValue::Real(value) => self.instance.set_real(&[reference], &[*value]),
            StartValue::Integer(value) => self.instance.set_integer(&[reference], &[*value]),
            StartValue::Boolean(value) => {
                self.instance.set_boolean(&[reference], &[i32::from(*value)])
            }
            StartValue::String(value) => self.instance.set_string(reference, value),
        }
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
