//! Widens what was found of the curves by what is not known of the car: each datum moves the fit, and adds the square of its move.
//!
//! First order: θ moves by ∂θ/∂p σ_p, a central difference of two whole preparations and fits with the car at ± one standard
//! deviation. The data of the car are independent of each other and of the noise.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use drive_inference::CarUncertainty;
use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use numerics::statistics::NORMAL_95;
use numerics::text::format_significant;
use preparation::{BrakeShare, Car, ShareRule};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use tire_inference::estimate::{TireEstimate, TireIdentification};
use tire_inference::parameters::{Parameter, Theta};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;

/// The uncertain data of a car, each with the car at minus and plus one standard deviation of it.
pub fn perturbed_cars(car: &Car, uncertainty: &CarUncertainty) -> Vec<(&'static str, [Car; 2])> {
    let CarUncertainty { m, cg, I_zz, h, .. } = *uncertainty;
    let moved = |by: f64, change: fn(&mut Car, f64)| {
        [-by, by].map(|by| {
            let mut car = *car;
            change(&mut car, by);
            car
        })
    };
    let body = &car.body;
    [
        ("m", m, moved(m * body.m, |car, by| car.body.m += by)),
        (
            "centre of gravity",
            cg,
            moved(cg, |car, by| {
                car.body.l_f += by;
                car.body.l_r -= by;
            }),
        ),
        ("I_zz", I_zz, moved(I_zz * body.I_zz, |car, by| car.body.I_zz += by)),
        // There is no height below 0.
        ("h", h, moved(h, |car, by| car.body.h = (car.body.h + by).max(0.0))),
    ]
    .into_iter()
    .filter(|(_, std, _)| *std > 0.0)
    .map(|(name, _, cars)| (name, cars))
    .collect()
}

/// Standard deviation of the front axle's share of the braking force [-] where nobody knows it: brakes of cars are from 0.55 to 0.75.
const USUAL_SHARE_STD: f64 = 0.05;

/// The car with other shares of the braking force, where a rule stands for the share: those at the loads at rest, at minus and plus one
/// standard deviation. It moves longitudinal forces only.
pub fn cars_with_other_brake_share(car: &Car) -> Option<(&'static str, [Car; 2])> {
    let BrakeShare::Rule(ShareRule::ByLoad) = car.brake_front_share else { return None };
    let [front, rear] = car.body.static_loads();
    let share = front / (front + rear);
    let moved = [-USUAL_SHARE_STD, USUAL_SHARE_STD].map(|by| {
        let brake_front_share = BrakeShare::Fixed((share + by).clamp(0.0, 1.0));
        Car { brake_front_share, ..*car }
    });
    Some(("share of the brakes", moved))
}

/// Moves of the parameters of one curve, each by one standard deviation of a datum of the car.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PropagatedUncertainty {
    moves: Vec<(&'static str, [Theta; 2])>,
}

impl PropagatedUncertainty {
    /// Adds the fits with a datum at minus and plus one standard deviation.
    pub fn add_refits(&mut self, name: &'static str, ends: [Theta; 2]) {
        self.moves.push((name, ends));
    }

    /// Standard deviation of a quantity that comes from the car, and the datum that adds most to it.
    fn propagated_std(&self, quantity: Quantity) -> Option<(f64, &'static str)> {
        let half = |[low, high]: &[Theta; 2]| 0.5 * (quantity.value(high) - quantity.value(low));
        let parts = || self.moves.iter().map(|(name, ends)| (half(ends).abs(), *name));
        let most = parts().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let std = parts().map(|(part, _)| part * part).sum::<f64>().sqrt();
        (std > 0.0 && std.is_finite()).then_some((std, most.1))
    }

    /// Widens all that is reported of a curve, its draws too.
    pub fn widen_answer(&self, answer: &mut TireIdentification, prior: &Prior, seed: u64) {
        if self.moves.is_empty() {
            return;
        }
        let widths: Vec<_> = answer.judgements.iter().map(|it| (it.quantity, it.width_ratio)).collect();
        for (_, estimate) in &mut answer.estimates {
            for &(quantity, width) in &widths {
                self.widen_quantity(estimate, quantity, width, prior);
            }
            self.widen_covariance(estimate);
        }
        self.widen_draws(&mut answer.posterior, prior, seed);
        for draws in answer.variational.iter_mut().flat_map(|it| [&mut it.gaussian, &mut it.corrected]) {
            self.widen_draws(draws, prior, seed);
        }
        let reports = answer.estimates.iter_mut().filter_map(|(_, it)| it.posterior.as_mut());
        for band in reports.chain([&mut answer.report]).filter_map(|report| report.band.as_mut()) {
            (band.lower, band.upper) =
                answer.posterior.curve_band(&band.slip).into_iter().map(|[a, b]| (a, b)).unzip();
        }
    }

    fn widen_draws(&self, draws: &mut PosteriorSamples, prior: &Prior, seed: u64) {
        let mut random = Pcg64::new(u128::from(seed), 1);
        for theta in &mut draws.samples {
            for (_, [low, high]) in &self.moves {
                let step: f64 = StandardNormal.sample(&mut random);
                for (i, value) in theta.iter_mut().enumerate() {
                    *value += 0.5 * step * (high[i] - low[i]);
                }
            }
            // What is held may lie outside of the box.
            for parameter in prior.free_parameters() {
                let value = &mut theta[parameter as usize];
                *value = prior.bounds.clamp(parameter, *value);
            }
        }
    }

    fn widen_quantity(&self, estimate: &mut TireEstimate, quantity: Quantity, width: f64, prior: &Prior) {
        let (Some((by, most)), Some(&mean)) = (self.propagated_std(quantity), estimate.mean.get(&quantity))
        else {
            return;
        };
        let before = estimate.std.get(&quantity).copied().unwrap_or(0.0);
        let std = before.hypot(by);
        estimate.std.insert(quantity, std);
        if let Some([low, high]) = estimate.interval.get_mut(&quantity) {
            let wider = |distance: f64| distance.max(0.0).hypot(NORMAL_95 * by);
            let [least, most] = quantity.range_in_prior(prior);
            *low = (mean - wider(mean - *low)).clamp(least.min(mean), mean);
            *high = (mean + wider(*high - mean)).clamp(mean, most.max(mean));
        }
        let Some(reason) = estimate.reason.get_mut(&quantity) else { return };
        let by = format_significant(by, 2);
        *reason += &format!(" The car adds ± {by}, most of it by {most}.");
        let identified = estimate.identified.get_mut(&quantity);
        let verdict = identified.filter(|verdict| **verdict == Identifiability::Identified);
        if let Some(verdict) = verdict.filter(|_| before > 0.0 && width * std / before > MAX_WIDTH_IDENTIFIED)
        {
            *verdict = Identifiability::Weak;
            *reason += " Too much to call it identified.";
        }
    }

    fn widen_covariance(&self, estimate: &mut TireEstimate) {
        let step = |ends: &[Theta; 2], parameter: Parameter| {
            0.5 * (ends[1][parameter as usize] - ends[0][parameter as usize])
        };
        for (row, a) in estimate.covariance.iter_mut().zip(&estimate.parameters) {
            for (entry, b) in row.iter_mut().zip(&estimate.parameters) {
                *entry += self.moves.iter().map(|(_, ends)| step(ends, *a) * step(ends, *b)).sum::<f64>();
            }
        }
    }
}

#[cfg(test)]
mod tests;
