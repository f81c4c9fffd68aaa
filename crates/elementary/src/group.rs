//! Takes independent numbers through a function together: none of them waits for the end of another.
#![allow(
    clippy::needless_range_loop,
    reason = "closures are not always inlined into the code for wide vectors"
)]

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::ElementaryNumber;

/// `N` numbers that take the same way.
#[derive(Clone, Copy, Debug)]
pub struct NumberGroup<V, const N: usize>(pub [V; N]);

impl<V: ElementaryNumber, const N: usize> NumberGroup<V, N> {
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        Self([self.0[0].constant(value); N])
    }
}

macro_rules! operator {
    ($Trait:ident, $name:ident, $operator:tt) => {
        impl<V: ElementaryNumber, const N: usize> $Trait for NumberGroup<V, N> {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for i in 0..N {
                    self.0[i] = self.0[i] $operator other.0[i];
                }
                self
            }
        }
    };
}

operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

macro_rules! operator_with_constant {
    ($Trait:ident, $name:ident, $operator:tt) => {
        impl<V: ElementaryNumber, const N: usize> $Trait<f64> for NumberGroup<V, N> {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: f64) -> Self {
                for i in 0..N {
                    self.0[i] = self.0[i] $operator other;
                }
                self
            }
        }
    };
}

operator_with_constant!(Add, add, +);
operator_with_constant!(Sub, sub, -);
operator_with_constant!(Mul, mul, *);

impl<V: ElementaryNumber, const N: usize> Neg for NumberGroup<V, N> {
    type Output = Self;

    #[inline(always)]
    fn neg(mut self) -> Self {
        for i in 0..N {
            self.0[i] = -self.0[i];
        }
        self
    }
}

impl<V: ElementaryNumber, const N: usize> ElementaryNumber for NumberGroup<V, N> {
    type Mask = [V::Mask; N];

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        self.splat(value)
    }

    #[inline(always)]
    fn multiply_add(mut self, a: Self, b: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].multiply_add(a.0[i], b.0[i]);
        }
        self
    }

    #[inline(always)]
    fn is_above(self, limit: f64) -> Self::Mask {
        let mut truth = [self.0[0].is_above(limit); N];
        for i in 1..N {
            truth[i] = self.0[i].is_above(limit);
        }
        truth
    }

    #[inline(always)]
    fn select(truth: Self::Mask, mut yes: Self, no: Self) -> Self {
        for i in 0..N {
            yes.0[i] = V::select(truth[i], yes.0[i], no.0[i]);
        }
        yes
    }

    #[inline(always)]
    fn abs(mut self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].abs();
        }
        self
    }

    #[inline(always)]
    fn copysign(mut self, sign: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].copysign(sign.0[i]);
        }
        self
    }

    #[inline(always)]
    fn quadrant_masks(self) -> [Self::Mask; 3] {
        let [odd, sin, cos] = self.0[0].quadrant_masks();
        let mut all = [[odd; N], [sin; N], [cos; N]];
        for i in 1..N {
            let each = self.0[i].quadrant_masks();
            for k in 0..3 {
                all[k][i] = each[k];
            }
        }
        all
    }

    #[inline(always)]
    fn power_of_two(mut self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].power_of_two();
        }
        self
    }

    #[inline(always)]
    fn split_exponent(mut self) -> (Self, Self) {
        let mut rest = self;
        for i in 0..N {
            (self.0[i], rest.0[i]) = self.0[i].split_exponent();
        }
        (self, rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{atan, exp, ln, sin_cos};

    #[test]
    fn a_group_has_the_values_of_each() {
        let x = [0.3, 7.0, 1e-9];
        let group = NumberGroup(x);
        assert_eq!(atan(group).0, x.map(atan));
        assert_eq!(exp(group).0, x.map(exp));
        assert_eq!(ln(group).0, x.map(ln));
        let (sin, cos) = sin_cos(-group);
        assert_eq!(sin.0, x.map(|x| sin_cos(-x).0));
        assert_eq!(cos.0, x.map(|x| sin_cos(-x).1));
    }
}
