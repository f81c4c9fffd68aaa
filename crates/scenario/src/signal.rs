//! Generates input signals from the shapes in a scenario.

mod part;
mod rules;
pub mod shape;
#[cfg(test)]
mod tests;
mod window;

use std::ops::Range;
use std::sync::Arc;

pub use part::Part;
use shape::Shape;
use window::Window;

/// A mistake in the description of a signal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SignalError {
    /// The expected and the found value, and a remedy.
    pub message: String,
    /// Bytes of the scenario with the wrong value; none when a key is missing.
    pub span: Option<Range<usize>>,
}

/// A checked signal, which has a value at any time.
#[derive(Debug, Clone)]
pub struct Signal {
    parts: Vec<(Window, Arc<dyn Shape>)>,
}

/// Tolerance of edges [s]: rounding puts a communication point just before an edge that it should meet.
const EDGE: f64 = 1e-9;

type Checked<T> = Result<T, SignalError>;

fn error<T>(span: Option<Range<usize>>, message: impl Into<String>) -> Checked<T> {
    let message = message.into();
    Err(SignalError { message, span })
}

impl Signal {
    /// The value at a time of the scenario [s].
    #[must_use]
    pub fn value(&self, time: f64) -> f64 {
        let value = |(window, shape): &(Window, Arc<dyn Shape>)| match window.weight(time) {
            0.0 => 0.0,
            weight => weight * shape.value(time - window.from),
        };
        self.parts.iter().map(value).sum()
    }
}
