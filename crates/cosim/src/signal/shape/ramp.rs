//! Leads from one value to another on a straight line.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::rules;
use crate::signal::window::SignalWindow;

/// Shape: a straight line between two values, `ramp = { start = 1.0, end = 3.0, after = 0.1 }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ramp {
    /// Beginning of the line, after the beginning of the window [s].
    #[schemars(example = 1.0)]
    pub start: f64,
    /// End of the line, after the beginning of the window [s].
    #[schemars(example = 3.0)]
    pub end: f64,
    /// Value until `start`.
    #[serde(default)]
    #[schemars(example = 0.0, extend("x-unit" = "of the table"))]
    pub before: f64,
    /// Value from `end` on.
    #[schemars(example = 0.1, extend("x-unit" = "of the table"))]
    pub after: f64,
}

impl ShapeParameters for Ramp {
    fn build_shape(&self, _: &SignalWindow, _: u64) -> Result<Arc<dyn SignalShape>, String> {
        rules::check_finite(&[
            ("start", self.start),
            ("end", self.end),
            ("before", self.before),
            ("after", self.after),
        ])?;
        if self.end <= self.start {
            let (start, end) = (self.start, self.end);
            return Err(format!("expected `end` after `start` at {start} s, found {end} s; a `step` jumps"));
        }
        Ok(Arc::new(self.clone()))
    }
}

impl SignalShape for Ramp {
    fn value_at(&self, time: f64) -> f64 {
        let share = (time - self.start) / (self.end - self.start);
        self.before + share.clamp(0.0, 1.0) * (self.after - self.before)
    }
}
