//! Generates signals: shapes in windows of time, which add up.

mod rules;
pub mod shape;
mod window;

use std::sync::Arc;

use shape::{ShapeParameters, SignalShape};
pub use window::SignalWindow;

/// A generated signal: the sum of its parts.
#[derive(Debug, Clone, Default)]
pub struct Signal {
    parts: Vec<SignalPart>,
}

/// A shape in a window of time; outside it is 0.
#[derive(Debug, Clone)]
pub struct SignalPart {
    window: SignalWindow,
    shape: Arc<dyn SignalShape>,
}

/// Tolerance of edges [s]: rounding puts a communication point just before an edge that it should meet.
pub const EDGE: f64 = 1e-9;

impl SignalPart {
    /// The shape of these parameters in a window; `seed` fixes what is random.
    ///
    /// # Errors
    /// The message names the parameter that is out of its range.
    pub fn new(parameters: &dyn ShapeParameters, window: SignalWindow, seed: u64) -> Result<Self, String> {
        Ok(SignalPart { shape: parameters.build_shape(&window, seed)?, window })
    }
}

impl Signal {
    /// The sum of these parts.
    #[must_use]
    pub fn new(parts: Vec<SignalPart>) -> Self {
        Signal { parts }
    }

    /// The value at a time [s].
    #[must_use]
    pub fn value_at(&self, time: f64) -> f64 {
        let value = |SignalPart { window, shape }: &SignalPart| match window.window_weight(time) {
            0.0 => 0.0,
            weight => weight * shape.value_at(time - window.from),
        };
        self.parts.iter().map(value).sum()
    }
}
