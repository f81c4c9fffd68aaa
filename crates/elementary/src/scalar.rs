//! Names the scalars of an algorithm: plain, several at once (`SimdBatch`), or with derivatives (`Tangent`, [`DualSVec64`]).
//!
//! Sums of products of `f64`, `SimdBatch` and `Tangent` are fused, as one rounding each, on every machine alike, and their functions
//! are those of this crate.

use std::ops::{Add, Mul, Neg, Sub};

use num_dual::{DualNum, DualSVec64};

/// The value of a function of `N` numbers, and its derivatives with respect to each.
pub type ValueAndDerivatives<const N: usize> = (f64, [f64; N]);

/// `M` smooth functions of `N` numbers. A type and not a closure: those are not always inlined into the code for wide vectors.
pub trait SmoothFunction<const N: usize, const M: usize> {
    /// Their values alone.
    fn values(x: [f64; N]) -> [f64; M];

    /// Their values and derivatives.
    fn values_and_derivatives(x: [f64; N]) -> [ValueAndDerivatives<N>; M];
}

/// A scalar to calculate with.
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
    fn select_above(self, limit: f64, above: Self, other: Self) -> Self;

    /// self + a b, where each of the sums is rounded together with its product.
    fn add_product(self, a: Self, b: Self) -> Self;

    /// self − a b, in the same way.
    fn subtract_product(self, a: Self, b: Self) -> Self;

    /// self + a b with a factor b that has no derivatives.
    fn add_scaled(self, a: Self, b: f64) -> Self;

    /// Functions of several numbers, by the chain rule.
    fn apply_function<F: SmoothFunction<N, M>, const N: usize, const M: usize>(of: [&Self; N]) -> [Self; M];

    /// 1 / x.
    fn recip(self) -> Self;

    /// Arc tangent.
    fn atan(self) -> Self;

    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn select_above(self, limit: f64, above: Self, other: Self) -> Self {
        if self > limit { above } else { other }
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }

    #[inline(always)]
    fn subtract_product(self, a: Self, b: Self) -> Self {
        (-a).mul_add(b, self)
    }

    #[inline(always)]
    fn add_scaled(self, a: Self, b: f64) -> Self {
        a.mul_add(b, self)
    }

    #[inline(always)]
    fn apply_function<F: SmoothFunction<N, M>, const N: usize, const M: usize>(of: [&Self; N]) -> [Self; M] {
        let mut x = [0.0; N];
        for k in 0..N {
            x[k] = *of[k];
        }
        F::values(x)
    }

    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }

    #[inline(always)]
    fn atan(self) -> Self {
        crate::atan(self)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        crate::sin_cos(self)
    }
}

/// Derivatives along as many directions as one likes, with functions of the standard library; sums of products are not fused.
impl<const D: usize> Scalar for DualSVec64<D> {
    fn constant(self, value: f64) -> Self {
        Self::from(value)
    }

    fn select_above(self, limit: f64, above: Self, other: Self) -> Self {
        if self.re > limit { above } else { other }
    }

    fn add_product(self, a: Self, b: Self) -> Self {
        self + a * b
    }

    fn subtract_product(self, a: Self, b: Self) -> Self {
        self - a * b
    }

    fn add_scaled(self, a: Self, b: f64) -> Self {
        self + a * b
    }

    fn apply_function<F: SmoothFunction<N, M>, const N: usize, const M: usize>(of: [&Self; N]) -> [Self; M] {
        let x = of.map(|it| it.re);
        F::values_and_derivatives(x)
            .map(|(value, by)| (0..N).fold(Self::from(value), |sum, k| sum + (*of[k] - x[k]) * by[k]))
    }

    fn recip(self) -> Self {
        DualNum::recip(&self)
    }

    fn atan(self) -> Self {
        DualNum::atan(&self)
    }

    fn sin_cos(self) -> (Self, Self) {
        DualNum::sin_cos(&self)
    }
}
