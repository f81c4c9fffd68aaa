//! Lets everything with a status over time report it in one way: checks and faults take rows, then say what changed.

use recording::{Full, Sink, StatusChange};

/// A sink of full rows with a status over time.
pub trait StatusSource: Sink<Full> {
    /// The changes of status since the last call, in the order of their time.
    fn changes(&mut self) -> Vec<StatusChange>;
}
