//! Adds to a value.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FaultAction, FaultKind};

/// Fault: added to the value, in the input's unit.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.1)]
pub struct BiasFault(pub f64);

impl FaultKind for BiasFault {
    fn build_action(&self) -> Option<Box<dyn FaultAction>> {
        Some(Box::new(*self))
    }
}

impl FaultAction for BiasFault {
    fn faulty_value(&mut self, value: f64) -> f64 {
        value + self.0
    }

    fn clone_box(&self) -> Box<dyn FaultAction> {
        Box::new(*self)
    }
}
