//! Jacobi coupling: all nodes step with values from the start of the step, so their order does not matter.

use diagnostics::Error;

use super::Coupling;
use super::initial::InitialLoops;
use crate::exchange::{Exchange, Interruption};

/// Steps all nodes from the same values.
#[derive(Debug, Default)]
pub struct Jacobi {
    initial: InitialLoops,
}

impl Jacobi {
    pub(super) fn new(initial: InitialLoops) -> Self {
        Jacobi { initial }
    }
}

impl Coupling for Jacobi {
    fn initialise(&mut self, exchange: &mut Exchange) -> Result<(), Error> {
        self.initial.run(exchange)
    }

    fn step(&mut self, exchange: &mut Exchange) -> Result<(), Interruption> {
        let order = exchange.order();
        order.iter().try_for_each(|&node| exchange.gather_inputs(node))?;
        order.iter().try_for_each(|&node| exchange.step_node(node))
    }
}
