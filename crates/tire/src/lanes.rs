//! Calculates with several numbers side by side, one for each of as many wheels, in the vectors of the processor.

use std::fmt;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub};

use elementary::{ElementaryNumber, NumberGroup, ROUND};
use pulp::{Simd, bytemuck};

use crate::real::Real;

/// As many numbers side by side as the vectors of `S` hold.
///
/// All processors give the same bits.
#[derive(Clone, Copy)]
pub(crate) struct SimdLanes<S: Simd> {
    values: S::f64s,
    simd: S,
}

impl<S: Simd> SimdLanes<S> {
    /// The number of each place.
    #[inline(always)]
    pub fn new(simd: S, number: impl Fn(usize) -> f64) -> Self {
        let mut values = simd.splat_f64s(0.0);
        let places = bytemuck::cast_slice_mut::<S::f64s, f64>(std::slice::from_mut(&mut values));
        for (i, place) in places.iter_mut().enumerate() {
            *place = number(i);
        }
        Self { values, simd }
    }

    /// The numbers by their places.
    #[inline(always)]
    pub fn lane_values(&self) -> &[f64] {
        bytemuck::cast_slice(std::slice::from_ref(&self.values))
    }

    #[inline(always)]
    fn with_values(self, values: S::f64s) -> Self {
        Self { values, ..self }
    }

    #[inline(always)]
    fn map_lanes(self, number: impl Fn(f64) -> f64) -> Self {
        let places = self.lane_values();
        Self::new(self.simd, |i| number(places[i]))
    }
}

/// The nearest whole number, of which there are two in the middle: the even one.
#[inline(always)]
fn round_half_to_even<S: Simd>(x: SimdLanes<S>) -> SimdLanes<S> {
    (x + ROUND) - ROUND
}

impl<S: Simd> fmt::Debug for SimdLanes<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lane_values().fmt(f)
    }
}

macro_rules! operator {
    ($Trait:ident, $name:ident, $vector:ident) => {
        impl<S: Simd> $Trait for SimdLanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.with_values(self.simd.$vector(self.values, other.values))
            }
        }

        impl<S: Simd> $Trait<f64> for SimdLanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                self.with_values(self.simd.$vector(self.values, self.simd.splat_f64s(other)))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for SimdLanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.with_values(self.simd.neg_f64s(self.values))
    }
}

impl<S: Simd> AddAssign for SimdLanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> MulAssign for SimdLanes<S> {
    #[inline(always)]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<S: Simd> ElementaryNumber for SimdLanes<S> {
    type Mask = S::m64s;

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        self.with_values(self.simd.splat_f64s(value))
    }

    // Fused on all processors alike.
    #[inline(always)]
    fn multiply_add(self, a: Self, b: Self) -> Self {
        self.with_values(self.simd.mul_add_f64s(self.values, a.values, b.values))
    }

    #[inline(always)]
    fn is_above(self, limit: f64) -> S::m64s {
        self.simd.greater_than_f64s(self.values, self.simd.splat_f64s(limit))
    }

    #[inline(always)]
    fn select(truth: S::m64s, yes: Self, no: Self) -> Self {
        yes.with_values(yes.simd.select_f64s(truth, yes.values, no.values))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.with_values(self.simd.abs_f64s(self.values))
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let simd = self.simd;
        let only = simd.splat_u64s(1 << 63);
        let signs = simd.and_u64s(simd.transmute_u64s_f64s(sign.values), only);
        let size = simd.transmute_u64s_f64s(simd.abs_f64s(self.values));
        self.with_values(simd.transmute_f64s_u64s(simd.or_u64s(size, signs)))
    }

    #[inline(always)]
    fn quadrant_masks(self) -> [S::m64s; 3] {
        let k = self - ROUND;
        let half = k * 0.5;
        let odd = ElementaryNumber::abs(half - round_half_to_even(half)).is_above(0.25);
        // Of the turn that it is past a whole one: from −½ to ½.
        let turn = k * 0.25 - round_half_to_even(k * 0.25);
        let far = ElementaryNumber::abs(turn).is_above(0.375);
        let (ahead, behind) = (turn.is_above(0.125), (-turn).is_above(0.125));
        [odd, self.simd.or_m64s(far, behind), self.simd.or_m64s(far, ahead)]
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.map_lanes(ElementaryNumber::power_of_two)
    }

    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        (self.map_lanes(|x| x.split_exponent().0), self.map_lanes(|x| x.split_exponent().1))
    }
}

impl<S: Simd> Real for SimdLanes<S> {
    type Mask = S::m64s;

    #[inline(always)]
    fn constant_like(self, value: f64) -> Self {
        ElementaryNumber::constant(self, value)
    }

    #[inline(always)]
    fn is_less_than(self, other: Self) -> S::m64s {
        self.simd.less_than_f64s(self.values, other.values)
    }

    #[inline(always)]
    fn is_equal_to(self, value: f64) -> S::m64s {
        self.simd.equal_f64s(self.values, self.simd.splat_f64s(value))
    }

    #[inline(always)]
    fn is_not_a_number(self) -> S::m64s {
        self.simd.not_m64s(self.simd.equal_f64s(self.values, self.values))
    }

    #[inline(always)]
    fn is_true_anywhere(self, truth: S::m64s) -> bool {
        self.simd.first_true_m64s(truth) < S::F64_LANES
    }

    #[inline(always)]
    fn is_exactly_constant(self, value: f64) -> bool {
        !self.is_true_anywhere(self.simd.not_m64s(Real::is_equal_to(self, value)))
    }

    #[inline(always)]
    fn select(truth: S::m64s, yes: Self, no: Self) -> Self {
        ElementaryNumber::select(truth, yes, no)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        ElementaryNumber::abs(self)
    }

    #[inline(always)]
    fn recip(self) -> Self {
        ElementaryNumber::constant(self, 1.0) / self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.with_values(self.simd.sqrt_f64s(self.values))
    }

    #[inline(always)]
    fn powi(self, exponent: i32) -> Self {
        let mut power = self;
        for _ in 1..exponent {
            power *= self;
        }
        power
    }

    #[inline(always)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        elementary::ln(self)
    }

    #[inline(always)]
    fn sin(self) -> Self {
        elementary::sin(self)
    }

    #[inline(always)]
    fn cos(self) -> Self {
        elementary::cos(self)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }

    #[inline(always)]
    fn tan(self) -> Self {
        let (sin, cos) = Real::sin_cos(self);
        sin / cos
    }

    #[inline(always)]
    fn atan(self) -> Self {
        elementary::atan(self)
    }

    #[inline(always)]
    fn arctangents<const N: usize>(x: [Self; N]) -> [Self; N] {
        elementary::atan(NumberGroup(x)).0
    }

    #[inline(always)]
    fn sines<const N: usize>(x: [Self; N]) -> [Self; N] {
        elementary::sin(NumberGroup(x)).0
    }

    #[inline(always)]
    fn cosines<const N: usize>(x: [Self; N]) -> [Self; N] {
        elementary::cos(NumberGroup(x)).0
    }
}
