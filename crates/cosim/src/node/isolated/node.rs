//! Makes the process of an FMU a node like others.

use diagnostics::Error;
use fmu_import::{CallError, Message};

use super::talk::{Done, Others, Task};
use super::{IsolatedNode, nonsense};
use crate::clock::Clock;
use crate::course::Course;
use crate::node::faulty::Provocation;
use crate::node::fmu::Bytes;
use crate::node::{Node, NodeState, means};
use crate::system::{OnFailure, Start};

/// The outputs of an FMU that has failed.
struct HeldState((Vec<f64>, Others));

impl IsolatedNode {
    /// Asks for the outputs, unless they are there.
    fn see(&mut self) -> Result<(), CallError> {
        match self.shown || self.held {
            true => Ok(()),
            false => self.call(Task::Show).map(|_| ()),
        }
    }
}

/// Copies outputs of which there are as many as expected.
fn copy<T: Clone>(from: &[T], to: &mut [T]) -> Result<(), CallError> {
    if from.len() != to.len() {
        return Err(nonsense());
    }
    to.clone_from_slice(from);
    Ok(())
}

impl Node for IsolatedNode {
    fn enter(&mut self) -> Result<Vec<String>, Error> {
        match self.ask(Task::Enter).map_err(|refusal| self.told(refusal))? {
            Done::Entered(mut notices) => {
                let name = &self.setup.name;
                let lacks = self.lacks.drain(..);
                notices.extend(
                    lacks.map(|what| format!("the sandbox of `{name}` is not whole: {what}")),
                );
                Ok(notices)
            }
            _ => Err(self.told(nonsense().into())),
        }
    }

    fn ready(&mut self) -> Result<(), CallError> {
        self.call(Task::Ready).map(|_| ())
    }

    fn set(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs.0.clear();
        self.inputs.0.extend_from_slice(inputs);
        self.inputs.1.courses = None;
        (self.pending, self.shown) = (true, false);
        Ok(())
    }

    fn set_courses(
        &mut self,
        inputs: &mut [f64],
        courses: &[(usize, Course)],
        span: (f64, f64),
    ) -> Result<(), CallError> {
        if !self.can.2 {
            return self.set(means(inputs, courses, span));
        }
        self.set(inputs)?;
        self.inputs.1.courses = Some((courses.to_vec(), span));
        Ok(())
    }

    fn derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError> {
        match self.call(Task::Derivatives(changes.to_vec()))? {
            Done::Changes(None) => Ok(false),
            Done::Changes(Some(found)) => copy(&found, outputs).map(|()| true),
            _ => Err(nonsense()),
        }
    }

    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.see()?;
        copy(&self.outputs.0, outputs)
    }

    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        if inputs.is_empty() {
            return Ok(());
        }
        self.inputs.1.texts.clear();
        self.inputs.1.texts.extend_from_slice(inputs);
        (self.pending, self.shown) = (true, false);
        Ok(())
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.see()?;
        copy(&self.outputs.1.texts, outputs)
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        self.inputs.1.integers.clear();
        self.inputs.1.integers.extend_from_slice(inputs);
        (self.pending, self.shown) = (true, false);
        Ok(())
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.see()?;
        copy(&self.outputs.1.integers, outputs)
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        if self.held {
            return Ok(());
        }
        self.go(clock, tick).or_else(|failure| self.go_on(failure, clock, tick))
    }

    fn provoke(&mut self, what: Provocation) -> bool {
        self.provoked = Some(what);
        true
    }

    fn end(&mut self) -> Result<(), CallError> {
        match self.held {
            true => Ok(()),
            false => self.call(Task::End).map(|_| ()),
        }
    }

    fn can_save(&self) -> bool {
        self.can.0
    }

    fn tune(&mut self, values: &[Start], time: f64) -> Result<(), CallError> {
        match self.held {
            true => Ok(()),
            false => self.call(Task::Tune(values.to_vec(), time)).map(|_| ()),
        }
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        if self.held {
            return Ok(NodeState::new(HeldState(self.outputs.clone())));
        }
        let done = self.call(Task::Save)?;
        self.kept(&done)
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        if let Ok(HeldState(outputs)) = state.get() {
            (self.held, self.outputs) = (true, outputs.clone());
            return Ok(());
        }
        let number = self.number(state)?;
        self.call(Task::Restore(number))?;
        self.held = false;
        match self.isolation.on_failure {
            // It may fail before it shows anything.
            OnFailure::Hold => self.see(),
            OnFailure::End | OnFailure::Restart => Ok(()),
        }
    }

    fn can_serialise(&self) -> bool {
        self.can.1
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        if let Ok(HeldState((numbers, Others { integers, texts, .. }))) = state.get() {
            return Bytes::Held(numbers.clone(), integers.clone(), texts.clone()).pack();
        }
        let number = self.number(state)?;
        match self.call(Task::Serialise(number))? {
            Done::Bytes(bytes) => Ok(bytes),
            _ => Err(nonsense()),
        }
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        if let Bytes::Held(numbers, integers, texts) = Bytes::unpack(bytes)? {
            return Ok(NodeState::new(HeldState((
                numbers,
                Others { integers, texts, courses: None },
            ))));
        }
        let done = self.call(Task::Deserialise(bytes.to_owned()))?;
        self.kept(&done)
    }

    fn has_messages(&self) -> bool {
        !self.messages.is_empty()
    }

    fn messages(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.messages)
    }
}
