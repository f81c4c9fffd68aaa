//! Lists the shapes of a signal.
//!
//! A new shape is a file with its words, their check and its value, its `mod` line, and a line in `for_each_shape`.

mod chirp;
mod constant;
mod multisine;
mod ramp;
mod sine;
mod square;
mod step;
mod table;

use std::fmt::Debug;
use std::sync::Arc;

use super::window::SignalWindow;
pub use chirp::Chirp;
pub use constant::ConstantSignal;
pub use multisine::Multisine;
pub use ramp::Ramp;
pub use sine::Sine;
pub use square::Square;
pub use step::StepSignal;
pub use table::SampledSignal;

/// Calls a macro with the key and the parameters of each shape.
#[macro_export]
macro_rules! for_each_shape {
    ($make:ident) => {
        $make! {
            constant: $crate::signal::shape::ConstantSignal,
            step: $crate::signal::shape::StepSignal,
            ramp: $crate::signal::shape::Ramp,
            sine: $crate::signal::shape::Sine,
            multisine: $crate::signal::shape::Multisine,
            chirp: $crate::signal::shape::Chirp,
            square: $crate::signal::shape::Square,
            table: $crate::signal::shape::SampledSignal,
        }
    };
}

/// A checked shape.
pub trait SignalShape: Debug + Send + Sync {
    /// Its value at a time from the beginning of its window on [s].
    fn value_at(&self, time: f64) -> f64;
}

/// The parameters of a shape.
pub trait ShapeParameters {
    /// Checks the parameters and makes the shape; `seed` fixes what is random.
    ///
    /// # Errors
    /// The message names the parameter that is out of its range.
    fn build_shape(&self, window: &SignalWindow, seed: u64) -> Result<Arc<dyn SignalShape>, String>;
}
