//! Multiplies a value.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FaultAction, FaultKind};
use crate::quantity::InputUnit;

/// Fault: factor on the value [1].
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.5)]
pub struct GainFault(pub f64);

impl FaultKind for GainFault {
    fn build_action(&self, _: InputUnit) -> Result<Option<Box<dyn FaultAction>>, String> {
        Ok(Some(Box::new(*self)))
    }
}

impl FaultAction for GainFault {
    fn faulty_value(&mut self, value: f64) -> f64 {
        value * self.0
    }

    fn clone_box(&self) -> Box<dyn FaultAction> {
        Box::new(*self)
    }
}
