//! Draws samples of known curves, and judges an optimum without the optimiser's own numbers.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::SVector;
use num_dual::{DualSVec64, gradient};
use numerics::loss::Loss;
use preparation::samples::CurveSamples;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use tire_inference::fit::CurveFitProblem;
use tire_inference::parameters::{COUNT, Theta, magic_formula_from_theta};
use vehicle::MagicFormula;

/// Table II of the paper that names the bounds, without shifts.
pub const TRUTH: Theta = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];
pub const ALL: [bool; COUNT] = [true; COUNT];

/// Evenly spaced slips with normal noise in the force.
pub fn sweep(truth: &Theta, [from, to]: [f64; 2], count: usize, noise: f64, seed: u64) -> CurveSamples {
    let mut random = Pcg64::seed_from_u64(seed);
    let normal = Normal::new(0.0, noise).expect("noise of 0 or more");
    let mut samples = CurveSamples::default();
    for i in 0..count {
        let slip = from + (to - from) * (i as f64 + 0.5) / count as f64;
        samples.push(
            slip,
            magic_formula_from_theta(truth).friction_coefficient(slip) + normal.sample(&mut random),
            1.0,
        );
    }
    samples
}

/// The cost with its gradient by dual numbers, sample by sample, through the curve that the plant drives on.
pub fn cost_and_gradient(problem: &CurveFitProblem, theta: &Theta) -> (f64, Theta) {
    let (mut cost, mut by_theta) = (0.0, [0.0; COUNT]);
    let samples = problem.samples;
    for ((slip, force), weight) in samples.slip.iter().zip(&samples.force).zip(&samples.weight) {
        let value = |t: SVector<DualSVec64<COUNT>, COUNT>| {
            let [B, C, D, E, S_h, S_v] = t.into();
            MagicFormula { B, C, D, E, S_h, S_v }.friction_coefficient(DualSVec64::from(*slip))
        };
        let (value, slope) = gradient(value, &SVector::from(*theta));
        let residual = value - force;
        cost += weight * problem.loss.cost(residual);
        for k in 0..COUNT {
            by_theta[k] += weight * problem.loss.weight(residual) * residual * slope[k];
        }
    }
    for expected in &problem.regularisation {
        for k in (0..COUNT).filter(|&k| problem.free[k]) {
            for l in (0..COUNT).filter(|&l| problem.free[l]) {
                let away = |i: usize| theta[i] - expected.towards.mean[i];
                let part = expected.weight * expected.towards.precision[k][l] * away(l);
                cost += 0.5 * part * away(k);
                by_theta[k] += part;
            }
        }
    }
    (cost, by_theta)
}

/// Largest slope of the cost that bounds do not hold, over the length of the column of derivatives and of the residuals: the
/// cosine that vanishes at an optimum without other constraints.
pub fn slope(problem: &CurveFitProblem, theta: &Theta) -> f64 {
    let (cost, gradient) = cost_and_gradient(problem, theta);
    let pass = tire_inference::kernel::cost_derivatives(problem.samples, theta, &ALL, Loss::Square);
    let size = |k: usize| (pass.hessian[k][k] * 2.0 * cost).sqrt();
    let open = |k: usize| {
        let cosine = gradient[k] / size(k);
        if theta[k] == problem.bounds.lower[k] {
            (-cosine).max(0.0)
        } else if theta[k] == problem.bounds.upper[k] {
            cosine.max(0.0)
        } else {
            cosine.abs()
        }
    };
    (0..COUNT).filter(|&k| problem.free[k]).map(open).fold(0.0, f64::max)
}
