//! Free shifts.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::statistics::{mean, std};
use preparation::samples::CurveSamples;
use tire_inference::bounds::Bounds;
use tire_inference::compressed::CompressedSamples;
use tire_inference::fit::{CurveFitProblem, FitOptions, least_squares};
use tire_inference::linearised_slip_noise::linearise_slip_noise;
use tire_inference::parameters::{COUNT, Theta};
use tire_inference::prior::Prior;
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

use super::judge_shifts::{judge, quantities};
use super::support::draw;

const TRUTH: Theta = [15.0, 2.0, 1.5, 0.8, 0.003, -0.02];

/// Slips to both sides, with what they know of the noise in them.
fn drive(count: usize, level: f64, slip_std: f64) -> CurveSamples {
    let excitation =
        SyntheticExcitation { truth: TRUTH, samples: count, slip_std, ..SyntheticExcitation::default() };
    let right = synthetic_samples(&excitation, level);
    let [B, C, D, E, S_h, S_v] = TRUTH;
    let truth = [B, C, D, E, -S_h, -S_v];
    let left = synthetic_samples(&SyntheticExcitation { truth, seed: 1, ..excitation }, level);
    let mut both = right;
    for ((slip, force), weight) in left.slip.into_iter().zip(left.force).zip(left.weight) {
        both.push(-slip, -force, weight);
    }
    linearise_slip_noise(&both, &TRUTH, slip_std, 0.05)
}

fn compare(samples: &CurveSamples, prior: &Prior, nodes: [usize; 2]) {
    let problem = CurveFitProblem { free: prior.free, held: prior.centre, ..CurveFitProblem::new(samples) };
    let fit = least_squares(&problem, &FitOptions::default()).expect("fits");
    let optima: Vec<Theta> = fit.optima.into_iter().map(|(theta, _)| theta).collect();
    let data = CompressedSamples::new(samples);
    let found = draw(&data, prior, &optima);
    let expected = judge(&data, prior, nodes[0], nodes[1]);
    let free = |i: usize| i < 5 || prior.free[i - 1];
    for (i, [centre, spread]) in expected.into_iter().enumerate().filter(|(i, _)| free(*i)) {
        let draws = found.posterior.samples.iter();
        let values: Vec<f64> = draws.map(|theta| quantities(theta)[i]).collect();
        let (error, ratio) = ((mean(&values) - centre) / spread, std(&values) / spread);
        let name = ["B", "C", "D", "E", "K", "S_h", "S_v"][i];
        assert!(error.abs() < 0.05, "{name}: off by {error} standard deviations");
        assert!((ratio - 1.0).abs() < 0.05, "{name}: {ratio} times the width");
    }
    assert!(found.posterior.samples.iter().all(|theta| prior.contains(theta)));
}

fn all_free() -> Prior {
    Prior { free: [true; COUNT], ..Prior::longitudinal().with_bounds(Bounds::GOBLIRSCH) }
}

#[test]
fn with_noise_in_the_slip_the_draws_have_the_moments_of_brute_force() {
    compare(&drive(200, 0.06, 0.002), &all_free(), [16, 16]);
}

#[test]
fn so_they_have_where_the_box_cuts_the_shifts_off() {
    let mut prior = all_free();
    prior.bounds.upper[4] = 0.0035;
    prior.bounds.lower[5] = -0.015;
    compare(&drive(200, 0.06, 0.0), &prior, [20, 18]);
}

#[test]
fn so_they_have_where_only_the_vertical_shift_is_free() {
    let prior = Prior { free: [true, true, true, true, false, true], ..all_free() };
    compare(&drive(200, 0.06, 0.0), &prior, [16, 16]);
}
