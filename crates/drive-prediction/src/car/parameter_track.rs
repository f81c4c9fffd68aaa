//! Follows the parameters of a log by what became of predictions that have ended.

use nalgebra::{SMatrix, SVector};
use numerics::loss::Loss;
use rayon::prelude::*;

use crate::car::fit::FittedCar;
use crate::car::information::RolloutErrors;
use crate::car::motion::DriveWithRates;
use crate::car::parameters::{LAG, LEAST_LAG, ParameterVector, VARYING};
use crate::car::section::rollout_starts;

/// Covariance of what a log has of its own.
pub type ParameterCovariance = SMatrix<f64, VARYING, VARYING>;
type LogSpecificParameters = SVector<f64, VARYING>;

/// Time between two starts of rollouts [s], and how long they last [s].
const EVERY: f64 = 0.1;
const HORIZON: f64 = 0.6;
/// What ended longer ago than this counts less and less [s].
const MEMORY: f64 = 10.0;
/// A reading is worth this much: rollouts that overlap see the same.
const WORTH: f64 = 0.02;
/// A single error pulls no more beyond this many standard deviations.
const LOSS: Loss = Loss::Huber { threshold: 2.0 };
/// Farthest that a log may be from the others, in standard deviations.
const FARTHEST: f64 = 3.0;

/// What is known of the parameters from a row on.
#[derive(Clone, Debug)]
pub struct ParameterEstimate {
    /// The row.
    pub from: usize,
    /// The parameters.
    pub x: ParameterVector,
    /// Covariance of those that differ between logs.
    pub covariance: ParameterCovariance,
}

/// The parameters while a drive goes on.
#[derive(Clone, Debug)]
pub struct ParameterTrack(Vec<ParameterEstimate>);

impl ParameterTrack {
    /// Of a drive that the car was not fitted to. Derivatives are those at θ.
    #[must_use]
    pub fn new(fitted: &FittedCar, driven: &DriveWithRates) -> Self {
        let (starts, ahead) = rollout_starts(&driven.drive, HORIZON, EVERY);
        let roll = |start: &usize| {
            let FittedCar { car, parameters, residual_std, .. } = fitted;
            let errors = RolloutErrors::new(driven, car, parameters, *start, ahead, *residual_std);
            (start + ahead, errors)
        };
        let ended: Vec<(usize, RolloutErrors)> = starts.par_iter().map(roll).collect();
        let mut state = InformationEstimate::default();
        let mut known = vec![state.parameter_estimate(fitted, 0)];
        let mut last = 0;
        for (end, errors) in &ended {
            state.fade_information((end - last) as f64 * driven.drive.step);
            state.add_information(errors, &fitted.between_log_std);
            known.push(state.parameter_estimate(fitted, *end));
            last = *end;
        }
        Self(known)
    }

    /// What the rows up to this one tell.
    #[must_use]
    pub fn estimate_at(&self, row: usize) -> &ParameterEstimate {
        &self.0[self.0.partition_point(|known| known.from <= row).max(1) - 1]
    }

    /// All that was ever known, in order.
    #[must_use]
    pub fn estimates(&self) -> &[ParameterEstimate] {
        &self.0
    }
}

/// b over its standard deviation: normal with this information.
#[derive(Clone, Debug, Default)]
struct InformationEstimate {
    matrix: ParameterCovariance,
    vector: LogSpecificParameters,
    mean: LogSpecificParameters,
    covariance: Option<ParameterCovariance>,
}

impl InformationEstimate {
    /// Information fades, so that b may change; what is left without any is the prior.
    fn fade_information(&mut self, time: f64) {
        let keep = (-time / MEMORY).exp();
        self.matrix *= keep;
        self.vector *= keep;
    }

    fn add_information(&mut self, errors: &RolloutErrors, spread: &[f64; VARYING]) {
        for (value, slope) in errors.values.iter().zip(&errors.slopes) {
            let slope = LogSpecificParameters::from_fn(|i, _| slope[i] * spread[i]);
            if !value.is_finite() || slope.iter().any(|slope| !slope.is_finite()) {
                continue;
            }
            let weight = WORTH * LOSS.weight(value + slope.dot(&self.mean));
            self.matrix += weight * slope * slope.transpose();
            self.vector -= weight * *value * slope;
        }
        // With the identity of the prior there always is an inverse.
        if let Some(covariance) = (self.matrix + ParameterCovariance::identity()).try_inverse() {
            self.mean = (covariance * self.vector).map(|it| it.clamp(-FARTHEST, FARTHEST));
            self.covariance = Some(covariance);
        }
    }

    fn parameter_estimate(&self, fitted: &FittedCar, from: usize) -> ParameterEstimate {
        let mut x = fitted.parameters;
        for (x, (spread, mean)) in x.iter_mut().zip(fitted.between_log_std.iter().zip(self.mean.iter())) {
            *x += spread * mean;
        }
        x[LAG] = x[LAG].max(LEAST_LAG);
        let covariance = self.covariance.unwrap_or_else(ParameterCovariance::identity);
        let scaled =
            |i: usize, k: usize| covariance[(i, k)] * fitted.between_log_std[i] * fitted.between_log_std[k];
        ParameterEstimate { from, x, covariance: ParameterCovariance::from_fn(scaled) }
    }
}
