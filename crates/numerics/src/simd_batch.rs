//! Several plain numbers at once, one for each of as many parameter vectors: in a chain where each operation waits for the one
//! before, four of them take hardly longer than one.

use std::ops::{Add, Mul, Neg, Sub};

use crate::scalar::{Scalar, SmoothFunction};

/// How many there are.
pub const WIDTH: usize = 4;

/// A number for each parameter vector.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct SimdBatch(pub [f64; WIDTH]);

/// The same for each of them. Not a function of a closure: those are not always inlined into the code for wide vectors, and without it
/// a fused multiplication and addition is a call. Not a loop: to unroll thousands of them takes the compiler minutes.
macro_rules! each {
    ($index:ident => $number:expr) => {
        SimdBatch([
            each!($index = 0, $number),
            each!($index = 1, $number),
            each!($index = 2, $number),
            each!($index = 3, $number),
        ])
    };
    ($index:ident = $place:literal, $number:expr) => {{
        let $index = $place;
        $number
    }};
}

impl Neg for SimdBatch {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        each!(i => -self.0[i])
    }
}

impl Add for SimdBatch {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        each!(i => self.0[i] + other.0[i])
    }
}

impl Sub for SimdBatch {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        each!(i => self.0[i] - other.0[i])
    }
}

impl Mul for SimdBatch {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        each!(i => self.0[i] * other.0[i])
    }
}

impl Add<f64> for SimdBatch {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: f64) -> Self {
        each!(i => self.0[i] + other)
    }
}

impl Mul<f64> for SimdBatch {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        each!(i => self.0[i] * other)
    }
}

impl Scalar for SimdBatch {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self([value; WIDTH])
    }

    #[inline(always)]
    fn select_above(self, limit: f64, above: Self, other: Self) -> Self {
        each!(i => if self.0[i] > limit { above.0[i] } else { other.0[i] })
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        each!(i => a.0[i].mul_add(b.0[i], self.0[i]))
    }

    #[inline(always)]
    fn subtract_product(self, a: Self, b: Self) -> Self {
        each!(i => (-a.0[i]).mul_add(b.0[i], self.0[i]))
    }

    #[inline(always)]
    fn add_scaled(self, a: Self, b: f64) -> Self {
        each!(i => a.0[i].mul_add(b, self.0[i]))
    }

    #[inline(always)]
    fn apply_function<F: SmoothFunction<N, M>, const N: usize, const M: usize>(of: [&Self; N]) -> [Self; M] {
        let mut values = [Self([0.0; WIDTH]); M];
        for index in 0..WIDTH {
            let mut x = [0.0; N];
            for k in 0..N {
                x[k] = of[k].0[index];
            }
            let at = F::values(x);
            for m in 0..M {
                values[m].0[index] = at[m];
            }
        }
        values
    }

    #[inline(always)]
    fn recip(self) -> Self {
        each!(i => 1.0 / self.0[i])
    }

    #[inline(always)]
    fn atan(self) -> Self {
        each!(i => elementary::atan(self.0[i]))
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let pair = self.0.map(elementary::sin_cos);
        (each!(i => pair[i].0), each!(i => pair[i].1))
    }
}
