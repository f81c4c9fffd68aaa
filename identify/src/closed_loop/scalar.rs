//! Numbers that the prediction-error filter calculates with: plain ones, several at once ([`super::lanes`]), or
//! [`super::tangent`]s, which carry derivatives.
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

    /// `above` where this number is above a limit, elsewhere `other`; a branch would be the same for several numbers at once.
    fn where_above(self, limit: f64, above: Self, other: Self) -> Self;

    /// self + a b, where each of the sums is rounded together with its product.
    fn plus(self, a: Self, b: Self) -> Self;

    /// self − a b, in the same way.
    fn minus(self, a: Self, b: Self) -> Self;

    /// self + a b with a factor b that has no derivatives.
    fn plus_scaled(self, a: Self, b: f64) -> Self;

    /// Friction coefficient and its slope at a slip angle, for the parameters B, C, D and E.
    fn curve(tire: &[Self; 4], slip: Self) -> [Self; 2];

    /// 1 / x.
    fn recip(self) -> Self;

    /// Arc tangent.
    fn atan(self) -> Self;
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn where_above(self, limit: f64, above: Self, other: Self) -> Self {
        if self > limit { above } else { other }
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
        let [(value, _), (slope, _)] = value_and_slope(tire, slip);
        [value, slope]
    }

    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }

    #[inline(always)]
    fn atan(self) -> Self {
        elementary::atan(self)
    }
}
