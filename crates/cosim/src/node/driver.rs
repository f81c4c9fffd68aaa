//! Shows the driver of a manoeuvre as a node: at each communication point it measures, and commands until the next one.

use fmu_import::CallError;
use manoeuvre::{DriverState, ManoeuvreDriver, OUTPUTS};
use serde::{Deserialize, Serialize};

use super::{Node, NodeState, Stateful, state_error};
use crate::clock::CommunicationClock;
use crate::system::DriverPlan;

/// The driver of a manoeuvre.
#[derive(Debug)]
pub(super) struct DriverNode {
    driver: ManoeuvreDriver,
    steering_ratio: f64,
    inputs: Vec<f64>,
    commands: [f64; OUTPUTS.len()],
}

/// What the node remembers.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct DriverNodeState {
    driver: DriverState,
    commands: [f64; OUTPUTS.len()],
}

impl DriverNode {
    /// A driver before the run, who commands nothing.
    pub(super) fn new(plan: &DriverPlan) -> Self {
        let DriverPlan { manoeuvre, steering_ratio } = plan.clone();
        let inputs = vec![0.0; manoeuvre.kind.required_channels().len()];
        let driver = ManoeuvreDriver::new(manoeuvre);
        DriverNode { driver, steering_ratio, inputs, commands: [0.0; OUTPUTS.len()] }
    }
}

impl Node for DriverNode {
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs.copy_from_slice(inputs);
        Ok(())
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        let [steer, ..] = self.commands;
        let all = self.commands.into_iter().chain([self.steering_ratio * steer]);
        outputs.iter_mut().zip(all).for_each(|(output, command)| *output = command);
        Ok(())
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.commands = self.driver.step_commands(clock.time_at(tick + 1), &self.inputs);
        Ok(())
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }
}

impl Stateful for DriverNode {
    fn save_state(&mut self) -> Result<NodeState, CallError> {
        let driver = self.driver.saved_state();
        Ok(NodeState::new(DriverNodeState { driver, commands: self.commands }))
    }

    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError> {
        let DriverNodeState { driver, commands } = *state.downcast_ref()?;
        self.driver.restore_state(driver);
        self.commands = commands;
        Ok(())
    }

    fn serialise_state(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        let memory: &DriverNodeState = state.downcast_ref()?;
        postcard::to_stdvec(memory).map_err(|error| state_error(&error.to_string()))
    }

    fn deserialise_state(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        let memory: Result<DriverNodeState, _> = postcard::from_bytes(bytes);
        let unreadable = |_| state_error("these bytes are not what a driver remembers");
        memory.map(NodeState::new).map_err(unreadable)
    }
}
