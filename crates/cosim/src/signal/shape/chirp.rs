//! Oscillates with a frequency that changes linearly.

use std::f64::consts::TAU;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::rules;
use crate::signal::window::SignalWindow;

/// Shape: a frequency that changes linearly, `chirp = { amplitude = 0.05, f_start = 0.2, f_end = 4.0, duration = 20.0 }`.
/// After `duration` it stays at `f_end`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Chirp {
    /// Largest absolute value.
    #[schemars(example = 0.05, extend("x-unit" = "of the table"))]
    pub amplitude: f64,
    /// Frequency at the beginning of the window [Hz].
    #[schemars(example = 0.2)]
    pub f_start: f64,
    /// Frequency after `duration` [Hz].
    #[schemars(example = 4.0)]
    pub f_end: f64,
    /// Duration of the change of frequency [s].
    #[schemars(example = 20.0)]
    pub duration: f64,
    /// Phase at the beginning of the window [rad].
    #[serde(default)]
    #[schemars(example = 0.0)]
    pub phase: f64,
}

impl ShapeParameters for Chirp {
    fn build_shape(&self, _: &SignalWindow, _: u64) -> Result<Arc<dyn SignalShape>, String> {
        rules::check_finite(&[("amplitude", self.amplitude), ("phase", self.phase)])?;
        rules::check_frequencies(&[("f_start", self.f_start), ("f_end", self.f_end)])?;
        rules::check_positive("duration", self.duration)?;
        Ok(Arc::new(self.clone()))
    }
}

impl SignalShape for Chirp {
    fn value_at(&self, time: f64) -> f64 {
        let rising = time.min(self.duration);
        let turns = self.f_start * rising
            + (self.f_end - self.f_start) * rising * rising / (2.0 * self.duration)
            + self.f_end * (time - rising);
        self.amplitude * (TAU * turns + self.phase).sin()
    }
}
