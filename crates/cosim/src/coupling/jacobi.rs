//! Jacobi coupling: all nodes step with values from the start of the step, so their order does not matter.

use super::Coupling;
use crate::exchange::{Exchange, Interruption};

/// Steps all nodes from the same values.
#[derive(Debug, Clone, Copy, Default)]
pub struct Jacobi;

impl Coupling for Jacobi {
    fn step(&mut self, exchange: &mut Exchange) -> Result<(), Interruption> {
        let order = exchange.order();
        order.iter().try_for_each(|&node| exchange.feed(node))?;
        order.iter().try_for_each(|&node| exchange.go(node))
    }
}
