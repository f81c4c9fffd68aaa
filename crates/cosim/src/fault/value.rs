//! Replaces a value.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FaultAction, FaultKind};
use crate::quantity::{InputUnit, Quantity};

/// Fault: the input gets this value, in its unit, or `nan`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.0)]
pub struct FixedValueFault(pub Quantity);

impl FaultKind for FixedValueFault {
    fn build_action(&self, input: InputUnit) -> Result<Option<Box<dyn FaultAction>>, String> {
        Ok(Some(Box::new(FixedValueAction { value: self.0.value_at(input)? })))
    }
}

#[derive(Debug, Clone, Copy)]
struct FixedValueAction {
    value: f64,
}

impl FaultAction for FixedValueAction {
    fn faulty_value(&mut self, _: f64) -> f64 {
        self.value
    }

    fn clone_box(&self) -> Box<dyn FaultAction> {
        Box::new(*self)
    }
}
