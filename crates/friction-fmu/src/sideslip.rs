//! Estimates the speed to the left: accelerations predict it, a sensor or the axles' curves correct it.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use kalman::augmented::StateEstimate;
use serde::{Deserialize, Serialize};

use crate::sample::{SensorNoise, SensorSample};

/// Largest acceleration of a car of which nothing is known [m/s²].
const UNKNOWN: f64 = 5.0;
/// Largest slip of a car that drives, and its standard deviation where nobody knows it [rad].
const MOST: f64 = 0.5;
/// Standard deviation of the slip of a slow car [rad].
const SLOW: f64 = 0.05;

/// v_y [m/s] and its variance.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct LateralSpeedEstimate {
    /// Mean [m/s].
    pub mean: f64,
    /// Variance [m²/s²].
    pub variance: f64,
    /// Whether a sensor said the last value.
    pub measured: bool,
}

/// A force over load that an axle has too much, and how the curve's force changes with v_y.
#[derive(Debug, Clone, Copy)]
pub struct ForceExcess {
    /// Seen less expected.
    pub residual: f64,
    /// Derivative by v_y [s/m].
    pub by_v_y: f64,
    /// Variance of the residual but for that of v_y.
    pub variance: f64,
}

impl LateralSpeedEstimate {
    /// A car that rolls, with its rear axle `l_r` [m] behind.
    pub fn reset_to_rolling(&mut self, sample: &SensorSample, l_r: f64) {
        let std = SLOW * sample.v_x.abs() + 0.02;
        *self = LateralSpeedEstimate { mean: l_r * sample.r, variance: std * std, measured: false };
    }

    /// The next `h` [s]: v_y' = a_y − v_x r. `growth` is that of the variance [m²/s³], for offsets of the accelerometer and banks.
    /// A car that seems to go sideways begins anew, as one that rolls and of which little is known.
    pub fn predict(&mut self, sample: &SensorSample, noise: &SensorNoise, [growth, l_r]: [f64; 2], h: f64) {
        self.mean += h * (sample.a_y - sample.v_x * sample.r);
        let white = noise.a_y.powi(2) + (sample.v_x * noise.r).powi(2);
        self.variance += h * h * white + h * growth;
        self.measured = false;
        let most = MOST * sample.v_x.abs() + 0.5;
        self.variance = self.variance.min(most * most);
        // Sums of accelerations that say so are worth nothing.
        if self.mean.abs() > most {
            *self = LateralSpeedEstimate { mean: l_r * sample.r, variance: most * most, measured: false };
        }
    }

    /// `h` [s] without a sample.
    pub fn predict_without_sample(&mut self, h: f64) {
        self.variance = (self.variance + (UNKNOWN * h).powi(2)).min(1e4);
    }

    /// A measured v_y [m/s].
    pub fn correct_by_sensor(&mut self, v_y: f64, std: f64) {
        self.correct_by_force(&ForceExcess { residual: v_y - self.mean, by_v_y: 1.0, variance: std * std });
        self.measured = true;
    }

    /// A measurement, or an axle.
    pub fn correct_by_force(&mut self, excess: &ForceExcess) {
        let ForceExcess { residual, by_v_y, variance } = *excess;
        let cross_covariance = self.variance * by_v_y;
        let mut estimate = StateEstimate { x: [self.mean], P: [[self.variance]] };
        estimate.update(&[cross_covariance], residual, by_v_y * cross_covariance + variance);
        let StateEstimate { x: [mean], P: [[variance]] } = estimate;
        (self.mean, self.variance) = (mean, variance);
    }
}
