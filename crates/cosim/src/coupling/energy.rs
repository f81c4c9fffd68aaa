//! Estimates the error of the coupling by the energy that connections lose or add (Sadjina et al. 2017, ECCO).

use crate::exchange::Exchange;
use crate::system::BondPlan;

/// The connections that carry power.
#[derive(Debug, Default)]
pub(super) struct Energy {
    bonds: Vec<BondPlan>,
}

impl Energy {
    pub fn new(bonds: Vec<BondPlan>) -> Self {
        Energy { bonds }
    }

    /// The largest power that a bond adds or loses in the step that was done, relative to its largest power so far [-]. Over a
    /// communication step that is the share of the energy that it could carry. `errors` gets the energies and these shares.
    pub fn error(
        &self,
        exchange: &Exchange,
        (sizes, errors): (&mut [f64], &mut Vec<(f64, f64)>),
    ) -> f64 {
        let (from, to) = exchange.span();
        let mut worst = 0.0_f64;
        errors.clear();
        for (bond, size) in self.bonds.iter().zip(sizes) {
            let (effort, given_effort) = exchange.carried(bond.effort);
            let (flow, given_flow) = exchange.carried(bond.flow);
            let lost = effort * given_flow - given_effort * flow;
            *size = size.max((given_effort * given_flow).abs()).max((effort * flow).abs());
            let relative = if lost == 0.0 { 0.0 } else { lost.abs() / *size };
            worst = worst.max(relative);
            errors.push((lost.abs() * (to - from), relative));
        }
        worst
    }
}
