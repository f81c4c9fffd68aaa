//! Judges importance weights by the tail of their distribution: Pareto-smoothed importance sampling (Vehtari, Simpson,
//! Gelman, Yao and Gabry, "Pareto smoothed importance sampling", J. Mach. Learn. Res. 25 (2024)).

use serde::Serialize;

/// Shape from which on means of the weighted draws are not to be relied on, however many there are.
pub const HIGHEST_K_HAT: f64 = 0.7;
/// Weights of which this share is effective, none of them above the largest, are even: they have no tail to fit, and k-hat
/// says nothing of them.
const EVEN: f64 = 0.9;
const LARGEST: f64 = 0.01;
/// Below, the largest weights decide, and k-hat may be small because it did not see what is missing.
const FEW: f64 = 0.1;
/// Exceedances that a tail needs.
const TAIL: usize = 5;

/// What weights say about the distribution that they correct.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WeightDiagnosis {
    /// Shape of the tail of the weights: below 0.5 their variance is finite, above 0.7 their mean cannot be estimated.
    pub k_hat: f64,
    /// Effective number of draws over their number.
    pub effective_share: f64,
    /// Largest weight, their sum being 1.
    pub largest_weight: f64,
}

impl WeightDiagnosis {
    /// Whether the draws are close enough to what they stand for that weights can correct the rest. No number here sees a
    /// mode that no draw is in.
    pub fn is_close(&self) -> bool {
        let even = self.effective_share >= EVEN && self.largest_weight <= LARGEST;
        even || (self.k_hat <= HIGHEST_K_HAT && self.effective_share >= FEW)
    }
}

/// Diagnosis, and weights of sum 1 with their largest ones smoothed. −∞ is the logarithm of no weight; NaN counts as that.
pub fn pareto_smooth(log_weights: &[f64]) -> (WeightDiagnosis, Vec<f64>) {
    let best = log_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let relative = |log: &f64| if (log - best).is_finite() { (log - best).exp() } else { 0.0 };
    let mut weights: Vec<f64> = log_weights.iter().map(relative).collect();
    let raw = weights.clone();
    let count = weights.len() as f64;
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|&i, &j| weights[i].total_cmp(&weights[j]));
    let tail = (0.2 * count).min(3.0 * count.sqrt()) as usize;
    let first = order.len() - tail;
    let mut k_hat = f64::INFINITY;
    if tail >= TAIL && first > 0 {
        let threshold = weights[order[first - 1]];
        let excess: Vec<f64> = order[first..].iter().map(|&i| weights[i] - threshold).collect();
        let (shape, scale) = generalised_pareto(&excess);
        k_hat = shape;
        if shape.is_finite() {
            for (rank, &i) in order[first..].iter().enumerate() {
                let share = (rank as f64 + 0.5) / tail as f64;
                weights[i] = (threshold + generalised_pareto_quantile(share, shape, scale)).min(1.0);
            }
        }
    }
    let sum = |of: &[f64]| of.iter().sum::<f64>();
    let squares = raw.iter().map(|weight| weight * weight).sum::<f64>();
    let diagnosis = WeightDiagnosis {
        k_hat,
        effective_share: sum(&raw).powi(2) / squares / count,
        largest_weight: 1.0 / sum(&raw),
    };
    let whole = sum(&weights);
    weights.iter_mut().for_each(|weight| *weight /= whole);
    (diagnosis, weights)
}

/// Shape and scale of the generalised Pareto distribution of ascending positive numbers: the mean of a profile of the
/// likelihood over θ = −shape / scale (Zhang and Stephens, "A new and efficient estimation method for the generalized Pareto
/// distribution", Technometrics 51 (2009)), with ten observations' worth of prior at shape ½ (Vehtari et al., appendix G).
fn generalised_pareto(ascending: &[f64]) -> (f64, f64) {
    let count = ascending.len();
    let n = count as f64;
    let quartile = ascending[(n / 4.0 + 0.5) as usize - 1];
    let highest = ascending[count - 1];
    if quartile.is_nan() || quartile <= 0.0 {
        return (f64::INFINITY, f64::NAN);
    }
    let nodes = 30 + n.sqrt() as usize;
    let theta =
        |j: usize| 1.0 / highest + (1.0 - (nodes as f64 / (j as f64 + 0.5)).sqrt()) / (3.0 * quartile);
    let shape = |theta: f64| ascending.iter().map(|x| (-theta * x).ln_1p()).sum::<f64>() / n;
    let likelihoods: Vec<f64> = (0..nodes)
        .map(|j| {
            let (theta, shape) = (theta(j), shape(theta(j)));
            n * ((-theta / shape).ln() - shape - 1.0)
        })
        .collect();
    let best = likelihoods.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (mut mean, mut whole) = (0.0, 0.0);
    for (j, likelihood) in likelihoods.iter().enumerate() {
        let weight = (likelihood - best).exp();
        mean += weight * theta(j);
        whole += weight;
    }
    let mean = mean / whole;
    let fitted = shape(mean);
    let scale = -fitted / mean;
    ((n * fitted + 10.0 * 0.5) / (n + 10.0), scale)
}

/// The number that a share of a generalised Pareto distribution is below.
fn generalised_pareto_quantile(share: f64, shape: f64, scale: f64) -> f64 {
    let log_rest = (-share).ln_1p();
    if shape.abs() < 1e-12 { -scale * log_rest } else { scale * (-shape * log_rest).exp_m1() / shape }
}

#[cfg(test)]
mod tests {
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    #[test]
    fn the_shape_of_pareto_weights_is_found() {
        for shape in [0.2, 0.5, 0.8, 1.2] {
            // Weights u^−shape have a Pareto tail of that shape, of numbers as even as can be.
            let count = 20_000;
            let logs: Vec<f64> =
                (0..count).map(|i| -shape * ((f64::from(i) + 0.5) / f64::from(count)).ln()).collect();
            let (found, _) = pareto_smooth(&logs);
            assert_abs_diff_eq!(found.k_hat, shape, epsilon = 0.06);
            assert_eq!(found.is_close(), shape < 0.7, "{shape}: {found:?}");
        }
    }

    #[test]
    fn a_proposal_of_smaller_variance_has_the_shape_that_theory_gives() {
        // Normal target of variance 1, proposal of variance v < 1: P(weight > w) falls as w^−1/k with k = 1 − v.
        let mut random = Pcg64::seed_from_u64(1);
        for variance in [0.9_f64, 0.4, 0.15] {
            let draws = (0..100_000).map(|_| {
                let e: f64 = StandardNormal.sample(&mut random);
                0.5 * e * e * (1.0 - variance)
            });
            let (found, _) = pareto_smooth(&draws.collect::<Vec<f64>>());
            // Logarithms in the tail make the finite-sample shape somewhat smaller.
            assert_abs_diff_eq!(found.k_hat, 1.0 - variance, epsilon = 0.12);
        }
    }

    #[test]
    fn smoothing_tames_a_heavy_tail_and_keeps_the_mean() {
        // Mean of x² under the standard normal distribution from draws of half the variance.
        let mut random = Pcg64::seed_from_u64(7);
        let (mut raw, mut smoothed) = (0.0, 0.0);
        for _ in 0..200 {
            let draws: Vec<f64> = (0..1000)
                .map(|_| {
                    let e: f64 = StandardNormal.sample(&mut random);
                    0.5_f64.sqrt() * e
                })
                .collect();
            let logs: Vec<f64> = draws.iter().map(|x| 0.5 * x * x).collect();
            let whole: f64 = logs.iter().map(|log| log.exp()).sum();
            let plain: f64 = draws.iter().zip(&logs).map(|(x, log)| x * x * log.exp()).sum::<f64>() / whole;
            let (_, weights) = pareto_smooth(&logs);
            assert_relative_eq!(weights.iter().sum::<f64>(), 1.0, max_relative = 1e-12);
            let mean: f64 = draws.iter().zip(&weights).map(|(x, weight)| x * x * weight).sum();
            raw += (plain - 1.0).powi(2);
            smoothed += (mean - 1.0).powi(2);
        }
        assert!(smoothed < raw, "mean squared errors: {smoothed} smoothed, {raw} raw");
    }

    #[test]
    fn even_weights_are_close_whatever_their_tail() {
        let mut random = Pcg64::seed_from_u64(2);
        let logs: Vec<f64> = (0..4000).map(|_| 1e-3 * random.random::<f64>()).collect();
        let (found, weights) = pareto_smooth(&logs);
        assert!(found.is_close() && found.effective_share > 0.999, "{found:?}");
        assert!(weights.iter().all(|weight| (4000.0 * weight - 1.0).abs() < 0.01));
        let (same, _) = pareto_smooth(&[3.0; 400]);
        assert!(same.is_close() && same.effective_share > 0.999);
    }

    #[test]
    fn one_draw_that_has_it_all_is_not_close() {
        let mut logs = vec![-1000.0; 500];
        logs[7] = 0.0;
        let (found, weights) = pareto_smooth(&logs);
        assert!(!found.is_close(), "{found:?}");
        assert_relative_eq!(weights.iter().sum::<f64>(), 1.0, max_relative = 1e-12);
        logs[8] = f64::NAN;
        assert!(pareto_smooth(&logs).1.iter().all(|weight| weight.is_finite()));
    }
}
