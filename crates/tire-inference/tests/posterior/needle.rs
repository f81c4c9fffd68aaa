//! Data with hardly any noise: the posterior is far narrower than any cell of the grid, and normal.

use nalgebra::SMatrix;
use numerics::statistics::{mean, std};
use preparation::samples::CurveSamples;
use tire_inference::compressed::CompressedSamples;
use tire_inference::fit::{CurveFitProblem, FitOptions, least_squares};
use tire_inference::parameters::Theta;
use tire_inference::posterior;
use tire_inference::posterior::report::{SamplingMethod, SamplingStatus};
use tire_inference::prior::Prior;
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

const TRUTH: Theta = [15.0, 2.0, 1.5, 0.8, 0.002, 0.01];
const NOISE: f64 = 1e-5;

/// Slips on both sides, so that the shifts are known.
fn both_sides() -> CurveSamples {
    let excitation = SyntheticExcitation {
        truth: TRUTH,
        samples: 600,
        slip_std: 0.0,
        force_std: NOISE,
        ..SyntheticExcitation::default()
    };
    let mut one = synthetic_samples(&excitation, 0.4);
    let mirrored = Theta::from([TRUTH[0], TRUTH[1], TRUTH[2], TRUTH[3], -TRUTH[4], -TRUTH[5]]);
    let other = synthetic_samples(&SyntheticExcitation { truth: mirrored, seed: 5, ..excitation }, 0.4);
    for (slip, force) in other.slip.iter().zip(&other.force) {
        one.push(-slip, -force, 1.0);
    }
    one
}

#[test]
fn a_needle_is_drawn_from_about_the_optimum() {
    let samples = both_sides();
    let prior = Prior { free: [true; 6], ..Prior::longitudinal() };
    let fit = least_squares(
        &CurveFitProblem { free: prior.free, ..CurveFitProblem::new(&samples) },
        &FitOptions::default(),
    )
    .expect("a fit");
    let optima: Vec<Theta> = fit.optima.iter().map(|(theta, _)| *theta).collect();
    let data = CompressedSamples::new(&samples);
    let found = posterior::draw_posterior(&data, &prior, &optima, &posterior::SamplingOptions::default());
    assert_eq!(
        (found.report.method, found.report.status),
        (SamplingMethod::Importance, SamplingStatus::Exact)
    );
    let near = data.gauss_newton_expansion(&fit.theta);
    let variance = near.squares / (samples.len() as f64 - 6.0);
    let covariance: SMatrix<f64, 6, 6> = near.hessian.try_inverse().expect("all is known") * variance;
    for i in 0..6 {
        let values: Vec<f64> = found.posterior.samples.iter().map(|theta| theta[i]).collect();
        let normal = covariance[(i, i)].sqrt();
        let off = (mean(&values) - fit.theta[i]) / normal;
        assert!(off.abs() < 0.1, "{i}: off by {off} standard deviations");
        let ratio = std(&values) / normal;
        assert!((ratio - 1.0).abs() < 0.05, "{i}: {ratio} times as wide");
        assert!((fit.theta[i] - TRUTH[i]).abs() < 4.0 * normal, "{i}");
    }
}
