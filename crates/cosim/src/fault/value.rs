//! Replaces a value.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FaultAction, FaultKind};

/// Fault: the input gets this value, in its unit, or `nan`.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.0)]
pub struct FixedValueFault(pub f64);

impl FaultKind for FixedValueFault {
    fn build_action(&self) -> Option<Box<dyn FaultAction>> {
        Some(Box::new(*self))
    }
}

impl FaultAction for FixedValueFault {
    fn faulty_value(&mut self, _: f64) -> f64 {
        self.0
    }

    fn clone_box(&self) -> Box<dyn FaultAction> {
        Box::new(*self)
    }
}
