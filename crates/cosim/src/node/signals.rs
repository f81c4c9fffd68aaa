//! Shows generated signals as a node. Its state is its time: signals have no memory.

use fmu_import::CallError;
use scenario::plan::Clock;
use scenario::signal::Signal;

use super::{Node, NodeState};

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

    fn can_save(&self) -> bool {
        true
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        Ok(NodeState::new(self.time))
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.time = *state.get()?;
        Ok(())
    }
}
