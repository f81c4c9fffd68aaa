//! Adds to a value.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FaultAction, FaultKind};
use crate::quantity::{InputUnit, Quantity};

/// Fault: added to the value, in the input's unit.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.1)]
pub struct BiasFault(pub Quantity);

impl FaultKind for BiasFault {
    fn build_action(&self, input: InputUnit) -> Result<Option<Box<dyn FaultAction>>, String> {
        Ok(Some(Box::new(BiasAction { summand: self.0.difference_at(input)? })))
    }
}

#[derive(Debug, Clone, Copy)]
struct BiasAction {
    summand: f64,
}

impl FaultAction for BiasAction {
    fn faulty_value(&mut self, value: f64) -> f64 {
        value + self.summand
    }

    fn clone_box(&self) -> Box<dyn FaultAction> {
        Box::new(*self)
    }
}
