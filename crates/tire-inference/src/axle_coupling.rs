//! Couples the tires of both axles, where it is known that they are alike.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use preparation::samples::CurveSamples;

use crate::estimate::{TireIdentification, fix_parameters};
use crate::fit::{CurveFitProblem, FitError, joint_least_squares};
use crate::regularisation::AxleCoupling;
use crate::settings::{FitMethod, IdentificationSettings};

/// One axle: what was fitted, how, and what was found, of which the values of least squares are replaced.
pub struct AxleFit<'a> {
    /// The points.
    pub samples: &'a CurveSamples,
    /// How they were fitted.
    pub settings: &'a IdentificationSettings,
    /// What was found of the axle alone.
    pub answer: &'a mut TireIdentification,
}

/// Fits both axles at once with ½ `weight` Σ ((θ_front − θ_rear)/std)² added to the cost; std is that of the prior. What was
/// held before is held again. Uncertainty and verdicts stay those of each axle's own data.
///
/// # Errors
/// As for a fit; and for noise in the slip, which a joint fit cannot take.
pub fn fit_coupled_axles(axles: [AxleFit; 2], weight: f64) -> Result<(), FitError> {
    let [front, rear] = axles.each_ref().map(last_fit_problem);
    let IdentificationSettings { prior, options, .. } = axles[0].settings;
    let coupling = AxleCoupling::new(prior, weight);
    let solutions = joint_least_squares([&front, &rear], coupling, options)?;
    for (axle, solution) in axles.into_iter().zip(solutions) {
        let judgements = &axle.answer.judgements;
        let fitted = axle.answer.estimates.iter_mut();
        for (_, estimate) in fitted.filter(|(method, _)| *method == FitMethod::LeastSquares) {
            for quantity in judgements.iter().map(|judgement| judgement.quantity) {
                estimate.mean.insert(quantity, quantity.value(&solution.theta));
            }
            estimate.at_bound.clone_from(&solution.at_bound);
            estimate.noise_std = solution.noise_std;
            estimate.convergence = solution.convergence.clone();
        }
    }
    Ok(())
}

/// What was fitted last: with what was held then.
fn last_fit_problem<'a>(axle: &AxleFit<'a>) -> CurveFitProblem<'a> {
    let mut fits = axle.answer.estimates.iter().filter(|(m, _)| *m == FitMethod::LeastSquares);
    let fixed = fits.next().map_or(&[][..], |(_, fit)| &fit.fixed);
    let noise =
        axle.answer.estimates.first().map(|(_, first)| axle.settings.loss.cost_divisor(first.noise_std));
    let prior = fix_parameters(&axle.settings.prior, fixed);
    axle.settings.fit_problem(axle.samples, &prior, noise)
}

#[cfg(test)]
mod tests {
    use preparation::direction::ForceDirection;

    use super::*;
    use crate::estimate::identify_tire;
    use crate::quantity::Quantity;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    #[test]
    fn the_heavier_the_coupling_the_more_alike_are_the_axles() {
        let tire = |B: f64, seed| {
            let truth = [B, 2.0, 1.5, 0.8, 0.0, 0.0];
            let excitation =
                SyntheticExcitation { truth, seed, samples: 300, ..SyntheticExcitation::default() };
            synthetic_samples(&SyntheticExcitation { slip_std: 0.0, ..excitation }, 0.5)
        };
        let (front, rear) = (tire(14.0, 1), tire(16.0, 2));
        let settings = IdentificationSettings::new(ForceDirection::Longitudinal);
        let found = |samples| identify_tire(samples, &settings, &[FitMethod::LeastSquares]).expect("a fit");
        let alone = (found(&front), found(&rear));
        let apart = |weight: f64| {
            let (mut a, mut b) = alone.clone();
            let axle = |samples, answer| AxleFit { samples, settings: &settings, answer };
            fit_coupled_axles([axle(&front, &mut a), axle(&rear, &mut b)], weight).expect("a fit");
            let B = |answer: &TireIdentification| answer.estimates[0].1.mean[&Quantity::B];
            (B(&b) - B(&a)).abs()
        };
        let distances = [0.0, 1.0, 100.0].map(apart);
        let own = alone.1.estimates[0].1.mean[&Quantity::B] - alone.0.estimates[0].1.mean[&Quantity::B];
        assert!((distances[0] / own.abs() - 1.0).abs() < 1e-6, "{distances:?} {own}");
        assert!(distances[1] < distances[0] && distances[2] < 0.2 * distances[0], "{distances:?}");
    }
}
