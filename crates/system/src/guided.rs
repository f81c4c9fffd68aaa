//! Puts values from outside in the place of some outputs of a node.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cosim::clock::Clock;
use cosim::node::{Node, NodeState};
use diagnostics::Error;
use fmu_import::{CallError, Message};

/// Values from outside for some outputs of one node.
#[derive(Debug, Clone, Default)]
pub(crate) struct Held(Arc<Mutex<Vec<HeldOutput>>>);

#[derive(Debug)]
struct HeldOutput {
    /// Its place among the outputs that are numbers.
    number: usize,
    /// Its place among those that are integers of 64 bits, if it is one.
    integer: Option<usize>,
    value: f64,
}

impl Held {
    /// The values of these outputs, 0 at first. Each has a place among the numbers, and one among the integers of 64 bits if it
    /// is one.
    pub fn new(outputs: impl Iterator<Item = (usize, Option<usize>)>) -> Self {
        let held = outputs.map(|(number, integer)| HeldOutput { number, integer, value: 0.0 });
        Held(Arc::new(Mutex::new(held.collect())))
    }

    /// Holds these values from here on, in the order of the outputs.
    pub fn hold(&self, values: impl Iterator<Item = f64>) {
        self.lock().iter_mut().zip(values).for_each(|(held, value)| held.value = value);
    }

    fn lock(&self) -> MutexGuard<'_, Vec<HeldOutput>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A node, some outputs of which come from outside.
pub(crate) struct Guided {
    pub node: Box<dyn Node>,
    pub held: Held,
}

impl Node for Guided {
    fn enter(&mut self) -> Result<Vec<String>, Error> {
        self.node.enter()
    }

    fn ready(&mut self) -> Result<(), CallError> {
        self.node.ready()
    }

    fn set(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.node.set(inputs)
    }

    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.node.get(outputs)?;
        self.held.lock().iter().for_each(|held| outputs[held.number] = held.value);
        Ok(())
    }

    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.node.set_texts(inputs)
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.node.get_texts(outputs)
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        self.node.set_integers(inputs)
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.node.get_integers(outputs)?;
        for HeldOutput { integer, value, .. } in self.held.lock().iter() {
            if let Some(integer) = *integer {
                outputs[integer] = *value as i128;
            }
        }
        Ok(())
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.node.step(clock, tick)
    }

    fn end(&mut self) -> Result<(), CallError> {
        self.node.end()
    }

    fn can_save(&self) -> bool {
        self.node.can_save()
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        self.node.save()
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.node.restore(state)
    }

    fn can_serialise(&self) -> bool {
        self.node.can_serialise()
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        self.node.serialise(state)
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        self.node.deserialise(bytes)
    }

    fn messages(&mut self) -> Vec<Message> {
        self.node.messages()
    }
}
