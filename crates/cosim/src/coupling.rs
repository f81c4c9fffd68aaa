//! Coupling algorithms: each says how all nodes go from one communication point to the next.

mod energy;
mod gauss_seidel;
mod initial;
mod iterate;
mod jacobi;
mod loop_solver;
mod part_error;
mod solver;
mod step_control;
mod summary;

use diagnostics::Error;

use crate::exchange::{Exchange, StepInterruption};
use crate::system::{Algorithm, System};
pub use gauss_seidel::GaussSeidel;
use iterate::IteratedCoupling;
pub use jacobi::JacobiCoupling;
use step_control::StepControl;
pub use summary::{ConnectionError, CouplingSummary, DivisionSummary, LoopSummary};

/// A coupling algorithm. A new one is a file with this trait and a line in [`create_coupling`]; the end of the step at which
/// its inputs take values by default is a property of [`Algorithm`], since connections are checked before a run.
pub trait CouplingAlgorithm: Send {
    /// Lets the values of the first communication point settle.
    ///
    /// # Errors
    /// With the node, when one fails, shows a value that is no number, or cannot do what the algorithm needs.
    fn initialise(&mut self, exchange: &mut Exchange) -> Result<(), Error> {
        exchange.initialise(&mut |_| Ok(Vec::new()))
    }

    /// Moves all nodes by one communication step or the part of it that the exchange has begun, and the row to its end.
    ///
    /// # Errors
    /// When a node fails or ends the run, a value fits no input, or a loop is not solved.
    fn step(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption>;

    /// What it did so far.
    fn coupling_summary(&self) -> CouplingSummary {
        CouplingSummary::default()
    }

    /// What it remembers from one step to the next, as bytes.
    fn state_to_bytes(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Goes on with what it remembered.
    ///
    /// # Errors
    /// When the bytes are of something else.
    fn restore_from_bytes(&mut self, _memory: &[u8]) -> Result<(), Error> {
        Ok(())
    }
}

fn invalid_state_error(error: postcard::Error) -> Error {
    Error::invalid_input(format!("the memory of the coupling is none: {error}"))
}

/// The coupling of a system.
#[must_use]
pub fn create_coupling(system: &System) -> Box<dyn CouplingAlgorithm> {
    let plan = &system.coupling;
    let initial = initial::InitialLoops::new(system);
    let inner: Box<dyn CouplingAlgorithm> = match plan.algorithm {
        Algorithm::GaussSeidel => Box::new(GaussSeidel::new(initial)),
        Algorithm::Jacobi => Box::new(JacobiCoupling::new(initial)),
        Algorithm::Iterate => Box::new(IteratedCoupling::new(system, initial)),
    };
    match &plan.division {
        None => inner,
        Some(division) => Box::new(StepControl::new(system, division.clone(), inner)),
    }
}

#[cfg(test)]
mod tests;
