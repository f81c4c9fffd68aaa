//! Parameters that are held, and a vertical shift.

use numerics::statistics::{mean, std};
use tire_inference::compressed::CompressedSamples;
use tire_inference::prior::Prior;

use super::support::{data, draw};

const TRUTH: [f64; 6] = [15.0, 2.0, 1.5, 0.8, 0.0, 0.02];

/// Mean and standard deviation of two parameters under the likelihood, by a fine grid in both, the others being `rest`.
fn on_a_grid(data: &CompressedSamples, rest: [f64; 6], axes: [(usize, [f64; 2]); 2]) -> [[f64; 2]; 2] {
    let n = 400;
    let at = |axis: usize, k: usize| {
        let [low, high] = axes[axis].1;
        low + (high - low) * (k as f64 + 0.5) / n as f64
    };
    let point = |k: usize| {
        let mut theta = rest;
        theta[axes[0].0] = at(0, k / n);
        theta[axes[1].0] = at(1, k % n);
        theta
    };
    let log = |k: usize| -0.5 * (data.effective_count() as f64 - 1.0) * data.residual_squares(&point(k)).ln();
    let logs: Vec<f64> = (0..n * n).map(log).collect();
    let best = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut sums = [[0.0; 3]; 2];
    for (k, log) in logs.iter().enumerate() {
        let (theta, weight) = (point(k), (log - best).exp());
        for (sum, axis) in sums.iter_mut().zip(axes) {
            let value = theta[axis.0];
            for (sum, part) in sum.iter_mut().zip([1.0, value, value * value]) {
                *sum += weight * part;
            }
        }
    }
    sums.map(|[whole, first, second]| {
        let mean = first / whole;
        [mean, (second / whole - mean * mean).sqrt()]
    })
}

fn compare(free: [usize; 2], ranges: [[f64; 2]; 2]) {
    let (data, optima) = data(TRUTH, 300, 0.3, 5);
    let mut prior = Prior { centre: TRUTH, ..Prior::longitudinal() };
    prior.free = std::array::from_fn(|i| free.contains(&i));
    let found = draw(&data, &prior, &optima);
    let axes = [(free[0], ranges[0]), (free[1], ranges[1])];
    for (axis, [expected, spread]) in free.into_iter().zip(on_a_grid(&data, TRUTH, axes)) {
        let values: Vec<f64> = found.posterior.samples.iter().map(|theta| theta[axis]).collect();
        let (error, ratio) = ((mean(&values) - expected) / spread, std(&values) / spread);
        assert!(error.abs() < 0.06, "{axis}: off by {error} standard deviations");
        assert!((ratio - 1.0).abs() < 0.05, "{axis}: {ratio} times the width");
    }
    let held = |i: usize| free.contains(&i) || found.posterior.samples[0][i] == TRUTH[i];
    assert!((0..6).all(held), "{:?}", found.posterior.samples[0]);
}

#[test]
fn with_the_shape_held_stiffness_and_peak_are_those_of_a_grid() {
    compare([0, 2], [[13.0, 17.0], [1.45, 1.55]]);
}

#[test]
fn with_the_peak_held_shape_and_curvature_are_those_of_a_grid() {
    compare([1, 3], [[1.8, 2.2], [0.5, 1.0]]);
}

#[test]
fn a_free_vertical_shift_is_that_of_a_grid() {
    compare([2, 5], [[1.35, 1.65], [-0.1, 0.1]]);
}

#[test]
fn a_vertical_shift_at_the_end_of_the_box_is_cut_off() {
    // The box ends where the data want the shift to be.
    let (data, optima) = data(TRUTH, 300, 0.3, 5);
    let mut prior = Prior { centre: TRUTH, ..Prior::longitudinal() };
    prior.free = [false, false, true, false, false, true];
    prior.bounds.upper[5] = 0.02;
    let found = draw(&data, &prior, &optima);
    let axes = [(2, [1.35, 1.65]), (5, [-0.1, 0.02])];
    let [[_, _], [expected, spread]] = on_a_grid(&data, TRUTH, axes);
    let values: Vec<f64> = found.posterior.samples.iter().map(|theta| theta[5]).collect();
    assert!((mean(&values) - expected).abs() < 0.06 * spread);
    assert!((std(&values) / spread - 1.0).abs() < 0.05);
}

#[test]
fn a_held_horizontal_shift_moves_the_curve() {
    let (data, optima) = data([15.0, 2.0, 1.5, 0.8, 0.01, 0.0], 300, 0.3, 5);
    let mut prior = Prior::longitudinal();
    prior.centre[4] = 0.01;
    prior.centre[5] = 0.0;
    let found = draw(&data, &prior, &optima);
    let values: Vec<f64> =
        found.posterior.samples.iter().map(|theta| theta[0] * theta[1] * theta[2]).collect();
    assert!((mean(&values) - 45.0).abs() < 4.0 * std(&values));
    assert!(found.posterior.samples.iter().all(|theta| theta[4] == 0.01));
}
