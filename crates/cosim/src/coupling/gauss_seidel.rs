//! Gauss-Seidel coupling: the nodes step one after the other, and each sees the new outputs of those before it.

use diagnostics::Error;

use super::CouplingAlgorithm;
use super::initial::InitialLoops;
use crate::exchange::{Exchange, StepInterruption};

/// Steps the nodes one after the other.
#[derive(Debug, Default)]
pub struct GaussSeidel {
    initial: InitialLoops,
}

impl GaussSeidel {
    pub(super) fn new(initial: InitialLoops) -> Self {
        GaussSeidel { initial }
    }
}

impl CouplingAlgorithm for GaussSeidel {
    fn initialise(&mut self, exchange: &mut Exchange) -> Result<(), Error> {
        self.initial.solve_initial_loops(exchange)
    }

    fn step(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption> {
        exchange.step_nodes_in_order()
    }
}
