//! Describes the road under a single-track car: friction of each axle, and slopes.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use serde::{Deserialize, Serialize};

use tire::Number;

use crate::body::G;

/// The road under the car.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoadConditions<T = f64> {
    /// Friction under each axle, relative to the one that the tires were measured on [-].
    pub mu: [T; 2],
    /// Slope along the car's x axis [rad], positive uphill.
    pub grade: T,
    /// Slope along the car's y axis [rad], positive while the left side is higher.
    pub bank: T,
}

impl<T: Number> Default for RoadConditions<T> {
    fn default() -> Self {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        Self { mu: [one; 2], grade: zero, bank: zero }
    }
}

impl<T: Number> RoadConditions<T> {
    /// Share of the weight that presses on the road [-], and the accelerations down the slopes along x and y [m/s²].
    #[inline]
    pub fn gravity_components(&self) -> (T, [T; 2]) {
        let (sin_grade, cos_grade) = self.grade.sin_cos();
        let (sin_bank, cos_bank) = self.bank.sin_cos();
        (cos_grade * cos_bank, [sin_grade * G, sin_bank * cos_grade * G])
    }
}
