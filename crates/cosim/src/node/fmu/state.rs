//! Saves and restores an FMU with what its node keeps for it: values between events, and clocks.

use fmu_import::{CallError, Causality, FmuState};
use serde::{Deserialize, Serialize};

use super::events::FmuEventState;
use super::model_exchange::ModelExchangeMemory;
use super::values::GroupValues;
use super::{FmuNode, set_start_values, starts_by_variable};
use crate::node::refusal::FmuRefusal;
use crate::node::{NodeState, Stateful, TunableParameters, state_error};
use crate::system::StartValue;

/// A state of the FMU and of its node.
pub(super) struct FmuNodeState {
    fmu: FmuState,
    node: FmuNodeValues,
}

/// A state of the node without the FMU.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct FmuNodeValues {
    input_values: GroupValues,
    output_values: GroupValues,
    events: FmuEventState,
    /// Of an FMU for model exchange.
    model_exchange: Option<ModelExchangeMemory>,
}

/// The state of an FMU as bytes, whether or not it is in a process of its own.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::node) enum FmuNodeStateBytes<'a> {
    /// Its own bytes, and the state of its node.
    Running(&'a [u8], &'a [u8]),
    /// It has failed, and its outputs keep these values.
    Frozen(Vec<f64>, Vec<i128>, Vec<String>),
}

impl FmuNodeStateBytes<'_> {
    pub fn serialise(&self) -> Result<Vec<u8>, CallError> {
        postcard::to_stdvec(self).map_err(|error| state_error(&error.to_string()))
    }

    pub fn deserialise(bytes: &[u8]) -> Result<FmuNodeStateBytes<'_>, CallError> {
        postcard::from_bytes(bytes).map_err(|_| state_error("these bytes are no state of an FMU"))
    }
}

impl Stateful for FmuNode {
    fn can_save(&mut self) -> bool {
        self.instance.can_save()
    }

    fn save_state(&mut self) -> Result<NodeState, CallError> {
        let fmu = self.instance.save_state()?;
        let node = FmuNodeValues {
            input_values: self.input_values.clone(),
            output_values: self.output_values.clone(),
            events: self.events.clone(),
            model_exchange: self.model_exchange.as_ref().map(|model| model.memory()),
        };
        Ok(NodeState::new(FmuNodeState { fmu, node }))
    }

    fn save_into(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        let saved: &mut FmuNodeState = state.downcast_mut()?;
        saved.node.input_values.clone_from(&self.input_values);
        saved.node.output_values.clone_from(&self.output_values);
        saved.node.events.clone_from(&self.events);
        saved.node.model_exchange = self.model_exchange.as_ref().map(|model| model.memory());
        self.instance.save_into(&mut saved.fmu)
    }

    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError> {
        let saved: &FmuNodeState = state.downcast_ref()?;
        self.instance.restore_state(&saved.fmu)?;
        let FmuNodeValues { input_values, output_values, events, model_exchange } = saved.node.clone();
        if let (Some(model), Some(memory)) = (&mut self.model_exchange, model_exchange) {
            model.restore(&memory);
        }
        (self.input_values, self.output_values, self.events) = (input_values, output_values, events);
        Ok(())
    }

    fn serialise_state(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        let saved: &FmuNodeState = state.downcast_ref()?;
        let fmu = self.instance.serialise_state(&saved.fmu)?;
        let node = postcard::to_stdvec(&saved.node);
        let node = node.map_err(|error| state_error(&error.to_string()))?;
        FmuNodeStateBytes::Running(&fmu, &node).serialise()
    }

    fn deserialise_state(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        match FmuNodeStateBytes::deserialise(bytes)? {
            FmuNodeStateBytes::Running(fmu, node) => {
                let node = postcard::from_bytes(node).ok().filter(|it| self.is_compatible_with(it));
                let node = node.ok_or_else(|| state_error("these bytes are that of another FMU"))?;
                Ok(NodeState::new(FmuNodeState { fmu: self.instance.deserialise_state(fmu)?, node }))
            }
            FmuNodeStateBytes::Frozen(..) => Err(state_error(
                "is that of an FMU that had failed, whose outputs keep their values: that needs `isolate`",
            )),
        }
    }
}

impl FmuNode {
    /// Whether a memory is that of this FMU: all values have their places.
    fn is_compatible_with(&self, memory: &FmuNodeValues) -> bool {
        let lengths = |values: &GroupValues| {
            let numbers = values.numbers.iter().map(Vec::len);
            let integers = values.integers.iter().map(Vec::len);
            (numbers.collect::<Vec<_>>(), integers.collect::<Vec<_>>(), values.texts.len())
        };
        let counts = |values: &GroupValues| [values.numbers.len(), values.integers.len(), values.texts.len()];
        lengths(&memory.input_values) == lengths(&self.input_values)
            && counts(&memory.output_values) == counts(&self.output_values)
            && self.events.clocks.is_same_clock_set(&memory.events.clocks)
            && match (&self.model_exchange, &memory.model_exchange) {
                (Some(model), Some(memory)) => model.is_compatible_with(memory),
                (model, memory) => model.is_none() && memory.is_none(),
            }
    }
}

impl TunableParameters for FmuNode {
    /// In event mode, if the FMU has that.
    fn tune_parameters(&mut self, values: &[StartValue], time: f64) -> Result<(), CallError> {
        let with_event = self.instance.uses_event_mode();
        if with_event {
            self.instance.enter_event_mode()?;
        }
        for variable in starts_by_variable(values) {
            set_start_values(&mut self.instance, variable).map_err(|refusal| match refusal {
                FmuRefusal::Early(error) | FmuRefusal::Call(error) => error,
                FmuRefusal::Start(start, what) => {
                    CallError::new("the value", format!("of `{}` is refused: {what}", start.name))
                }
            })?;
        }
        let tunable = self.inputs.numbers.iter().chain(&self.inputs.texts).any(|it| it.tunable);
        if tunable || values.iter().any(|value| value.causality == Causality::Input) {
            self.store_start_values()?;
        }
        match with_event {
            true => {
                let update = self.update_discrete_states(time, Vec::new())?;
                self.leave_event_mode(update)
            }
            false => Ok(()),
        }
    }
}
