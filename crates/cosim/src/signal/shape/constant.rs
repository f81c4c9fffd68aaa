//! Holds the same value throughout.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Shape, ShapeParameters};
use crate::signal::rules;
use crate::signal::window::Window;

/// Shape: the same value throughout.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 20.0)]
pub struct Constant(pub f64);

impl ShapeParameters for Constant {
    fn build(&self, _: &Window, _: u64) -> Result<Arc<dyn Shape>, String> {
        rules::finite(&[("constant", self.0)])?;
        Ok(Arc::new(self.clone()))
    }
}

impl Shape for Constant {
    fn value(&self, _: f64) -> f64 {
        self.0
    }
}
