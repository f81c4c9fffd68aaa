//! Holds the same value throughout.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::rules;
use crate::signal::window::SignalWindow;

/// Shape: the same value throughout.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 20.0, extend("x-unit" = "of the table"))]
pub struct ConstantSignal(pub f64);

impl ShapeParameters for ConstantSignal {
    fn build_shape(&self, _: &SignalWindow, _: u64) -> Result<Arc<dyn SignalShape>, String> {
        rules::check_finite(&[("constant", self.0)])?;
        Ok(Arc::new(self.clone()))
    }
}

impl SignalShape for ConstantSignal {
    fn value_at(&self, _: f64) -> f64 {
        self.0
    }
}
