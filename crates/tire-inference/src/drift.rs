//! Tells whether stiffness and friction of a tire drift: a random walk through the values of consecutive stretches.
//!
//! Each stretch k gives y_k = x_k + n_k + e_k of ln K or ln D. e_k has the variance of the fit of the stretch, n_k is what else makes
//! stretches differ, such as the slope of the road, with the variance w; x walks, x_k+1 = x_k + N(0, q Δt). Both variances are those of
//! the largest likelihood, restricted to what does not depend on the level (Harvey, Forecasting, Structural Time Series Models and the
//! Kalman Filter, 1989, section 4.5). A drift is told where q = 0 is less likely by a ratio that chance exceeds in 1.25 % of cases: 5 %
//! over K and D of two axles (Bonferroni). q is on the border of what it can be, so half of the mass of the ratio is at zero (Self and Liang 1987).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{DMatrix, DVector};
use numerics::text::format_significant;
use serde::Serialize;

/// Fewer stretches tell no drift from scatter.
const LEAST: usize = 6;
/// Twice the logarithm of the ratio of likelihoods that half of χ² with one degree of freedom exceeds in 1.25 % of cases.
const TOLD: f64 = 5.02;
/// Standard deviations to each side of the middle 95 %.
const NORMAL_95: f64 = 1.96;
/// Standard deviation of a logarithm beyond which a stretch says nothing.
const VAGUE: f64 = 0.3;

/// A value of one stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StretchValue {
    /// Middle of the stretch [s].
    pub time: f64,
    /// Number of the lap, where the stretch is one.
    pub lap: Option<f64>,
    /// Logarithm of K or D.
    pub logarithm: f64,
    /// Variance of the logarithm.
    pub variance: f64,
    /// Temperature of the tread, in any unit.
    pub temperature: Option<f64>,
}

/// What is said of the drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DriftVerdict {
    /// The quantity changes.
    Drifts,
    /// A constant explains the stretches.
    NoDriftTold,
    /// Too few stretches tell the quantity.
    NotIdentifiable,
}

/// The quantity in one stretch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StretchEstimate {
    /// Middle of the stretch [s].
    pub time: f64,
    /// Number of the lap, where the stretch is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lap: Option<f64>,
    /// Value, in the unit of the quantity.
    pub value: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// Value of the fit of this stretch alone.
    pub alone: f64,
}

/// The change of the logarithm with the temperature of the tread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TemperatureEffect {
    /// Relative change per unit of the temperature.
    pub slope: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// Whether the interval excludes zero.
    pub told: bool,
}

/// How a quantity drifts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftEstimate {
    /// What is said.
    pub verdict: DriftVerdict,
    /// Value by stretch.
    pub stretches: Vec<StretchEstimate>,
    /// Last over first value, less 1; with its 95 % interval.
    pub change: Option<[f64; 3]>,
    /// Standard deviation of the walk [1/√s], of the logarithm.
    pub walk_std: f64,
    /// Standard deviation of what else makes stretches differ, of the logarithm.
    pub scatter_std: f64,
    /// Twice the logarithm of the likelihood over that of no drift.
    pub likelihood_ratio: f64,
    /// Regression on the temperature of the tread, where that is known.
    pub by_temperature: Option<TemperatureEffect>,
}

impl DriftEstimate {
    /// Of the stretches that tell the quantity, in the order of time.
    pub fn estimate(values: &[StretchValue]) -> Self {
        let telling = |it: &&StretchValue| it.variance.is_finite() && it.variance.sqrt() < VAGUE;
        let values: Vec<StretchValue> = values.iter().filter(telling).copied().collect();
        if values.len() < LEAST {
            return Self {
                verdict: DriftVerdict::NotIdentifiable,
                stretches: Vec::new(),
                change: None,
                walk_std: 0.0,
                scatter_std: 0.0,
                likelihood_ratio: 0.0,
                by_temperature: None,
            };
        }
        let level = DMatrix::from_element(values.len(), 1, 1.0);
        let model = RandomWalkModel { values: &values, regressors: level };
        let (constant, still) = model.maximise_likelihood(&[0.0]);
        let (drifting, moving) = model.maximise_likelihood(&WALKS);
        let likelihood_ratio = (2.0 * (moving - still)).max(0.0);
        let told = likelihood_ratio > TOLD;
        let [walk, scatter] = if told { drifting } else { constant };
        let (stretches, change) = model.smooth_stretches([walk, scatter]);
        Self {
            verdict: if told { DriftVerdict::Drifts } else { DriftVerdict::NoDriftTold },
            stretches,
            change: Some(change),
            walk_std: walk.sqrt(),
            scatter_std: scatter.sqrt(),
            likelihood_ratio,
            by_temperature: temperature_effect(&values),
        }
    }

    /// As "K of the rear axle drifts from 125 to 107 kN/rad"; `factor` and `unit` are those of the quantity for people.
    pub fn describe(&self, name: &str, factor: f64, unit: &str) -> String {
        let value = |it: &StretchEstimate| format_significant(factor * it.value, 3);
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        match (self.verdict, self.stretches.first(), self.stretches.last()) {
            (DriftVerdict::Drifts, Some(first), Some(last)) => {
                let [change, low, high] =
                    self.change.unwrap_or_default().map(|it| format_significant(100.0 * it, 2));
                format!(
                    "{name} drifts from {} to {}{unit}: by {change} %, 95 % from {low} to {high} %. No constant describes it.",
                    value(first),
                    value(last)
                )
            }
            (DriftVerdict::NoDriftTold, Some(first), _) => {
                format!(
                    "No drift of {name} is told: a constant of {}{unit} explains the stretches.",
                    value(first)
                )
            }
            _ => format!(
                "A drift of {name} is not identifiable: fewer than {LEAST} stretches tell {name}. Drive longer."
            ),
        }
    }
}

/// Variances of the walk over the log, over that of a logarithm by one tenth, that are tried.
const WALKS: [f64; 13] = [0.0, 0.003, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.5, 5.0, 10.0];
/// Standard deviations of the scatter that are tried.
const SCATTERS: [f64; 12] = [0.0, 0.003, 0.006, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12, 0.2];

struct RandomWalkModel<'a> {
    values: &'a [StretchValue],
    /// Level, and what else the logarithm is linear in.
    regressors: DMatrix<f64>,
}

/// Coefficients of the regressors, their covariance, and the restricted logarithm of the likelihood.
struct DriftRegression {
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    inverse: DMatrix<f64>,
    likelihood: f64,
}

impl RandomWalkModel<'_> {
    fn duration(&self) -> f64 {
        self.values[self.values.len() - 1].time - self.values[0].time
    }

    /// Covariance of the walk, which starts at the first stretch.
    fn walk_covariance(&self, variance: f64) -> DMatrix<f64> {
        let since = |k: usize| self.values[k].time - self.values[0].time;
        let count = self.values.len();
        DMatrix::from_fn(count, count, |i, j| variance * since(i.min(j)))
    }

    fn log_values(&self) -> DVector<f64> {
        DVector::from_iterator(self.values.len(), self.values.iter().map(|it| it.logarithm))
    }

    fn fit_coefficients(&self, [walk, scatter]: [f64; 2]) -> Option<DriftRegression> {
        let mut covariance = self.walk_covariance(walk);
        for (k, value) in self.values.iter().enumerate() {
            covariance[(k, k)] += value.variance + scatter;
        }
        let cholesky = covariance.cholesky()?;
        let inverse = cholesky.inverse();
        let information = self.regressors.transpose() * &inverse * &self.regressors;
        let of_coefficients = information.clone().cholesky()?;
        let y = self.log_values();
        let coefficients = of_coefficients.solve(&(self.regressors.transpose() * &inverse * &y));
        let residual = y - &self.regressors * &coefficients;
        let half_determinant = |it: &DMatrix<f64>| it.diagonal().map(f64::ln).sum();
        let likelihood = -half_determinant(cholesky.l_dirty())
            - half_determinant(of_coefficients.l_dirty())
            - 0.5 * residual.dot(&(&inverse * &residual));
        let covariance = of_coefficients.inverse();
        Some(DriftRegression { coefficients, covariance, inverse, likelihood })
    }

    /// The variances of the largest likelihood, and its logarithm.
    fn maximise_likelihood(&self, walks: &[f64]) -> ([f64; 2], f64) {
        let mut best = ([0.0; 2], f64::NEG_INFINITY);
        for walk in walks {
            for scatter in SCATTERS {
                let variances = [0.01 * walk / self.duration(), scatter * scatter];
                let likelihood = self.fit_coefficients(variances).map(|it| it.likelihood);
                if let Some(likelihood) = likelihood.filter(|it| *it > best.1) {
                    best = (variances, likelihood);
                }
            }
        }
        best
    }

    /// Values by stretch, and the change from the first to the last with its interval.
    fn smooth_stretches(&self, variances: [f64; 2]) -> (Vec<StretchEstimate>, [f64; 3]) {
        let count = self.values.len();
        let Some(fitted) = self.fit_coefficients(variances) else {
            return (Vec::new(), [f64::NAN; 3]);
        };
        // x = level + walk, given all stretches.
        let walk = self.walk_covariance(variances[0]);
        let gain = &walk * &fitted.inverse;
        let residual = self.log_values() - &self.regressors * &fitted.coefficients;
        let level = &self.regressors - &gain * &self.regressors;
        let mean = &self.regressors * &fitted.coefficients + &gain * residual;
        let covariance = &walk - &gain * &walk + &level * &fitted.covariance * level.transpose();
        let ends = |centre: f64, variance: f64| {
            let half = NORMAL_95 * variance.max(0.0).sqrt();
            [centre, centre - half, centre + half].map(f64::exp)
        };
        let stretch = |k: usize| {
            let [value, low, high] = ends(mean[k], covariance[(k, k)]);
            let StretchValue { time, lap, logarithm, .. } = self.values[k];
            StretchEstimate { time, lap, value, interval: [low, high], alone: logarithm.exp() }
        };
        let last = count - 1;
        let variance = covariance[(0, 0)] + covariance[(last, last)] - 2.0 * covariance[(0, last)];
        let change = ends(mean[last] - mean[0], variance).map(|ratio| ratio - 1.0);
        ((0..count).map(stretch).collect(), change)
    }
}

/// Generalised least squares, with a walk that the temperature does not explain.
fn temperature_effect(values: &[StretchValue]) -> Option<TemperatureEffect> {
    let known: Vec<StretchValue> =
        values.iter().filter(|it| it.temperature.is_some_and(f64::is_finite)).copied().collect();
    if known.len() < LEAST {
        return None;
    }
    let of = |it: &StretchValue| it.temperature.unwrap_or_default();
    let middle = known.iter().map(of).sum::<f64>() / known.len() as f64;
    let regressors =
        DMatrix::from_fn(
            known.len(),
            2,
            |row, column| if column == 0 { 1.0 } else { of(&known[row]) - middle },
        );
    if regressors.column(1).amax() <= 0.0 {
        return None;
    }
    let model = RandomWalkModel { values: &known, regressors };
    let fitted = model.fit_coefficients(model.maximise_likelihood(&WALKS).0)?;
    let (slope, half) = (fitted.coefficients[1], NORMAL_95 * fitted.covariance[(1, 1)].sqrt());
    let interval = [slope - half, slope + half];
    Some(TemperatureEffect { slope, interval, told: interval[0] > 0.0 || interval[1] < 0.0 })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    /// 30 stretches of 20 s; the fits have 3 %, and the road 2 % more.
    fn stretches(seed: u64, logarithm: impl Fn(f64, f64) -> f64) -> Vec<StretchValue> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let stretch = |k: usize| {
            let time = 20.0 * k as f64;
            let temperature = 350.0 + 15.0 * (time / 130.0).sin();
            let noise = 0.03 * draw() + 0.02 * draw();
            let logarithm = logarithm(time, temperature) + noise;
            StretchValue { time, lap: None, logarithm, variance: 0.0009, temperature: Some(temperature) }
        };
        (0..30).map(stretch).collect()
    }

    #[test]
    fn constant_tires_do_not_drift() {
        let of = |seed| DriftEstimate::estimate(&stretches(seed, |_, _| 2.0));
        let drifts: Vec<DriftEstimate> = (0..100).map(of).collect();
        let told = drifts.iter().filter(|it| it.verdict == DriftVerdict::Drifts).count();
        assert!(told <= 5, "{told} of 100 drift");
        let by_heat = |it: &&DriftEstimate| it.by_temperature.is_some_and(|it| it.told);
        let hot = drifts.iter().filter(by_heat).count();
        assert!(hot <= 10, "{hot} of 100 depend on the temperature");
    }

    #[test]
    fn a_stiffness_that_falls_is_followed() {
        let truth = 0.85_f64.ln();
        let (mut told, mut inside) = (0, 0);
        for seed in 0..100 {
            let drift = DriftEstimate::estimate(&stretches(seed, |time, _| 2.0 + truth * time / 580.0));
            told += usize::from(drift.verdict == DriftVerdict::Drifts);
            let [_, low, high] = drift.change.expect("a change");
            inside += usize::from(low <= -0.15 && -0.15 <= high);
        }
        assert!(told >= 95 && inside >= 90, "told {told}, inside {inside}");
    }

    #[test]
    fn heat_that_drives_a_drift_is_found() {
        let (mut told, mut inside) = (0, 0);
        for seed in 0..100 {
            let drift = DriftEstimate::estimate(&stretches(seed, |_, kelvin| 2.0 - 0.004 * (kelvin - 350.0)));
            let found = drift.by_temperature.expect("a temperature");
            told += usize::from(found.told);
            inside += usize::from(found.interval[0] <= -0.004 && -0.004 <= found.interval[1]);
        }
        assert!(told >= 95 && inside >= 88, "told {told}, inside {inside}");
    }

    #[test]
    fn few_or_vague_stretches_tell_nothing() {
        let mut values = stretches(1, |_, _| 2.0);
        assert_eq!(DriftEstimate::estimate(&values[..5]).verdict, DriftVerdict::NotIdentifiable);
        values.iter_mut().for_each(|it| it.variance = f64::NAN);
        let drift = DriftEstimate::estimate(&values);
        assert_eq!(drift.verdict, DriftVerdict::NotIdentifiable);
        assert!(drift.describe("K", 1.0, "1/rad").contains("Drive longer"));
        assert_eq!(DriftEstimate::estimate(&[]).verdict, DriftVerdict::NotIdentifiable);
    }
}
