//! Names what the equations of the Magic Formula need of a number, so that several of them can stand side by side.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub};

use num_dual::DualNum;

/// What the equations calculate with: one [`Number`](crate::Number), or several plain ones side by side.
///
/// Several numbers take the same way through an equation, so a case is a choice between two values and not a branch.
pub trait Real:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + MulAssign
{
    /// The result of a comparison.
    type Mask: Copy;

    /// A constant of the same kind.
    fn constant_like(self, value: f64) -> Self;
    /// Whether it is smaller than another; false for what is no number.
    fn is_less_than(self, other: Self) -> Self::Mask;
    /// Whether it is this value.
    fn is_equal_to(self, value: f64) -> Self::Mask;
    /// Whether it is no number.
    fn is_not_a_number(self) -> Self::Mask;
    /// Whether a comparison holds anywhere.
    fn is_true_anywhere(self, truth: Self::Mask) -> bool;
    /// Whether it is this value everywhere and carries no derivative, so that a term which it switches off can be left out.
    fn is_exactly_constant(self, value: f64) -> bool;
    /// One value where a comparison holds, the other elsewhere.
    fn select(truth: Self::Mask, yes: Self, no: Self) -> Self;

    /// Absolute value.
    fn abs(self) -> Self;
    /// 1 / x.
    fn recip(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Power with a whole exponent.
    fn powi(self, exponent: i32) -> Self;
    /// Exponential.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Sine.
    fn sin(self) -> Self;
    /// Cosine.
    fn cos(self) -> Self;
    /// Sine and cosine of one number.
    fn sin_cos(self) -> (Self, Self);
    /// Tangent.
    fn tan(self) -> Self;
    /// Arc tangent.
    fn atan(self) -> Self;

    /// Arc tangents of independent numbers, which need not wait for one another.
    #[inline(always)]
    fn arctangents<const N: usize>(x: [Self; N]) -> [Self; N] {
        x.map(Self::atan)
    }
    /// Sines of independent numbers.
    #[inline(always)]
    fn sines<const N: usize>(x: [Self; N]) -> [Self; N] {
        x.map(Self::sin)
    }
    /// Cosines of independent numbers.
    #[inline(always)]
    fn cosines<const N: usize>(x: [Self; N]) -> [Self; N] {
        x.map(Self::cos)
    }
}

/// Calls the method of the same name of a dual number.
macro_rules! as_dual_number {
    ($($name:ident)*) => {
        $(#[inline(always)]
        fn $name(self) -> Self {
            DualNum::$name(&self)
        })*
    };
}

impl<T: DualNum<Primitive = f64> + Copy> Real for T {
    type Mask = bool;

    #[inline(always)]
    fn constant_like(self, value: f64) -> Self {
        T::from(value)
    }

    #[inline(always)]
    fn is_less_than(self, other: Self) -> bool {
        self.re() < other.re()
    }

    #[inline(always)]
    fn is_equal_to(self, value: f64) -> bool {
        self.re() == value
    }

    #[inline(always)]
    fn is_not_a_number(self) -> bool {
        self.re().is_nan()
    }

    #[inline(always)]
    fn is_true_anywhere(self, truth: bool) -> bool {
        truth
    }

    #[inline(always)]
    fn is_exactly_constant(self, value: f64) -> bool {
        T::NDERIV == 0 && self.re() == value
    }

    #[inline(always)]
    fn select(truth: bool, yes: Self, no: Self) -> Self {
        if truth { yes } else { no }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        signed::absolute_value(self)
    }

    #[inline(always)]
    fn powi(self, exponent: i32) -> Self {
        DualNum::powi(&self, exponent)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        DualNum::sin_cos(&self)
    }

    as_dual_number!(recip sqrt exp ln sin cos tan atan);
}

mod signed {
    /// Absolute value, where [`Real`](super::Real) is out of scope, which has a method of this name too.
    #[inline(always)]
    pub fn absolute_value<T: elementary::Number>(x: T) -> T {
        x.abs()
    }
}
