//! Jumps from one value to another.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Shape, ShapeWords};
use crate::signal::rules::Rules;
use crate::signal::window::Window;
use crate::signal::{Checked, EDGE};

/// Shape: a jump, `step = { at = 0.5, after = 100.0 }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Time of the jump after the beginning of the window [s].
    #[schemars(example = 0.5)]
    pub at: f64,
    /// Value before the jump.
    #[serde(default)]
    #[schemars(example = 0.0)]
    pub before: f64,
    /// Value from the jump on.
    #[schemars(example = 100.0)]
    pub after: f64,
}

impl ShapeWords for Step {
    fn check(&self, rules: &Rules, _: &Window, _: u64) -> Checked<Arc<dyn Shape>> {
        rules.finite(&[("at", self.at), ("before", self.before), ("after", self.after)])?;
        Ok(Arc::new(self.clone()))
    }
}

impl Shape for Step {
    fn value(&self, time: f64) -> f64 {
        if time + EDGE >= self.at { self.after } else { self.before }
    }
}
