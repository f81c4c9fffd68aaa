//! Numbers that the prediction-error filter calculates with: plain ones, or ones that carry a fixed number of derivatives.
//!
//! A filter step is some five hundred products; with derivatives in an array of fixed length the compiler calculates several at
//! once, which number types that serve any length do not reach.

use std::ops::{Add, Mul, Neg, Sub};

use crate::kernel::elementary;
use crate::kernel::value_and_gradient;

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
    /// A number without derivatives.
    fn constant(value: f64) -> Self;

    /// The number itself.
    fn value(self) -> f64;

    /// A function of this number, given its value and slope there.
    fn chain(self, value: f64, slope: f64) -> Self;

    /// Friction coefficient at a slip angle, for the parameters B, C, D and E.
    fn coefficient(tire: &[Self; 4], slip: Self) -> Self;

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

    /// Sine and cosine.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = elementary::sin_cos(self.value());
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
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
    fn coefficient(&[B, C, D, E]: &[Self; 4], slip: Self) -> Self {
        crate::kernel::value(&[B, C, D, E, 0.0, 0.0], slip)
    }
}

/// A number with its derivatives along `L` directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent<const L: usize> {
    /// The number.
    pub value: f64,
    /// Its derivatives.
    pub along: [f64; L],
}

impl<const L: usize> Tangent<L> {
    /// The quantity that a direction changes, at the given rate.
    pub fn seed(value: f64, direction: usize, rate: f64) -> Self {
        let mut along = [0.0; L];
        along[direction] = rate;
        Self { value, along }
    }

    #[inline(always)]
    fn zip(value: f64, lane: impl Fn(usize) -> f64) -> Self {
        let mut along = [0.0; L];
        for (l, along) in along.iter_mut().enumerate() {
            *along = lane(l);
        }
        Self { value, along }
    }
}

impl<const L: usize> Neg for Tangent<L> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::zip(-self.value, |l| -self.along[l])
    }
}

impl<const L: usize> Add for Tangent<L> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::zip(self.value + other.value, |l| self.along[l] + other.along[l])
    }
}

impl<const L: usize> Sub for Tangent<L> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::zip(self.value - other.value, |l| self.along[l] - other.along[l])
    }
}

impl<const L: usize> Mul for Tangent<L> {
    type Output = Self;

    #[allow(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::zip(self.value * other.value, |l| {
            self.along[l] * other.value + self.value * other.along[l]
        })
    }
}

impl<const L: usize> Add<f64> for Tangent<L> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, along: self.along }
    }
}

impl<const L: usize> Mul<f64> for Tangent<L> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self::zip(self.value * other, |l| self.along[l] * other)
    }
}

impl<const L: usize> Scalar for Tangent<L> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value, along: [0.0; L] }
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        Self::zip(value, |l| self.along[l] * slope)
    }

    #[inline(always)]
    fn coefficient(tire: &[Self; 4], slip: Self) -> Self {
        let [B, C, D, E] = *tire;
        let theta = [B.value, C.value, D.value, E.value, 0.0, 0.0];
        let (value, by) = value_and_gradient(&theta, slip.value);
        Self::zip(value, |l| {
            by[0] * B.along[l]
                + by[1] * C.along[l]
                + by[2] * D.along[l]
                + by[3] * E.along[l]
                + by[4] * slip.along[l]
        })
    }
}
