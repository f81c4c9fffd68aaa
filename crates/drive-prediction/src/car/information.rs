//! What the errors of one rollout say about the parameters.

use nalgebra::{SMatrix, SVector};
use numerics::loss::Loss;

use crate::car::motion::{DriveWithRates, Dual};
use crate::car::parameters::{COUNT, CarSpecification, ParameterVector};
use crate::predictor::LateralState;

/// Errors are read this often [s]: faster than that they repeat themselves.
const READ_EVERY: f64 = 0.05;

/// Errors of a rollout over their standard deviations, and the derivatives of those.
#[derive(Clone, Debug, Default)]
pub struct RolloutErrors {
    /// v_y and yaw rate in turn.
    pub values: Vec<f64>,
    /// Derivatives of each.
    pub slopes: Vec<ParameterVector>,
}

/// Rows between two readings.
#[must_use]
pub fn reading_stride(step: f64) -> usize {
    ((READ_EVERY / step).round() as usize).max(1)
}

impl RolloutErrors {
    /// Of the rollout over `rows` rows from `start` with parameters `x`.
    #[must_use]
    pub fn new(
        driven: &DriveWithRates,
        car: &CarSpecification,
        x: &ParameterVector,
        start: usize,
        rows: usize,
        noise: LateralState,
    ) -> Self {
        let states = driven.simulate_states::<Dual>(car, x, start, rows);
        let stride = reading_stride(driven.drive.step);
        let mut errors = Self::default();
        for k in (stride..=rows).step_by(stride) {
            let measured = [driven.drive.motion.v_y[start + k], driven.drive.motion.r[start + k]];
            for (i, state) in states[k].iter().enumerate() {
                errors.values.push((state.re - measured[i]) / noise[i]);
                let slope = state.eps.0.map_or([0.0; COUNT], |along| std::array::from_fn(|p| along[p]));
                errors.slopes.push(slope.map(|slope| slope / noise[i]));
            }
        }
        errors
    }

    /// Means of the errors of v_y and yaw rate.
    #[must_use]
    pub fn mean_errors(&self) -> LateralState {
        let n = (self.values.len() / 2).max(1) as f64;
        let of = |i: usize| self.values.iter().skip(i).step_by(2).sum::<f64>() / n;
        [of(0), of(1)]
    }
}

/// A sum of costs to second order.
#[derive(Clone, Debug, PartialEq)]
pub struct SecondOrderCost {
    /// Cost.
    pub cost: f64,
    /// Its gradient.
    pub gradient: SVector<f64, COUNT>,
    /// Its second derivatives after Gauss and Newton.
    pub hessian: SMatrix<f64, COUNT, COUNT>,
}

impl Default for SecondOrderCost {
    fn default() -> Self {
        Self { cost: 0.0, gradient: SVector::zeros(), hessian: SMatrix::zeros() }
    }
}

impl SecondOrderCost {
    /// Of the errors of one rollout, each of which counts `weight` times.
    #[must_use]
    pub fn from_errors(errors: &RolloutErrors, loss: Loss, weight: f64) -> Self {
        let mut sum = Self::default();
        for (value, slope) in errors.values.iter().zip(&errors.slopes) {
            let weighted = weight * loss.weight(*value);
            sum.cost += weight * loss.cost(*value);
            for i in 0..COUNT {
                let pull = weighted * slope[i];
                sum.gradient[i] += pull * value;
                for (k, other) in slope[..=i].iter().enumerate() {
                    sum.hessian[(i, k)] += pull * other;
                }
            }
        }
        sum.hessian.fill_upper_triangle_with_lower_triangle();
        sum
    }

    /// The sum of two.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            cost: self.cost + other.cost,
            gradient: self.gradient + other.gradient,
            hessian: self.hessian + other.hessian,
        }
    }
}
