//! Keeps a value as it was.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FaultAction, FaultKind};
use crate::quantity::InputUnit;

/// Fault: the input keeps the value that it had when the fault began.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = true)]
pub struct FreezeFault(pub bool);

impl FaultKind for FreezeFault {
    fn build_action(&self, _: InputUnit) -> Result<Option<Box<dyn FaultAction>>, String> {
        Ok(self.0.then(|| Box::new(FreezeAction(None)) as _))
    }
}

/// The last value before the fault.
#[derive(Debug, Clone, Copy)]
struct FreezeAction(Option<f64>);

impl FaultAction for FreezeAction {
    fn observe_before_fault(&mut self, value: f64) {
        self.0 = Some(value);
    }

    fn faulty_value(&mut self, value: f64) -> f64 {
        *self.0.get_or_insert(value)
    }

    fn saved_state(&self) -> Option<f64> {
        self.0
    }

    fn restore_state(&mut self, memory: f64) {
        self.0 = Some(memory);
    }

    fn clone_box(&self) -> Box<dyn FaultAction> {
        Box::new(*self)
    }
}
