//! Makes the process of an FMU a node like others.

use std::ops::Range;
use std::time::Duration;

use diagnostics::Error;
use fmu_import::{CallError, FmuMessage};

use super::protocol::{GuestCommand, GuestCommandOutcome, NonNumericValues, StepPolynomials};
use super::{IsolatedNode, NodeValues, call_error, invalid_response_error};
use crate::clock::CommunicationClock;
use crate::node::fmu::FmuNodeStateBytes;
use crate::node::{
    ConcurrentStep, DirectionalDerivatives, ExtrapolatedInputs, FaultInjection, InjectedFault,
    InputPolynomial, Node, NodeState, Stateful, TunableParameters, TypedValues,
};
use crate::system::{FmuFailurePolicy, StartValue};

/// The outputs of an FMU that has failed.
struct FrozenOutputs(NodeValues);

impl IsolatedNode {
    /// Asks for the outputs, unless they are there.
    fn fetch_outputs(&mut self) -> Result<(), CallError> {
        match self.has_outputs || self.frozen {
            true => Ok(()),
            false => self.call_guest(GuestCommand::GetOutputs).map(|_| ()),
        }
    }

    /// There are inputs that the process does not know.
    fn mark_inputs_as_new(&mut self) {
        (self.has_new_inputs, self.has_outputs) = (true, false);
    }
}

/// Copies outputs of which there are as many as expected.
fn copy_same_length<T: Clone>(from: &[T], to: &mut [T]) -> Result<(), CallError> {
    if from.len() != to.len() {
        return Err(invalid_response_error());
    }
    to.clone_from_slice(from);
    Ok(())
}

impl Node for IsolatedNode {
    fn enter_initialization(&mut self) -> Result<Vec<String>, Error> {
        let entered = self.send_command(GuestCommand::EnterInitialization);
        match entered.map_err(|refusal| self.refusal_error(refusal))? {
            GuestCommandOutcome::Initialized(mut notices) => {
                let name = &self.setup.name;
                let lacks = self.lacks.drain(..);
                notices.extend(lacks.map(|what| format!("the sandbox of `{name}` is not whole: {what}")));
                Ok(notices)
            }
            _ => Err(self.refusal_error(invalid_response_error().into())),
        }
    }

    fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.call_guest(GuestCommand::ExitInitialization).map(|_| ())
    }

    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs.numbers.clear();
        self.inputs.numbers.extend_from_slice(inputs);
        self.inputs.others.extrapolation = None;
        self.mark_inputs_as_new();
        Ok(())
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.fetch_outputs()?;
        copy_same_length(&self.outputs.numbers, outputs)
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.begin_step(clock, tick);
        self.finish_step(clock, tick).map(drop)
    }

    fn terminate(&mut self) -> Result<(), CallError> {
        match self.frozen {
            true => Ok(()),
            false => self.call_guest(GuestCommand::Terminate).map(|_| ()),
        }
    }

    fn has_messages(&self) -> bool {
        !self.messages.is_empty()
    }

    fn take_messages(&mut self) -> Vec<FmuMessage> {
        std::mem::take(&mut self.messages)
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }

    fn extrapolated_inputs(&mut self) -> Option<&mut dyn ExtrapolatedInputs> {
        if self.takes_input_derivatives { Some(self) } else { None }
    }

    fn as_concurrent_step(&mut self) -> Option<&mut dyn ConcurrentStep> {
        Some(self)
    }

    fn as_directional_derivatives(&mut self) -> Option<&mut dyn DirectionalDerivatives> {
        Some(self)
    }

    fn as_tunable_parameters(&mut self) -> Option<&mut dyn TunableParameters> {
        Some(self)
    }

    fn as_fault_injection(&mut self) -> Option<&mut dyn FaultInjection> {
        Some(self)
    }
}

impl ConcurrentStep for IsolatedNode {
    fn begin_step(&mut self, clock: &CommunicationClock, tick: u64) {
        if !self.frozen {
            self.begun_step = Some(self.request_step(clock, tick));
        }
    }

    fn finish_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<Duration, CallError> {
        let Some(request) = self.begun_step.take() else { return Ok(Duration::ZERO) };
        let response = request.and_then(|()| self.receive_response().map(drop).map_err(call_error));
        match response {
            Ok(()) => Ok(self.response_duration),
            Err(failure) => {
                self.recover_from_failure(failure, clock, tick).map(|()| self.request_begin.elapsed())
            }
        }
    }
}

impl TypedValues for IsolatedNode {
    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.inputs.others.texts.clear();
        self.inputs.others.texts.extend_from_slice(inputs);
        self.mark_inputs_as_new();
        Ok(())
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.fetch_outputs()?;
        copy_same_length(&self.outputs.others.texts, outputs)
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        self.inputs.others.integers.clear();
        self.inputs.others.integers.extend_from_slice(inputs);
        self.mark_inputs_as_new();
        Ok(())
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.fetch_outputs()?;
        copy_same_length(&self.outputs.others.integers, outputs)
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
    fn directional_derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError> {
        match self.call_guest(GuestCommand::DirectionalDerivatives(changes.to_vec()))? {
            GuestCommandOutcome::Derivatives(None) => Ok(false),
            GuestCommandOutcome::Derivatives(Some(derivatives)) => {
                copy_same_length(&derivatives, outputs).map(|()| true)
            }
            _ => Err(invalid_response_error()),
        }
    }
}

impl TunableParameters for IsolatedNode {
    fn tune_parameters(&mut self, values: &[StartValue], time: f64) -> Result<(), CallError> {
        match self.frozen {
            true => Ok(()),
            false => self.call_guest(GuestCommand::Tune(values.to_vec(), time)).map(|_| ()),
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

    fn save_state(&mut self) -> Result<NodeState, CallError> {
        if self.frozen {
            return Ok(NodeState::new(FrozenOutputs(self.outputs.clone())));
        }
        let outcome = self.call_guest(GuestCommand::Save)?;
        self.remote_state(&outcome)
    }

    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError> {
        if let Ok(FrozenOutputs(outputs)) = state.downcast_ref() {
            (self.frozen, self.outputs) = (true, outputs.clone());
            return Ok(());
        }
        let number = self.remote_state_number(state)?;
        self.call_guest(GuestCommand::Restore(number))?;
        self.frozen = false;
        match self.isolation.on_failure {
            // It may fail before it shows anything.
            FmuFailurePolicy::Hold => self.fetch_outputs(),
            FmuFailurePolicy::End | FmuFailurePolicy::Restart => Ok(()),
        }
    }

    fn serialise_state(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        if let Ok(FrozenOutputs(NodeValues { numbers, others })) = state.downcast_ref() {
            let NonNumericValues { integers, texts, .. } = others;
            return FmuNodeStateBytes::Frozen(numbers.clone(), integers.clone(), texts.clone()).serialise();
        }
        let number = self.remote_state_number(state)?;
        match self.call_guest(GuestCommand::Serialise(number))? {
            GuestCommandOutcome::Bytes(bytes) => Ok(bytes),
            _ => Err(invalid_response_error()),
        }
    }

    fn deserialise_state(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        if let FmuNodeStateBytes::Frozen(numbers, integers, texts) = FmuNodeStateBytes::deserialise(bytes)? {
            let others = NonNumericValues { integers, texts, extrapolation: None };
            return Ok(NodeState::new(FrozenOutputs(NodeValues { numbers, others })));
        }
        let outcome = self.call_guest(GuestCommand::Deserialise(bytes.to_owned()))?;
        self.remote_state(&outcome)
    }
}
