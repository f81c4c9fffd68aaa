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

pub use chirp::Chirp;
pub use constant::Constant;
pub use multisine::Multisine;
pub use ramp::Ramp;
pub use sine::Sine;
pub use square::Square;
pub use step::Step;
pub use table::Samples;

use super::Checked;
use super::rules::Rules;
use super::window::Window;

/// Calls a macro with the key and the words of each shape.
macro_rules! for_each_shape {
    ($make:ident) => {
        $make! {
            constant: Constant,
            step: Step,
            ramp: Ramp,
            sine: Sine,
            multisine: Multisine,
            chirp: Chirp,
            square: Square,
            table: Samples,
        }
    };
}
pub(super) use for_each_shape;

/// A checked shape.
pub(super) trait Shape: Debug + Send + Sync {
    /// Its value at a time from the beginning of its window on [s].
    fn value(&self, time: f64) -> f64;
}

/// The words of a shape.
pub(super) trait ShapeWords {
    /// Checks the words; `seed` fixes what is random.
    fn check(&self, rules: &Rules, window: &Window, seed: u64) -> Checked<Arc<dyn Shape>>;
}
