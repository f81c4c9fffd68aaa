//! Breaks a number on its way to an input for a while.
//!
//! A new kind of fault is a file with its words and its action, its `mod` line, and a line in `for_each_fault`.

mod bias;
mod call;
mod freeze;
mod gain;
mod value;

use std::fmt::Debug;

pub use bias::Bias;
pub use call::{CallFault, CallFaultKind};
pub use freeze::Freeze;
pub use gain::Gain;
pub use value::Value;

/// Calls a macro with the key and the words of each kind of fault.
#[macro_export]
macro_rules! for_each_fault {
    ($make:ident) => {
        $make! {
            freeze: $crate::fault::Freeze,
            value: $crate::fault::Value,
            bias: $crate::fault::Bias,
            gain: $crate::fault::Gain,
        }
    };
}

/// The words of a kind of fault.
pub trait FaultKind {
    /// Its action; none when the words switch it off.
    fn action(&self) -> Option<Box<dyn FaultAction>>;
}

/// The action of a fault on a value, with its state.
pub trait FaultAction: Debug + Send + Sync {
    /// Observes a value before the fault begins.
    fn observe(&mut self, _value: f64) {}

    /// The value that the input gets while the fault lasts.
    fn apply(&mut self, value: f64) -> f64;

    /// What it remembers; none if that is nothing.
    fn memory(&self) -> Option<f64> {
        None
    }

    /// Goes on with what an action of its kind remembered.
    fn recall(&mut self, _memory: f64) {}

    /// A copy with the same state.
    fn boxed(&self) -> Box<dyn FaultAction>;
}

impl Clone for Box<dyn FaultAction> {
    fn clone(&self) -> Self {
        self.as_ref().boxed()
    }
}
