//! Puts values from outside in the place of some outputs of a node.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cosim::clock::CommunicationClock;
use cosim::node::{Node, TypedValues};
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
    value: f64,
}

impl ExternalValues {
    /// The values of these outputs, 0 at first. Each has a place among the numbers, and one among the integers of 64 bits if it
    /// is one.
    pub fn new(outputs: impl Iterator<Item = (usize, Option<usize>)>) -> Self {
        let external = outputs.map(|(number, integer)| ExternalOutput { number, integer, value: 0.0 });
        ExternalValues(Arc::new(Mutex::new(external.collect())))
    }

    /// Sets these values from here on, in the order of the outputs.
    pub fn set_values(&self, values: impl Iterator<Item = f64>) {
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
        self.external.lock_outputs().iter().for_each(|external| outputs[external.number] = external.value);
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
            if let Some(integer) = *integer {
                outputs[integer] = *value as i128;
            }
        }
        Ok(())
    }
}
