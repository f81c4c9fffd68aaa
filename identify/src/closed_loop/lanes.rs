//! Several plain numbers at once, one for each of as many parameter vectors: a filter step is a chain in which each operation waits
//! for the one before, so that four vectors' worth of them take hardly longer than one.

use std::ops::{Add, Mul, Neg, Sub};

use super::scalar::Scalar;
use crate::kernel::{elementary, value_and_slope};

/// How many there are.
pub const LANES: usize = 4;

/// A number for each parameter vector.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Lanes(pub [f64; LANES]);

/// The same for each lane. Not a function of a closure: those are not always inlined into the code for wide vectors, and without it
/// a fused multiplication and addition is a call.
macro_rules! each {
    ($like:expr, $lane:ident => $number:expr) => {{
        let mut all = $like;
        for $lane in 0..LANES {
            all.0[$lane] = $number;
        }
        all
    }};
}

impl Neg for Lanes {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        each!(self, i => -self.0[i])
    }
}

impl Add for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        each!(self, i => self.0[i] + other.0[i])
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        each!(self, i => self.0[i] - other.0[i])
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        each!(self, i => self.0[i] * other.0[i])
    }
}

impl Add<f64> for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: f64) -> Self {
        each!(self, i => self.0[i] + other)
    }
}

impl Mul<f64> for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        each!(self, i => self.0[i] * other)
    }
}

impl Scalar for Lanes {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn where_above(self, limit: f64, above: Self, other: Self) -> Self {
        each!(self, i => if self.0[i] > limit { above.0[i] } else { other.0[i] })
    }

    #[inline(always)]
    fn plus(self, a: Self, b: Self) -> Self {
        each!(self, i => a.0[i].mul_add(b.0[i], self.0[i]))
    }

    #[inline(always)]
    fn minus(self, a: Self, b: Self) -> Self {
        each!(self, i => (-a.0[i]).mul_add(b.0[i], self.0[i]))
    }

    #[inline(always)]
    fn plus_scaled(self, a: Self, b: f64) -> Self {
        each!(self, i => a.0[i].mul_add(b, self.0[i]))
    }

    #[inline(always)]
    fn curve([B, C, D, E]: &[Self; 4], slip: Self) -> [Self; 2] {
        let (mut value, mut slope) = (slip, slip);
        for i in 0..LANES {
            let tire = [B.0[i], C.0[i], D.0[i], E.0[i]];
            let [at, by] = value_and_slope(&tire, slip.0[i]);
            (value.0[i], slope.0[i]) = (at.0, by.0);
        }
        [value, slope]
    }

    #[inline(always)]
    fn recip(self) -> Self {
        each!(self, i => 1.0 / self.0[i])
    }

    #[inline(always)]
    fn atan(self) -> Self {
        each!(self, i => elementary::atan(self.0[i]))
    }
}
