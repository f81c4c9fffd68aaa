//! Rejects points whose force does not fit their slip, at any slip.

use std::ops::Range;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::robust::{bisquare_weight, windowed_robust_stds};
use crate::samples::CurveSamples;

/// Rejection of outliers by the force at similar slips.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OutlierRejection {
    /// Rejects outliers.
    pub reject: bool,
    /// Number of neighbours in slip that predict the force of a point.
    pub neighbours: usize,
    /// Least distance of an outlier from the predicted force, in standard deviations of the neighbours [-].
    pub threshold: f64,
    /// Distance from the predicted force, over load [-]; points within it are kept.
    pub floor: f64,
}

impl Default for OutlierRejection {
    fn default() -> Self {
        Self { reject: true, neighbours: 101, threshold: 5.0, floor: 0.02 }
    }
}

/// Rounds of weights by the residuals of the round before.
const ROUNDS: usize = 4;

impl OutlierRejection {
    /// Which points to keep, in their order.
    ///
    /// The force that belongs to a slip is a local parabola through the neighbours, weighted by distance and, against
    /// outliers, by residual (Cleveland, "Robust Locally Weighted Regression and Smoothing Scatterplots", 1979). Only
    /// the residual is judged: slip decides who the neighbours are and nothing else, and where neighbours are far they
    /// differ more and a point may as well. Fewer than 10 points are all kept.
    pub fn inlier_mask(&self, samples: &CurveSamples) -> Vec<bool> {
        let n = samples.len();
        let mut keep = vec![true; n];
        if !self.reject || n < 10 {
            return keep;
        }
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| samples.slip[a].total_cmp(&samples.slip[b]));
        let slip: Vec<f64> = order.iter().map(|&i| samples.slip[i]).collect();
        let force: Vec<f64> = order.iter().map(|&i| samples.force[i]).collect();

        let windows = nearest_slip_windows(&slip, self.neighbours);
        let close = nearest_slip_windows(&slip, self.neighbours.div_ceil(4));
        let residual = local_fit_residuals(&slip, &force, &windows);
        let scales = [&windows, &close].map(|windows| windowed_robust_stds(&residual, windows));
        for (rank, &i) in order.iter().enumerate() {
            let scale = scales[0][rank].max(scales[1][rank]);
            keep[i] = residual[rank].abs() <= (self.threshold * scale).max(self.floor);
        }
        keep
    }
}

/// Residuals of points that are sorted by slip, each with its window of neighbours.
fn local_fit_residuals(slip: &[f64], force: &[f64], windows: &[Range<usize>]) -> Vec<f64> {
    let mut trust = vec![1.0; slip.len()];
    let mut residual = vec![0.0; slip.len()];
    let mut weights = Vec::new();
    for _ in 0..ROUNDS {
        for (i, window) in windows.iter().enumerate() {
            let (near, trust) = (&slip[window.clone()], &trust[window.clone()]);
            tricube_weights(near, slip[i], trust, &mut weights);
            let value = local_parabola_value(near, &force[window.clone()], &weights, slip[i]);
            residual[i] = value.map_or(0.0, |value| force[i] - value);
        }
        for (rank, scale) in windowed_robust_stds(&residual, windows).into_iter().enumerate() {
            trust[rank] = if scale > 0.0 { bisquare_weight(residual[rank] / scale) } else { 1.0 };
        }
    }
    residual
}

/// How far the ascending `x` reach from `centre`.
fn reach(x: &[f64], centre: f64) -> f64 {
    (centre - x[0]).max(x[x.len() - 1] - centre).max(f64::MIN_POSITIVE)
}

/// Weights of neighbours by their distance from `centre`, times those that they have already.
fn tricube_weights(x: &[f64], centre: f64, trust: &[f64], weights: &mut Vec<f64>) {
    let scale = 0.999 / reach(x, centre);
    let tricube = |x: f64| (1.0 - (scale * (x - centre).abs()).powi(3)).powi(3);
    weights.clear();
    weights.extend(x.iter().zip(trust).map(|(x, trust)| tricube(*x) * trust));
}

/// The value at `centre` of the parabola that fits `y` at the ascending `x` best, with these weights; `None` where all are 0.
///
/// It is the value by [`crate::local_polynomial::local_polynomial_weights`], without a table of each polynomial: every round asks for it at every
/// point, and so it takes a third of the time.
fn local_parabola_value(x: &[f64], y: &[f64], weights: &[f64], centre: f64) -> Option<f64> {
    let per_reach = reach(x, centre).recip();
    let (mut value, mut whole, mut norm_before) = (None, 0.0, 1.0);
    // The polynomials are 1, x − a and (x − b) (x − a) − c; multiplied out they would lose digits where neighbours are far.
    let [mut a, mut b, mut c] = [0.0; 3];
    for degree in 0..=2 {
        let polynomial = |x: f64| match degree {
            0 => 1.0,
            1 => x - a,
            _ => (x - b) * (x - a) - c,
        };
        let [mut norm, mut moment, mut projection] = [0.0; 3];
        for ((x, y), w) in x.iter().zip(y).zip(weights) {
            let x = (x - centre) * per_reach;
            let p = polynomial(x);
            let weighted = w * p;
            norm += weighted * p;
            moment += weighted * p * x;
            projection += weighted * y;
        }
        if degree == 0 {
            whole = norm;
        }
        if norm <= 1e-14 * whole {
            break;
        }
        value = Some(value.unwrap_or(0.0) + projection / norm * polynomial(0.0));
        match degree {
            0 => a = moment / norm,
            _ => (b, c) = (moment / norm, norm / norm_before),
        }
        norm_before = norm;
    }
    value
}

/// For each of the points, sorted by slip, the ranks of the `count` points nearest in slip, itself included.
fn nearest_slip_windows(slip: &[f64], count: usize) -> Vec<Range<usize>> {
    let count = count.clamp(1, slip.len());
    let mut first = 0;
    let window = |i: usize| {
        while first + count < slip.len() && slip[first + count] - slip[i] < slip[i] - slip[first] {
            first += 1;
        }
        first..first + count
    };
    (0..slip.len()).map(window).collect()
}

/// The samples to keep, unchanged and in their order.
pub fn select_samples(samples: &CurveSamples, keep: &[bool]) -> CurveSamples {
    let kept = |values: &[f64]| values.iter().zip(keep).filter(|(_, k)| **k).map(|(v, _)| *v).collect();
    CurveSamples { slip: kept(&samples.slip), force: kept(&samples.force), weight: kept(&samples.weight) }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64;
    use vehicle::MagicFormula;

    use super::*;
    use crate::local_polynomial::local_polynomial_weights;

    /// Points of the demo tire, dense up to a third of the reach and ever sparser beyond, as driving has them; noise
    /// grows with slip.
    fn driven(seed: u64, n: usize, reach: f64) -> CurveSamples {
        let mut random = Pcg64::seed_from_u64(seed);
        let normal = Normal::new(0.0, 1.0).expect("one is a standard deviation");
        let tire = MagicFormula::default();
        let point = |_| {
            let u: f64 = random.random_range(-1.0..1.0);
            let slip = reach * u.powi(5);
            let noise = 0.02 + 0.3 * slip.abs();
            (slip, tire.friction_coefficient(slip) + noise * normal.sample(&mut random))
        };
        let (slip, force) = (0..n).map(point).unzip();
        CurveSamples::new(slip, force)
    }

    #[test]
    fn parabolas_are_those_of_the_filters() {
        let (y, weights) = ([0.3, -0.1, 0.8, 0.2, 0.9, -0.4], [1.0, 0.9, 0.5, 0.7, 0.8, 0.3]);
        // Evenly, one far from the others, two places only, and one.
        let even = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        for x in [even, [0.1, 7.0, 7.1, 7.2, 7.3, 7.4], [0.1, 0.1, 0.1, 0.4, 0.4, 0.4], [0.1; 6]] {
            for centre in [x[0], x[3]] {
                let h = local_polynomial_weights(&x.map(|x| x - centre), &weights, 2, 0);
                let expected: f64 = h.iter().zip(y).map(|(h, y)| h * y).sum();
                let value = local_parabola_value(&x, &y, &weights, centre).expect("a value");
                assert_relative_eq!(value, expected, max_relative = 1e-9);
            }
        }
        assert_eq!(local_parabola_value(&even, &y, &[0.0; 6], 0.1), None);
    }

    #[test]
    fn high_slip_is_never_cut() {
        for seed in 0..5 {
            let samples = driven(seed, 3000, 0.3);
            let keep = OutlierRejection::default().inlier_mask(&samples);
            let high = |i: &usize| samples.slip[*i].abs() > 0.1;
            let cut = (0..samples.len()).filter(high).filter(|&i| !keep[i]).count();
            assert_eq!(cut, 0, "seed {seed}");
            let all = keep.iter().filter(|k| !**k).count();
            assert!(all <= 6, "5 standard deviations cut {all} of 3000 good points, seed {seed}");
        }
    }

    #[test]
    fn wrong_forces_are_cut_at_any_slip() {
        let mut samples = driven(7, 3000, 0.3);
        let wrong: Vec<usize> = (0..samples.len()).step_by(25).collect();
        for &i in &wrong {
            samples.force[i] += if i % 2 == 0 { 0.8 } else { -0.8 };
        }
        let keep = OutlierRejection::default().inlier_mask(&samples);
        let missed = wrong.iter().filter(|&&i| keep[i]).count();
        assert!(missed <= wrong.len() / 20, "{missed} of {} remain", wrong.len());
        let good = (0..samples.len()).filter(|i| !keep[*i] && i % 25 != 0).count();
        assert!(good <= 6, "{good} good points are gone");
    }

    #[test]
    fn others_are_unchanged_and_nothing_is_cut_without_noise() {
        let samples = driven(3, 500, 0.3);
        let keep: Vec<bool> = (0..500).map(|i| i % 3 != 0).collect();
        let left = select_samples(&samples, &keep);
        let expected: Vec<f64> = (0..500).filter(|i| i % 3 != 0).map(|i| samples.force[i]).collect();
        assert_eq!(left.force, expected);
        let tire = MagicFormula::default();
        let clean: Vec<f64> = samples.slip.iter().map(|s| tire.friction_coefficient(*s)).collect();
        assert!(
            OutlierRejection::default()
                .inlier_mask(&CurveSamples::new(samples.slip, clean))
                .iter()
                .all(|k| *k)
        );
    }
}
