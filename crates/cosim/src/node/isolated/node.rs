//! Makes the process of an FMU a node like others.

use std::ops::Range;

use diagnostics::Error;
use fmu_import::{CallError, Message};

use super::protocol::{Command, OtherValues, Outcome, StepPolynomials};
use super::{IsolatedNode, Values, unexpected};
use crate::clock::Clock;
use crate::node::fmu::Bytes;
use crate::node::{
    DirectionalDerivatives, ExtrapolatedInputs, FaultInjection, InjectedFault, InputPolynomial,
    Node, NodeState, Stateful, TunableParameters, TypedValues,
};
use crate::system::{OnFailure, StartValue};

/// The outputs of an FMU that has failed.
struct FrozenState(Values);

impl IsolatedNode {
    /// Asks for the outputs, unless they are there.
    fn fetch_outputs(&mut self) -> Result<(), CallError> {
        match self.has_outputs || self.frozen {
            true => Ok(()),
            false => self.call(Command::GetOutputs).map(|_| ()),
        }
    }

    /// There are inputs that the process does not know.
    fn note_new_inputs(&mut self) {
        (self.has_new_inputs, self.has_outputs) = (true, false);
    }
}

/// Copies outputs of which there are as many as expected.
fn copy<T: Clone>(from: &[T], to: &mut [T]) -> Result<(), CallError> {
    if from.len() != to.len() {
        return Err(unexpected());
    }
    to.clone_from_slice(from);
    Ok(())
}

impl Node for IsolatedNode {
    fn enter_initialization(&mut self) -> Result<Vec<String>, Error> {
        let entered = self.ask(Command::EnterInitialization);
        match entered.map_err(|refusal| self.refused(refusal))? {
            Outcome::Initialized(mut notices) => {
                let name = &self.setup.name;
                let lacks = self.lacks.drain(..);
                notices.extend(
                    lacks.map(|what| format!("the sandbox of `{name}` is not whole: {what}")),
                );
                Ok(notices)
            }
            _ => Err(self.refused(unexpected().into())),
        }
    }

    fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.call(Command::ExitInitialization).map(|_| ())
    }

    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs.numbers.clear();
        self.inputs.numbers.extend_from_slice(inputs);
        self.inputs.others.extrapolation = None;
        self.note_new_inputs();
        Ok(())
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.fetch_outputs()?;
        copy(&self.outputs.numbers, outputs)
    }

    fn do_step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        if self.frozen {
            return Ok(());
        }
        self.try_step(clock, tick).or_else(|failure| self.recover(failure, clock, tick))
    }

    fn terminate(&mut self) -> Result<(), CallError> {
        match self.frozen {
            true => Ok(()),
            false => self.call(Command::Terminate).map(|_| ()),
        }
    }

    fn has_messages(&self) -> bool {
        !self.messages.is_empty()
    }

    fn messages(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.messages)
    }

    fn state(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }

    fn extrapolated_inputs(&mut self) -> Option<&mut dyn ExtrapolatedInputs> {
        if self.takes_input_derivatives { Some(self) } else { None }
    }

    fn derivatives(&mut self) -> Option<&mut dyn DirectionalDerivatives> {
        Some(self)
    }

    fn parameters(&mut self) -> Option<&mut dyn TunableParameters> {
        Some(self)
    }

    fn faults(&mut self) -> Option<&mut dyn FaultInjection> {
        Some(self)
    }
}

impl TypedValues for IsolatedNode {
    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.inputs.others.texts.clear();
        self.inputs.others.texts.extend_from_slice(inputs);
        self.note_new_inputs();
        Ok(())
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.fetch_outputs()?;
        copy(&self.outputs.others.texts, outputs)
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        self.inputs.others.integers.clear();
        self.inputs.others.integers.extend_from_slice(inputs);
        self.note_new_inputs();
        Ok(())
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.fetch_outputs()?;
        copy(&self.outputs.others.integers, outputs)
    }
}

impl ExtrapolatedInputs for IsolatedNode {
    fn set_extrapolated_inputs(
        &mut self,
        inputs: &mut [f64],
        polynomials: &[InputPolynomial],
        span: Range<f64>,
    ) -> Result<(), CallError> {
        self.set_inputs(inputs)?;
        let polynomials = polynomials.to_vec();
        self.inputs.others.extrapolation = Some(StepPolynomials { polynomials, span });
        Ok(())
    }
}

impl DirectionalDerivatives for IsolatedNode {
    fn directional_derivatives(
        &mut self,
        changes: &[f64],
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        match self.call(Command::DirectionalDerivatives(changes.to_vec()))? {
            Outcome::Derivatives(None) => Ok(false),
            Outcome::Derivatives(Some(derivatives)) => copy(&derivatives, outputs).map(|()| true),
            _ => Err(unexpected()),
        }
    }
}

impl TunableParameters for IsolatedNode {
    fn tune(&mut self, values: &[StartValue], time: f64) -> Result<(), CallError> {
        match self.frozen {
            true => Ok(()),
            false => self.call(Command::Tune(values.to_vec(), time)).map(|_| ()),
        }
    }
}

impl FaultInjection for IsolatedNode {
    fn inject_fault(&mut self, fault: InjectedFault) -> bool {
        self.injected = Some(fault);
        true
    }
}

impl Stateful for IsolatedNode {
    fn can_save(&mut self) -> bool {
        self.can_save
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        if self.frozen {
            return Ok(NodeState::new(FrozenState(self.outputs.clone())));
        }
        let outcome = self.call(Command::Save)?;
        self.remote_state(&outcome)
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        if let Ok(FrozenState(outputs)) = state.get() {
            (self.frozen, self.outputs) = (true, outputs.clone());
            return Ok(());
        }
        let number = self.number(state)?;
        self.call(Command::Restore(number))?;
        self.frozen = false;
        match self.isolation.on_failure {
            // It may fail before it shows anything.
            OnFailure::Hold => self.fetch_outputs(),
            OnFailure::End | OnFailure::Restart => Ok(()),
        }
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        if let Ok(FrozenState(Values { numbers, others })) = state.get() {
            let OtherValues { integers, texts, .. } = others;
            return Bytes::Frozen(numbers.clone(), integers.clone(), texts.clone()).pack();
        }
        let number = self.number(state)?;
        match self.call(Command::Serialise(number))? {
            Outcome::Bytes(bytes) => Ok(bytes),
            _ => Err(unexpected()),
        }
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        if let Bytes::Frozen(numbers, integers, texts) = Bytes::unpack(bytes)? {
            let others = OtherValues { integers, texts, extrapolation: None };
            return Ok(NodeState::new(FrozenState(Values { numbers, others })));
        }
        let outcome = self.call(Command::Deserialise(bytes.to_owned()))?;
        self.remote_state(&outcome)
    }
}
