//! Numbers that the prediction-error filter calculates with: plain ones, or [`super::tangent`]s, which carry derivatives.
//!
//! All sums of products are fused, as one rounding each, on every machine alike.

use std::ops::{Add, Mul, Neg, Sub};

use crate::kernel::{elementary, value_and_slope};

/// A number of the filter.
pub trait Scalar:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Add<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// A number of the same kind without derivatives.
    fn constant(self, value: f64) -> Self;

    /// The number itself.
    fn value(self) -> f64;

    /// A function of this number, given its value and slope there.
    fn chain(self, value: f64, slope: f64) -> Self;

    /// self + a b, where each of the sums is rounded together with its product.
    fn plus(self, a: Self, b: Self) -> Self;

    /// self − a b, in the same way.
    fn minus(self, a: Self, b: Self) -> Self;

    /// self + a b with a factor b that has no derivatives.
    fn plus_scaled(self, a: Self, b: f64) -> Self;

    /// Friction coefficient and its slope at a slip angle, for the parameters B, C, D and E.
    fn curve(tire: &[Self; 4], slip: Self) -> [Self; 2];

    /// 1 / x.
    #[inline(always)]
    fn recip(self) -> Self {
        let inverse = 1.0 / self.value();
        self.chain(inverse, -inverse * inverse)
    }

    /// Arc tangent.
    #[inline(always)]
    fn atan(self) -> Self {
        let x = self.value();
        self.chain(elementary::atan(x), 1.0 / (1.0 + x * x))
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn chain(self, value: f64, _slope: f64) -> Self {
        value
    }

    #[inline(always)]
    fn plus(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }

    #[inline(always)]
    fn minus(self, a: Self, b: Self) -> Self {
        (-a).mul_add(b, self)
    }

    #[inline(always)]
    fn plus_scaled(self, a: Self, b: f64) -> Self {
        a.mul_add(b, self)
    }

    #[inline(always)]
    fn curve(tire: &[Self; 4], slip: Self) -> [Self; 2] {
        value_and_slope(tire, slip).map(|(value, _)| value)
    }
}
