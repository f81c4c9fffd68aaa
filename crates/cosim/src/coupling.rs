//! Coupling algorithms: each says how all nodes go from one communication point to the next.

mod gauss_seidel;
mod jacobi;

use scenario::words::Algorithm;

use crate::exchange::{Exchange, Interruption};

pub use gauss_seidel::GaussSeidel;
pub use jacobi::Jacobi;

/// A coupling algorithm. A new one is a file with this trait and a line in [`of`]; the end of the step at which
/// its inputs take values by default is a property of [`Algorithm`], since connections are checked before a run.
pub trait Coupling: Send {
    /// Passes over all nodes in the initialisation. On the first pass each node sees those before it in the
    /// order, on the second one the values that a broken loop hands back.
    fn initialisation_passes(&self) -> usize {
        2
    }

    /// What it remembers from one step to the next, as bytes of its own.
    fn memory(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Goes on with what the same algorithm remembered; whether these bytes are such a memory.
    fn recall(&mut self, memory: &[u8]) -> bool {
        memory.is_empty()
    }

    /// Moves all nodes by one communication step, and the row of the exchange to its end.
    ///
    /// # Errors
    /// When a node fails or ends the run, or a value fits no input.
    fn step(&mut self, exchange: &mut Exchange) -> Result<(), Interruption>;
}

/// The algorithm of this name.
#[must_use]
pub fn of(algorithm: Algorithm) -> Box<dyn Coupling> {
    match algorithm {
        Algorithm::GaussSeidel => Box::new(GaussSeidel),
        Algorithm::Jacobi => Box::new(Jacobi),
    }
}
