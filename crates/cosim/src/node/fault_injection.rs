//! Lets the calls of a node fail where the scenario says so.

use std::time::Duration;

use fmu_import::{CallError, Instance, Message, MessageLevel, Version};

use super::{FaultInjection, InjectedFault, Node, NodeState, SourceNode, Stateful, state_of};
use crate::clock::Clock;
use crate::fault::{CallFault, CallFaultKind};
use crate::signal::Signal;
use crate::system::{Body, System};

/// A node whose calls may fail. Its state is that of the node inside: which steps fail is known without memory.
struct FaultyNode {
    node: Box<dyn Node>,
    version: Version,
    /// The communication points of the run.
    clock: Clock,
    faults: Vec<CallFault>,
    /// The outputs that are NaN since the last step.
    not_numbers: Vec<usize>,
    messages: Vec<Message>,
}

/// Puts the FMUs with faulty calls, or the `others`, which may get some later, into nodes that let them fail.
pub fn with_call_faults(system: &System, nodes: &mut [Box<dyn Node>], others: bool) {
    for (plan, node) in system.nodes.iter().zip(nodes) {
        let Body::Fmu { fmu, .. } = &plan.body else { continue };
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
    fn log(&mut self, what: &str) {
        // The scenario asks for it: nobody has to be warned.
        self.messages.push(Message::new(MessageLevel::Info, "fault", what));
    }

    fn failure(&self, what: &str) -> CallError {
        let call = match self.version {
            Version::Two => "fmi2DoStep",
            Version::Three => "fmi3DoStep",
        };
        CallError::new(call, format!("{what}: a fault of the scenario"))
    }

    fn discard(&self) -> CallError {
        let status = match self.version {
            Version::Two => "fmi2Discard",
            Version::Three => "fmi3Discard",
        };
        CallError { discarded: true, ..self.failure(&format!("returned {status}")) }
    }
}

impl Node for FaultyNode {
    fn inner(&self) -> Option<&dyn Node> {
        Some(self.node.as_ref())
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Node> {
        Some(self.node.as_mut())
    }

    fn do_step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.not_numbers.clear();
        let time = clock.at(tick);
        // A part of a step is shorter than this.
        let whole = clock.step > 0.999 * self.clock.step;
        let acting = self.faults.iter().filter(|fault| fault.acts(time, &self.clock));
        let acting: Vec<_> = acting.map(|fault| fault.kind.clone()).collect();
        for kind in acting {
            match kind {
                CallFaultKind::Discard if whole => {
                    self.log("a fault discards its step");
                    return Err(self.discard());
                }
                CallFaultKind::Discard => {}
                CallFaultKind::Late(seconds) => {
                    self.log("a fault lets its step last longer");
                    if !self.inject_fault(InjectedFault::Wait(seconds)) {
                        std::thread::sleep(Duration::from_secs_f64(seconds));
                    }
                }
                CallFaultKind::NotANumber(outputs) => {
                    self.log("a fault makes outputs NaN");
                    self.not_numbers.extend(outputs);
                }
                CallFaultKind::Crash => {
                    self.log("a fault crashes it");
                    if !self.inject_fault(InjectedFault::Crash) {
                        return Err(self.failure("crashed"));
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

    fn messages(&mut self) -> Vec<Message> {
        let mut messages = std::mem::take(&mut self.messages);
        messages.append(&mut self.node.messages());
        messages
    }

    fn state(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn faults(&mut self) -> Option<&mut dyn FaultInjection> {
        Some(self)
    }

    fn into_instance(self: Box<Self>) -> Option<Instance> {
        self.node.into_instance()
    }
}

impl FaultInjection for FaultyNode {
    fn inject_fault(&mut self, fault: InjectedFault) -> bool {
        self.node.faults().is_some_and(|node| node.inject_fault(fault))
    }

    fn set_call_faults(&mut self, faults: &[CallFault], clock: &Clock) {
        (self.faults, self.clock) = (faults.to_vec(), *clock);
        self.not_numbers.clear();
    }
}

/// That of the node inside: what else it knows is about the step before.
impl Stateful for FaultyNode {
    fn can_save(&mut self) -> bool {
        self.node.state().is_some_and(|node| node.can_save())
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        state_of(self.node.as_mut())?.save()
    }

    fn save_into(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        state_of(self.node.as_mut())?.save_into(state)
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.not_numbers.clear();
        state_of(self.node.as_mut())?.restore(state)
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        state_of(self.node.as_mut())?.serialise(state)
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        state_of(self.node.as_mut())?.deserialise(bytes)
    }
}
