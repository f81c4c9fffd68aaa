//! Holds the same value throughout.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Shape, ShapeWords};
use crate::signal::Checked;
use crate::signal::rules::Rules;
use crate::signal::window::Window;

/// Shape: the same value throughout.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 20.0)]
pub struct Constant(pub f64);

impl ShapeWords for Constant {
    fn check(&self, rules: &Rules, _: &Window, _: u64) -> Checked<Arc<dyn Shape>> {
        rules.finite(&[("constant", self.0)])?;
        Ok(Arc::new(self.clone()))
    }
}

impl Shape for Constant {
    fn value(&self, _: f64) -> f64 {
        self.0
    }
}
