//! Estimates the error of the coupling by the energy that connections lose or add (Sadjina et al. 2017, ECCO).

use super::part_error::SubstepError;
use crate::exchange::Exchange;
use crate::system::BondPlan;

/// The connections that carry power.
#[derive(Debug, Default)]
pub(super) struct EnergyErrorEstimator {
    bonds: Vec<BondPlan>,
}

impl EnergyErrorEstimator {
    pub fn new(bonds: Vec<BondPlan>) -> Self {
        EnergyErrorEstimator { bonds }
    }

    /// The largest power that a bond adds or loses in the step that was done, relative to its largest power so far [-]. Over a
    /// communication step that is the share of the energy that it could carry. `errors` gets the energies and these shares.
    pub fn estimate_error(
        &self,
        exchange: &Exchange,
        sizes: &mut [f64],
        errors: &mut Vec<SubstepError>,
    ) -> f64 {
        let span = exchange.step_interval();
        let mut worst = 0.0_f64;
        errors.clear();
        for (bond, size) in self.bonds.iter().zip(sizes) {
            let (effort, flow) =
                (exchange.connection_values(bond.effort), exchange.connection_values(bond.flow));
            let lost = effort.input * flow.source - effort.source * flow.input;
            let powers = [effort.source * flow.source, effort.input * flow.input];
            *size = size.max(powers[0].abs()).max(powers[1].abs());
            let relative = if lost == 0.0 { 0.0 } else { lost.abs() / *size };
            worst = worst.max(relative);
            errors.push(SubstepError { absolute: lost.abs() * (span.end - span.start), relative });
        }
        worst
    }
}
