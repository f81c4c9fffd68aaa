//! Oscillates with one frequency.

use std::f64::consts::TAU;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Shape, ShapeParameters};
use crate::signal::rules;
use crate::signal::window::Window;

/// Shape: one frequency, `sine = { amplitude = 0.05, frequency = 0.5 }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sine {
    /// Largest distance from `offset`.
    #[schemars(example = 0.05)]
    pub amplitude: f64,
    /// Frequency [Hz].
    #[schemars(example = 0.5)]
    pub frequency: f64,
    /// Phase at the beginning of the window [rad].
    #[serde(default)]
    #[schemars(example = 1.57)]
    pub phase: f64,
    /// Mean value.
    #[serde(default)]
    #[schemars(example = 0.0)]
    pub offset: f64,
}

impl ShapeParameters for Sine {
    fn build(&self, _: &Window, _: u64) -> Result<Arc<dyn Shape>, String> {
        rules::finite(&[
            ("amplitude", self.amplitude),
            ("phase", self.phase),
            ("offset", self.offset),
        ])?;
        rules::frequencies(&[("frequency", self.frequency)])?;
        Ok(Arc::new(self.clone()))
    }
}

impl Shape for Sine {
    fn value(&self, time: f64) -> f64 {
        self.offset + self.amplitude * (TAU * self.frequency * time + self.phase).sin()
    }
}
