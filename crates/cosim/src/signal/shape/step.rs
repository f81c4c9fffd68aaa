//! Jumps from one value to another.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::window::SignalWindow;
use crate::signal::{EDGE, rules};

/// Shape: a jump, `step = { at = 0.5, after = 100.0 }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StepSignal {
    /// Time of the jump after the beginning of the window [s].
    #[schemars(example = 0.5)]
    pub at: f64,
    /// Value before the jump.
    #[serde(default)]
    #[schemars(example = 0.0, extend("x-unit" = "of the table"))]
    pub before: f64,
    /// Value from the jump on.
    #[schemars(example = 100.0, extend("x-unit" = "of the table"))]
    pub after: f64,
}

impl ShapeParameters for StepSignal {
    fn build_shape(&self, _: &SignalWindow, _: u64) -> Result<Arc<dyn SignalShape>, String> {
        rules::check_finite(&[("at", self.at), ("before", self.before), ("after", self.after)])?;
        Ok(Arc::new(self.clone()))
    }
}

impl SignalShape for StepSignal {
    fn value_at(&self, time: f64) -> f64 {
        if time + EDGE >= self.at { self.after } else { self.before }
    }
}
