//! Puts values from outside in the place of some outputs of a node, or of what connections bring to inputs.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cosim::clock::CommunicationClock;
use cosim::fault::FaultAction;
use cosim::node::{Node, TypedValues};
use cosim::system::InputFault;
use fmu_import::CallError;

/// Values from outside for some outputs of one node.
#[derive(Debug, Clone, Default)]
pub(crate) struct ExternalValues(Arc<Mutex<Vec<ExternalOutput>>>);

#[derive(Debug)]
struct ExternalOutput {
    /// Its place among the outputs that are numbers.
    number: usize,
    /// Its place among those that are integers of 64 bits, if it is one.
    integer: Option<usize>,
    /// Without one the node has its own.
    value: Option<f64>,
}

impl ExternalValues {
    /// The values of these outputs, none at first. Each has a place among the numbers, and one among the integers of 64 bits if it
    /// is one.
    pub fn new(outputs: impl Iterator<Item = (usize, Option<usize>)>) -> Self {
        let external = outputs.map(|(number, integer)| ExternalOutput { number, integer, value: None });
        ExternalValues(Arc::new(Mutex::new(external.collect())))
    }

    /// Sets these values from here on, in the order of the outputs; an output without one has the node's own.
    pub fn set_values(&self, values: impl Iterator<Item = Option<f64>>) {
        self.lock_outputs().iter_mut().zip(values).for_each(|(external, value)| external.value = value);
    }

    fn lock_outputs(&self) -> MutexGuard<'_, Vec<ExternalOutput>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A node, some outputs of which come from outside.
pub(crate) struct ExternallyDrivenNode {
    pub node: Box<dyn Node>,
    pub external: ExternalValues,
}

impl Node for ExternallyDrivenNode {
    fn inner_node(&self) -> Option<&dyn Node> {
        Some(self.node.as_ref())
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Node> {
        Some(self.node.as_mut())
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.node.get_outputs(outputs)?;
        for ExternalOutput { number, value, .. } in self.external.lock_outputs().iter() {
            if let Some(value) = *value {
                outputs[*number] = value;
            }
        }
        Ok(())
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.node.do_step(clock, tick)
    }

    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }
}

impl TypedValues for ExternallyDrivenNode {
    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.node.typed_values().map_or(Ok(()), |node| node.set_texts(inputs))
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.node.typed_values().map_or(Ok(()), |node| node.get_texts(outputs))
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        self.node.typed_values().map_or(Ok(()), |node| node.set_integers(inputs))
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        if let Some(node) = self.node.typed_values() {
            node.get_integers(outputs)?;
        }
        for ExternalOutput { integer, value, .. } in self.external.lock_outputs().iter() {
            if let (Some(integer), Some(value)) = (*integer, *value) {
                outputs[integer] = value as i128;
            }
        }
        Ok(())
    }
}

/// A value from outside for a connected input of an FMU, at the end of its way there: behind the effects and faults of the scenario,
/// which go on. All clones have the same value.
#[derive(Debug, Clone, Default)]
pub(crate) struct InputValue(Arc<Mutex<Option<f64>>>);

impl InputValue {
    /// Sets the value from the next step on; without one the input has that of its connection.
    pub fn set(&self, value: Option<f64>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = value;
    }

    /// The part of the way to the input that puts it in.
    pub fn to_input_fault(&self) -> InputFault {
        InputFault { from: f64::NEG_INFINITY, until: f64::INFINITY, action: Box::new(self.clone()) }
    }
}

impl FaultAction for InputValue {
    fn faulty_value(&mut self, value: f64) -> f64 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).unwrap_or(value)
    }

    fn clone_box(&self) -> Box<dyn FaultAction> {
        Box::new(self.clone())
    }
}
