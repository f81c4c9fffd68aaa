//! Weighs residuals: as squares, or so that outliers pull less.

use serde::{Deserialize, Serialize};

/// What a residual r [-] costs. Near r = 0 all of them are r²/2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Loss {
    /// r²/2: best for normal noise.
    #[default]
    Square,
    /// Linear beyond a threshold (Huber, Robust Estimation of a Location Parameter, 1964).
    Huber {
        /// Where the line begins, in the unit of the force column.
        threshold: f64,
    },
    /// Logarithmic, from Student's distribution: gross outliers lose their pull.
    StudentT {
        /// Degrees of freedom ν; below 5 or so heavy tails are expected.
        freedom: f64,
        /// Scale of the distribution, in the unit of the force column.
        scale: f64,
    },
}

impl Loss {
    /// Cost of a residual.
    #[inline(always)]
    pub fn cost(self, r: f64) -> f64 {
        match self {
            Self::Square => 0.5 * r * r,
            Self::Huber { threshold } => {
                let inner = r.abs().min(threshold);
                inner * (r.abs() - 0.5 * inner)
            }
            // A constant factor makes the curvature 1 at r = 0, as for the others.
            Self::StudentT { freedom, scale } => {
                let square = (r / scale).powi(2) / freedom;
                0.5 * freedom * scale * scale * elementary::ln_1p(square)
            }
        }
    }

    /// Derivative of the cost over the residual: the weight of an equivalent square.
    #[inline(always)]
    pub fn weight(self, r: f64) -> f64 {
        match self {
            Self::Square => 1.0,
            Self::Huber { threshold } => threshold / r.abs().max(threshold),
            Self::StudentT { freedom, scale } => 1.0 / (1.0 + (r / scale).powi(2) / freedom),
        }
    }

    /// Second derivative of the cost.
    pub fn curvature(self, r: f64) -> f64 {
        match self {
            Self::Square => 1.0,
            Self::Huber { threshold } => f64::from(r.abs() <= threshold),
            Self::StudentT { freedom, scale } => {
                let square = (r / scale).powi(2) / freedom;
                (1.0 - square) / (1.0 + square).powi(2)
            }
        }
    }

    /// What costs are divided by in −ln(likelihood), if the noise near 0 has a standard deviation: its variance, or for Student's
    /// distribution ν/(ν + 1) of the square of the scale. Huber's loss belongs to noise that is normal up to the threshold and
    /// exponential beyond.
    pub fn cost_divisor(self, noise_std: f64) -> f64 {
        match self {
            Self::StudentT { freedom, scale } => freedom / (freedom + 1.0) * scale * scale,
            _ => noise_std * noise_std,
        }
    }

    /// Whether its numbers make sense.
    pub fn is_valid(self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match self {
            Self::Square => true,
            Self::Huber { threshold } => positive(threshold),
            Self::StudentT { freedom, scale } => positive(freedom) && positive(scale),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn weight_and_curvature_are_derivatives_of_the_cost() {
        let step = 1e-5;
        let losses =
            [Loss::Square, Loss::Huber { threshold: 0.1 }, Loss::StudentT { freedom: 4.0, scale: 0.05 }];
        for loss in losses {
            for r in [-0.5, -0.12, -0.03, 0.02, 0.09, 0.4] {
                let slope = (loss.cost(r + step) - loss.cost(r - step)) / (2.0 * step);
                assert_relative_eq!(slope, loss.weight(r) * r, epsilon = 1e-9);
                let bend =
                    (loss.weight(r + step) * (r + step) - loss.weight(r - step) * (r - step)) / (2.0 * step);
                assert_relative_eq!(bend, loss.curvature(r), epsilon = 1e-6);
            }
        }
    }
}
