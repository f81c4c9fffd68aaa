//! Alternates between two levels.

use std::f64::consts::TAU;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::window::SignalWindow;
use crate::signal::{EDGE, rules};

/// Shape: two levels in turn, `square = { amplitude = 100.0, period = 4.0 }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Square {
    /// Distance of both levels from `offset`.
    #[schemars(example = 100.0, extend("x-unit" = "of the table"))]
    pub amplitude: f64,
    /// Period [s]. Its first half has the upper level.
    #[schemars(example = 4.0)]
    pub period: f64,
    /// Phase at the beginning of the window [rad].
    #[serde(default)]
    #[schemars(example = 0.0)]
    pub phase: f64,
    /// Rounds the edges [1]: `amplitude * tanh(sharpness * sin(...))`. Without it the edges are jumps.
    #[schemars(example = 20.0)]
    pub sharpness: Option<f64>,
    /// Mean value.
    #[serde(default)]
    #[schemars(example = 0.0, extend("x-unit" = "of the table"))]
    pub offset: f64,
}

impl ShapeParameters for Square {
    fn build_shape(&self, _: &SignalWindow, _: u64) -> Result<Arc<dyn SignalShape>, String> {
        rules::check_finite(&[
            ("amplitude", self.amplitude),
            ("phase", self.phase),
            ("offset", self.offset),
        ])?;
        rules::check_positive("period", self.period)?;
        if let Some(sharpness) = self.sharpness {
            rules::check_positive("sharpness", sharpness)?;
        }
        Ok(Arc::new(self.clone()))
    }
}

impl SignalShape for Square {
    fn value_at(&self, time: f64) -> f64 {
        let level = match self.sharpness {
            Some(sharpness) => (sharpness * (TAU * time / self.period + self.phase).sin()).tanh(),
            None => {
                let turn = (time + EDGE) / self.period + self.phase / TAU;
                if turn.rem_euclid(1.0) < 0.5 { 1.0 } else { -1.0 }
            }
        };
        self.offset + self.amplitude * level
    }
}
