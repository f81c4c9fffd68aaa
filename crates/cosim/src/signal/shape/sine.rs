//! Oscillates with one frequency.

use std::f64::consts::TAU;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::rules;
use crate::signal::window::SignalWindow;

/// Shape: one frequency, `sine = { amplitude = 0.05, frequency = 0.5 }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sine {
    /// Largest distance from `offset`.
    #[schemars(example = 0.05, extend("x-unit" = "of the table"))]
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
    #[schemars(example = 0.0, extend("x-unit" = "of the table"))]
    pub offset: f64,
}

impl ShapeParameters for Sine {
    fn build_shape(&self, _: &SignalWindow, _: u64) -> Result<Arc<dyn SignalShape>, String> {
        rules::check_finite(&[
            ("amplitude", self.amplitude),
            ("phase", self.phase),
            ("offset", self.offset),
        ])?;
        rules::check_frequencies(&[("frequency", self.frequency)])?;
        Ok(Arc::new(self.clone()))
    }
}

impl SignalShape for Sine {
    fn value_at(&self, time: f64) -> f64 {
        self.offset + self.amplitude * (TAU * self.frequency * time + self.phase).sin()
    }
}
