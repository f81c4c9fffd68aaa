//! Gauss-Seidel coupling: the nodes step one after the other, and each sees the new outputs of those before it.

use super::Coupling;
use crate::exchange::{Exchange, Interruption};

/// Steps the nodes one after the other.
#[derive(Debug, Clone, Copy, Default)]
pub struct GaussSeidel;

impl Coupling for GaussSeidel {
    fn step(&mut self, exchange: &mut Exchange) -> Result<(), Interruption> {
        for &node in exchange.order() {
            exchange.feed(node)?;
            exchange.go(node)?;
        }
        Ok(())
    }
}
