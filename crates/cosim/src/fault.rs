//! Breaks a number on its way to an input for a while.
//!
//! A new kind of fault is a file with its words and its action, its `mod` line, and a line in `for_each_fault`.

mod bias;
mod call;
mod freeze;
mod gain;
mod value;

use std::fmt::Debug;

pub use bias::BiasFault;
pub use call::{CallFault, CallFaultKind};
pub use freeze::FreezeFault;
pub use gain::GainFault;
pub use value::FixedValueFault;

use crate::quantity::InputUnit;

/// Calls a macro with the key and the words of each kind of fault.
#[macro_export]
macro_rules! for_each_fault {
    ($make:ident) => {
        $make! {
            freeze: $crate::fault::FreezeFault,
            value: $crate::fault::FixedValueFault,
            bias: $crate::fault::BiasFault,
            gain: $crate::fault::GainFault,
        }
    };
}

/// The words of a kind of fault.
pub trait FaultKind {
    /// Its action on an input with this unit; none when the words switch it off.
    ///
    /// # Errors
    /// When a number has a unit of its own that does not fit.
    fn build_action(&self, input: InputUnit) -> Result<Option<Box<dyn FaultAction>>, String>;
}

/// The action of a fault on a value, with its state.
pub trait FaultAction: Debug + Send + Sync {
    /// Observes a value before the fault begins.
    fn observe_before_fault(&mut self, _value: f64) {}

    /// The value that the input gets while the fault lasts.
    fn faulty_value(&mut self, value: f64) -> f64;

    /// What it remembers; none if that is nothing.
    fn saved_state(&self) -> Option<f64> {
        None
    }

    /// Goes on with what an action of its kind remembered.
    fn restore_state(&mut self, _memory: f64) {}

    /// A copy with the same state.
    fn clone_box(&self) -> Box<dyn FaultAction>;
}

impl Clone for Box<dyn FaultAction> {
    fn clone(&self) -> Self {
        self.as_ref().clone_box()
    }
}
