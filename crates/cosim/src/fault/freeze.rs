//! Keeps a value as it was.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FaultAction, FaultKind};

/// Fault: the input keeps the value that it had when the fault began.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = true)]
pub struct Freeze(pub bool);

impl FaultKind for Freeze {
    fn action(&self) -> Option<Box<dyn FaultAction>> {
        self.0.then(|| Box::new(Frozen(None)) as _)
    }
}

/// The last value before the fault.
#[derive(Debug, Clone, Copy)]
struct Frozen(Option<f64>);

impl FaultAction for Frozen {
    fn observe(&mut self, value: f64) {
        self.0 = Some(value);
    }

    fn apply(&mut self, value: f64) -> f64 {
        *self.0.get_or_insert(value)
    }

    fn memory(&self) -> Option<f64> {
        self.0
    }

    fn recall(&mut self, memory: f64) {
        self.0 = Some(memory);
    }

    fn boxed(&self) -> Box<dyn FaultAction> {
        Box::new(*self)
    }
}
