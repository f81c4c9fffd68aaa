//! Jacobi coupling: all nodes step with values from the start of the step, so their order does not matter.

use diagnostics::Error;

use super::CouplingAlgorithm;
use super::initial::InitialLoops;
use crate::exchange::{Exchange, StepInterruption};

/// Steps all nodes from the same values.
#[derive(Debug, Default)]
pub struct JacobiCoupling {
    initial: InitialLoops,
}

impl JacobiCoupling {
    pub(super) fn new(initial: InitialLoops) -> Self {
        JacobiCoupling { initial }
    }
}

impl CouplingAlgorithm for JacobiCoupling {
    fn initialise(&mut self, exchange: &mut Exchange) -> Result<(), Error> {
        self.initial.solve_initial_loops(exchange)
    }

    fn step(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption> {
        let order = exchange.node_order();
        order.iter().try_for_each(|&node| exchange.gather_inputs(node))?;
        exchange.step_nodes_from_gathered_inputs()
    }
}
