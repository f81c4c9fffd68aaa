//! Lets the calls of a node fail where the scenario says so.

use std::time::Duration;

use fmu_import::{CallError, FmiVersion, FmuMessage, Instance, MessageLevel};

use super::{FaultInjection, InjectedFault, Node, NodeState, SourceNode, Stateful, stateful_node};
use crate::clock::CommunicationClock;
use crate::fault::{CallFault, CallFaultKind};
use crate::signal::Signal;
use crate::system::{NodeBody, System};

/// A node whose calls may fail. Its state is that of the node inside: which steps fail is known without memory.
struct FaultyNode {
    node: Box<dyn Node>,
    version: FmiVersion,
    /// The communication points of the run.
    clock: CommunicationClock,
    faults: Vec<CallFault>,
    /// The outputs that are NaN since the last step.
    not_numbers: Vec<usize>,
    messages: Vec<FmuMessage>,
}

/// Puts the FMUs with faulty calls, or the `others`, which may get some later, into nodes that let them fail.
pub fn with_call_faults(system: &System, nodes: &mut [Box<dyn Node>], others: bool) {
    for (plan, node) in system.nodes.iter().zip(nodes) {
        let NodeBody::Fmu { fmu, .. } = &plan.body else { continue };
        if plan.faults.is_empty() != others {
            continue;
        }
        let nothing = || Box::new(SourceNode::new(Vec::<Signal>::new()));
        let mut faulty = FaultyNode {
            node: std::mem::replace(node, nothing()),
            version: fmu.description.version,
            clock: system.clock,
            faults: Vec::new(),
            not_numbers: Vec::new(),
            messages: Vec::new(),
        };
        faulty.set_call_faults(&plan.faults, &system.clock);
        *node = Box::new(faulty);
    }
}

impl FaultyNode {
    fn log_injected_fault(&mut self, what: &str) {
        // The scenario asks for it: nobody has to be warned.
        self.messages.push(FmuMessage::new(MessageLevel::Info, "fault", what));
    }

    fn injected_fault_error(&self, what: &str) -> CallError {
        let call = self.version.function("fmi2DoStep", "fmi3DoStep");
        CallError::new(call, format!("{what}: a fault of the scenario"))
    }

    fn discard_error(&self) -> CallError {
        let status = self.version.function("fmi2Discard", "fmi3Discard");
        CallError { discarded: true, ..self.injected_fault_error(&format!("returned {status}")) }
    }
}

impl Node for FaultyNode {
    fn inner_node(&self) -> Option<&dyn Node> {
        Some(self.node.as_ref())
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Node> {
        Some(self.node.as_mut())
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.not_numbers.clear();
        let time = clock.time_at(tick);
        // A part of a step is shorter than this.
        let whole = clock.step > 0.999 * self.clock.step;
        let acting = self.faults.iter().filter(|fault| fault.is_active(time, &self.clock));
        let acting: Vec<_> = acting.map(|fault| fault.kind.clone()).collect();
        for kind in acting {
            match kind {
                CallFaultKind::Discard if whole => {
                    self.log_injected_fault("a fault discards its step");
                    return Err(self.discard_error());
                }
                CallFaultKind::Discard => {}
                CallFaultKind::Late(seconds) => {
                    self.log_injected_fault("a fault lets its step last longer");
                    if !self.inject_fault(InjectedFault::Wait(seconds)) {
                        std::thread::sleep(Duration::from_secs_f64(seconds));
                    }
                }
                CallFaultKind::NotANumber(outputs) => {
                    self.log_injected_fault("a fault makes outputs NaN");
                    self.not_numbers.extend(outputs);
                }
                CallFaultKind::Crash => {
                    self.log_injected_fault("a fault crashes it");
                    if !self.inject_fault(InjectedFault::Crash) {
                        return Err(self.injected_fault_error("crashed"));
                    }
                }
            }
        }
        self.node.do_step(clock, tick)
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.node.get_outputs(outputs)?;
        for place in &self.not_numbers {
            outputs.get_mut(*place).into_iter().for_each(|output| *output = f64::NAN);
        }
        Ok(())
    }

    fn has_messages(&self) -> bool {
        !self.messages.is_empty() || self.node.has_messages()
    }

    fn take_messages(&mut self) -> Vec<FmuMessage> {
        let mut messages = std::mem::take(&mut self.messages);
        messages.append(&mut self.node.take_messages());
        messages
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn as_fault_injection(&mut self) -> Option<&mut dyn FaultInjection> {
        Some(self)
    }

    fn into_instance(self: Box<Self>) -> Option<Instance> {
        self.node.into_instance()
    }
}

impl FaultInjection for FaultyNode {
    fn inject_fault(&mut self, fault: InjectedFault) -> bool {
        self.node.as_fault_injection().is_some_and(|node| node.inject_fault(fault))
    }

    fn set_call_faults(&mut self, faults: &[CallFault], clock: &CommunicationClock) {
        (self.faults, self.clock) = (faults.to_vec(), *clock);
        self.not_numbers.clear();
    }
}

/// That of the node inside: what else it knows is about the step before.
impl Stateful for FaultyNode {
    fn can_save(&mut self) -> bool {
        self.node.as_stateful().is_some_and(|node| node.can_save())
    }

    fn save_state(&mut self) -> Result<NodeState, CallError> {
        stateful_node(self.node.as_mut())?.save_state()
    }

    fn save_into(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        stateful_node(self.node.as_mut())?.save_into(state)
    }

    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.not_numbers.clear();
        stateful_node(self.node.as_mut())?.restore_state(state)
    }

    fn serialise_state(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        stateful_node(self.node.as_mut())?.serialise_state(state)
    }

    fn deserialise_state(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        stateful_node(self.node.as_mut())?.deserialise_state(bytes)
    }
}
