//! Lets the calls of a node fail where the scenario says so.

use std::time::Duration;

use diagnostics::Error;
use fmu_import::{CallError, Instance, Message, MessageLevel, Version};

use super::{Node, NodeState};
use crate::clock::Clock;
use crate::course::Course;
use crate::fault::{CallFault, CallFaultKind};
use crate::system::{Body, Start, System};

/// What a node does in its next step on demand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Provocation {
    /// It waits for this time first [s].
    Wait(f64),
    /// It crashes.
    Crash,
}

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
pub fn with_faults(system: &System, nodes: &mut [Box<dyn Node>], others: bool) {
    for (plan, node) in system.nodes.iter().zip(nodes) {
        let Body::Fmu { fmu, .. } = &plan.body else { continue };
        if plan.faults.is_empty() != others {
            continue;
        }
        let nothing = || Box::new(super::SourceNode::new(Vec::<crate::signal::Signal>::new()));
        let mut faulty = FaultyNode {
            node: std::mem::replace(node, nothing()),
            version: fmu.description.version,
            clock: system.clock,
            faults: Vec::new(),
            not_numbers: Vec::new(),
            messages: Vec::new(),
        };
        faulty.take_faults(&plan.faults, &system.clock);
        *node = Box::new(faulty);
    }
}

impl FaultyNode {
    fn say(&mut self, what: &str) {
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
    fn into_instance(self: Box<Self>) -> Option<Instance> {
        self.node.into_instance()
    }

    fn take_faults(&mut self, faults: &[CallFault], clock: &Clock) {
        (self.faults, self.clock) = (faults.to_vec(), *clock);
        self.not_numbers.clear();
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.not_numbers.clear();
        let time = clock.at(tick);
        // A part of a step is shorter than this.
        let whole = clock.step > 0.999 * self.clock.step;
        let acting = self.faults.iter().filter(|fault| fault.acts(time, &self.clock));
        let acting: Vec<_> = acting.map(|fault| fault.kind.clone()).collect();
        for kind in acting {
            match kind {
                CallFaultKind::Discard if whole => {
                    self.say("a fault discards its step");
                    return Err(self.discard());
                }
                CallFaultKind::Discard => {}
                CallFaultKind::Late(seconds) => {
                    self.say("a fault lets its step last longer");
                    if !self.node.provoke(Provocation::Wait(seconds)) {
                        std::thread::sleep(Duration::from_secs_f64(seconds));
                    }
                }
                CallFaultKind::NotANumber(outputs) => {
                    self.say("a fault makes outputs NaN");
                    self.not_numbers.extend(outputs);
                }
                CallFaultKind::Crash => {
                    self.say("a fault crashes it");
                    if !self.node.provoke(Provocation::Crash) {
                        return Err(self.failure("crashed"));
                    }
                }
            }
        }
        self.node.step(clock, tick)
    }

    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.node.get(outputs)?;
        for place in &self.not_numbers {
            outputs.get_mut(*place).into_iter().for_each(|output| *output = f64::NAN);
        }
        Ok(())
    }

    fn messages(&mut self) -> Vec<Message> {
        let mut messages = std::mem::take(&mut self.messages);
        messages.append(&mut self.node.messages());
        messages
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.not_numbers.clear();
        self.node.restore(state)
    }

    fn enter(&mut self) -> Result<Vec<String>, Error> {
        self.node.enter()
    }

    fn ready(&mut self) -> Result<(), CallError> {
        self.node.ready()
    }

    fn set(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.node.set(inputs)
    }

    fn set_courses(
        &mut self,
        inputs: &mut [f64],
        courses: &[(usize, Course)],
        span: (f64, f64),
    ) -> Result<(), CallError> {
        self.node.set_courses(inputs, courses, span)
    }

    fn settle(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.node.settle(inputs)
    }

    fn derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError> {
        self.node.derivatives(changes, outputs)
    }

    fn save_again(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        self.node.save_again(state)
    }

    fn has_messages(&self) -> bool {
        !self.messages.is_empty() || self.node.has_messages()
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
        self.node.get_integers(outputs)
    }

    fn tune(&mut self, values: &[Start], time: f64) -> Result<(), CallError> {
        self.node.tune(values, time)
    }

    fn only_once(&self) -> bool {
        self.node.only_once()
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

    fn can_serialise(&self) -> bool {
        self.node.can_serialise()
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        self.node.serialise(state)
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        self.node.deserialise(bytes)
    }
}
