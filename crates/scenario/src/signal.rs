//! Generates input signals from the shapes that a scenario describes.

mod multisine;
mod part;
mod shape;
#[cfg(test)]
mod tests;
mod window;
mod words;

use std::ops::Range;

use shape::Shape;
use window::Window;
pub use words::{Chirp, Multisine, Part, Ramp, Samples, Sine, Square, Step};

/// What is wrong with the description of a signal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SignalError {
    /// What was expected, what was found and what to do.
    pub message: String,
    /// The bytes of the scenario that it is about, when a key that is there is.
    pub span: Option<Range<usize>>,
}

/// A signal that can be asked for its value at any time.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    parts: Vec<(Window, Shape)>,
}

/// Communication points are multiples of a decimal step, which rounding puts just before an edge
/// that they should meet [s].
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
        let value = |(window, shape): &(Window, Shape)| match window.weight(time) {
            0.0 => 0.0,
            weight => weight * shape.value(time - window.from),
        };
        self.parts.iter().map(value).sum()
    }
}
