//! Computes arc tangent, sine, cosine, exponential and logarithm without branches, so that the compiler calculates several at once.
//!
//! The polynomials interpolate in Chebyshev nodes (computed with 60 digits, remainder below 2e-17) on the reduced range. There
//! is no fused multiply-add on an `f64` on purpose: all instruction sets give the same bits.

#![forbid(unsafe_code)]

mod group;
mod number;
pub mod scalar;

pub use group::NumberGroup;
pub use number::Number;

use std::f64::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, LOG2_E};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// π/2 minus its nearest double.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;
/// π/2 to 33 bits: its product with a small integer is exact.
const FRAC_PI_2_HIGH: f64 = 1.570_796_326_734_125_6;
/// π/2 minus the 33 bits, as a double.
const FRAC_PI_2_LOW: f64 = 6.077_100_506_506_192e-11;
/// Added and subtracted, it rounds to the nearest integer, which then stands in the lowest bits.
pub const ROUND: f64 = 6_755_399_441_055_744.0;

/// tan(π/8) and tan(3π/8): between them (t − 1)/(t + 1) is the smallest reduced argument, above them −1/t.
const TAN_PI_8: f64 = 0.414_213_562_373_095_05;
const TAN_3PI_8: f64 = 2.414_213_562_373_095;

/// (atan z − z)/z³ in z², |z| ≤ tan(π/8).
const ATAN: [f64; 11] = [
    -0.333_333_333_333_333_3,
    0.199_999_999_999_955_2,
    -0.142_857_142_846_665_42,
    0.111_111_110_152_563_61,
    -0.090_909_045_781_239_03,
    0.076_921_831_908_260_87,
    -0.066_645_114_473_819_48,
    0.058_581_489_128_022_1,
    -0.050_854_497_379_402_6,
    0.039_231_658_295_587_19,
    -0.019_176_887_119_062_26,
];
/// (sin r − r)/r³ in r², |r| ≤ π/4.
const SIN: [f64; 6] = [
    -0.166_666_666_666_666_66,
    0.008_333_333_333_330_948,
    -0.000_198_412_698_367_585_74,
    2.755_731_610_255_244e-6,
    -2.505_113_184_500_362_4e-8,
    1.591_812_929_486_660_8e-10,
];
/// (sin r − r)/r³ in r², |r| ≤ π/2.
const WIDE_SIN: [f64; 8] = [
    -0.166_666_666_666_666_66,
    0.008_333_333_333_333_316,
    -0.000_198_412_698_412_549_66,
    2.755_731_921_916_083_3e-06,
    -2.505_210_761_669_045e-08,
    1.605_897_729_264_274_3e-10,
    -7.643_969_663_988_074e-13,
    2.731_436_876_937_989_3e-15,
];
/// (cos r − 1 + r²/2)/r⁴ in r², |r| ≤ π/4.
const COS: [f64; 6] = [
    0.041_666_666_666_666_664,
    -0.001_388_888_888_888_739_8,
    2.480_158_729_876_569e-5,
    -2.755_731_727_172_979_3e-7,
    2.087_614_626_840_32e-9,
    -1.138_263_242_552_171_7e-11,
];

/// (atanh f − f)/f³ in f², |f| ≤ (√2 − 1)/(√2 + 1): Taylor's series.
const ATANH: [f64; 11] = [
    1.0 / 3.0,
    1.0 / 5.0,
    1.0 / 7.0,
    1.0 / 9.0,
    1.0 / 11.0,
    1.0 / 13.0,
    1.0 / 15.0,
    1.0 / 17.0,
    1.0 / 19.0,
    1.0 / 21.0,
    1.0 / 23.0,
];
/// (exp r − 1 − r)/r² in r, |r| ≤ ln 2 / 2.
const EXP: [f64; 11] = [
    0.5,
    0.166_666_666_666_666_7,
    0.041_666_666_666_666_67,
    0.008_333_333_333_326_136,
    0.001_388_888_888_888_374_8,
    0.000_198_412_698_748_206_27,
    2.480_158_732_554_774_3e-5,
    2.755_725_540_020_642_2e-6,
    2.755_727_364_311_03e-7,
    2.510_521_700_472_074_5e-8,
    2.091_468_696_808_687_6e-9,
];
/// ln 2 to 32 bits, and the rest: the product of the first with an exponent is exact.
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// A number that the functions take: an `f64`, or several side by side.
pub trait ElementaryNumber:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// The result of a comparison.
    type Mask: Copy;

    /// A constant of the same kind.
    fn constant(self, value: f64) -> Self;
    /// self a + b, which may be rounded once or twice.
    fn multiply_add(self, a: Self, b: Self) -> Self;
    /// Whether it is larger than a limit.
    fn is_above(self, limit: f64) -> Self::Mask;
    /// One value where a comparison holds, the other elsewhere.
    fn select(truth: Self::Mask, yes: Self, no: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// This number with the sign of another.
    fn copysign(self, sign: Self) -> Self;
    /// Of a count of quarter turns plus [`ROUND`]: whether it is odd, and whether sine and cosine are negative there.
    fn quadrant_masks(self) -> [Self::Mask; 3];
    /// 2^k of a whole number k from −1022 to 1023.
    fn power_of_two(self) -> Self;
    /// A positive normal number as k and m, 2^k m, with m from the root of ½ to that of 2.
    fn split_exponent(self) -> (Self, Self);
}

impl ElementaryNumber for f64 {
    type Mask = bool;

    #[inline(always)]
    fn constant(self, value: f64) -> f64 {
        value
    }

    // Not fused: without an instruction for it, it would be a call.
    #[inline(always)]
    fn multiply_add(self, a: f64, b: f64) -> f64 {
        self * a + b
    }

    #[inline(always)]
    fn is_above(self, limit: f64) -> bool {
        self > limit
    }

    #[inline(always)]
    fn select(truth: bool, yes: f64, no: f64) -> f64 {
        if truth { yes } else { no }
    }

    #[inline(always)]
    fn abs(self) -> f64 {
        self.abs()
    }

    #[inline(always)]
    fn copysign(self, sign: f64) -> f64 {
        self.copysign(sign)
    }

    #[inline(always)]
    fn quadrant_masks(self) -> [bool; 3] {
        let bits = self.to_bits();
        [bits & 1 != 0, bits & 2 != 0, (bits + 1) & 2 != 0]
    }

    #[inline(always)]
    fn power_of_two(self) -> f64 {
        f64::from_bits(((self + ROUND).to_bits() + 1023) << 52)
    }

    #[inline(always)]
    fn split_exponent(self) -> (f64, f64) {
        /// Bits of the root of ½.
        const ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
        const ONE: u64 = 0x3ff0_0000_0000_0000;
        /// 2^52, whose lowest bits count ones.
        const COUNTER: u64 = 0x4330_0000_0000_0000;
        let shifted = self.to_bits().wrapping_add(ONE - ROOT);
        let k = f64::from_bits(COUNTER | (shifted >> 52)) - f64::from_bits(COUNTER) - 1023.0;
        (k, f64::from_bits((shifted & 0x000f_ffff_ffff_ffff) + ROOT))
    }
}

/// Even and odd powers apart: half as many additions wait for each other.
#[inline(always)]
fn polynomial<V: ElementaryNumber, const N: usize>(coefficients: &[f64; N], t: V) -> V {
    let square = t * t;
    let (mut even, mut odd) = (t.constant(0.0), t.constant(0.0));
    for k in (0..N).rev() {
        if k % 2 == 0 {
            even = even.multiply_add(square, t.constant(coefficients[k]));
        } else {
            odd = odd.multiply_add(square, t.constant(coefficients[k]));
        }
    }
    odd.multiply_add(t, even)
}

// No closures in these functions: they are not always inlined into the code for wide vectors.

/// atan x, to 1.5 units in the last place.
#[inline(always)]
pub fn atan<V: ElementaryNumber>(x: V) -> V {
    let t = x.abs();
    let middle = t.is_above(TAN_PI_8);
    let far = t.is_above(TAN_3PI_8);
    let (zero, one) = (x.constant(0.0), x.constant(1.0));
    let numerator = V::select(far, -one, V::select(middle, t - 1.0, t));
    let denominator = V::select(far, t, V::select(middle, t + 1.0, one));
    let z = numerator / denominator;
    let (half, quarter) = (x.constant(FRAC_PI_2), x.constant(FRAC_PI_4));
    let offset = V::select(far, half, V::select(middle, quarter, zero));
    // A quarter turn is half of a half one, its rest too.
    let rest = offset * (FRAC_PI_2_REST / FRAC_PI_2);
    let square = z * z;
    let small = z * square * polynomial(&ATAN, square) + rest;
    (offset + (z + small)).copysign(x)
}

/// sin x and cos x, to 1.5 units in the last place of 1, for |x| below 1e5.
#[inline(always)]
pub fn sin_cos<V: ElementaryNumber>(x: V) -> (V, V) {
    let rounded = x * FRAC_2_PI + ROUND;
    let [odd, sin_negative, cos_negative] = rounded.quadrant_masks();
    let k = rounded - ROUND;
    let r = (x - k * FRAC_PI_2_HIGH) - k * FRAC_PI_2_LOW;
    let square = r * r;
    let sin = r + r * square * polynomial(&SIN, square);
    let cos = -(square * 0.5) + 1.0 + square * square * polynomial(&COS, square);
    let (s, c) = (V::select(odd, cos, sin), V::select(odd, sin, cos));
    (V::select(sin_negative, -s, s), V::select(cos_negative, -c, c))
}

/// sin x alone, to 1.5 units in the last place of 1, for |x| below 1e5: half the work of [`sin_cos`].
#[inline(always)]
pub fn sin<V: ElementaryNumber>(x: V) -> V {
    let rounded = x * FRAC_1_PI + ROUND;
    let k = rounded - ROUND;
    quarter_turn_sine(x, k * 2.0, rounded)
}

/// cos x alone, to 1.5 units in the last place of 1, for |x| below 1e5: cos x = −sin(x − (2k + 1) π/2) for even k.
#[inline(always)]
pub fn cos<V: ElementaryNumber>(x: V) -> V {
    let rounded = x * FRAC_1_PI - 0.5 + ROUND;
    let k = rounded - ROUND;
    -quarter_turn_sine(x, k * 2.0 + 1.0, rounded)
}

/// Sine of what is left of x after `quarters` quarter turns, with the sign of half a turn if the count is odd.
#[inline(always)]
fn quarter_turn_sine<V: ElementaryNumber>(x: V, quarters: V, count: V) -> V {
    let [odd, ..] = count.quadrant_masks();
    let r = (x - quarters * FRAC_PI_2_HIGH) - quarters * FRAC_PI_2_LOW;
    let square = r * r;
    let sin = (r * square).multiply_add(polynomial(&WIDE_SIN, square), r);
    V::select(odd, -sin, sin)
}

/// exp x, to 2 units in the last place.
#[inline(always)]
pub fn exp<V: ElementaryNumber>(x: V) -> V {
    // Beyond these the result is 0 or infinite.
    let x = V::select(x.is_above(710.0), x.constant(710.0), x);
    let x = V::select((-x).is_above(746.0), x.constant(-746.0), x);
    let k = (x * LOG2_E + ROUND) - ROUND;
    let r = (x - k * LN_2_HIGH) - k * LN_2_LOW;
    let value = r + r * r * polynomial(&EXP, r) + 1.0;
    // 2^k in two factors: one alone is too large for a double where the result is not.
    let half = (k * 0.5 + ROUND) - ROUND;
    value * half.power_of_two() * (k - half).power_of_two()
}

/// ln x of normal x > 0, to 2 units in the last place; NaN for infinity and NaN.
#[inline(always)]
pub fn ln<V: ElementaryNumber>(x: V) -> V {
    ln_plus(x, x.constant(0.0)) + x * 0.0
}

/// ln(1 + x) of finite x ≥ 0, to 2 units in the last place.
#[inline(always)]
pub fn ln_1p<V: ElementaryNumber>(x: V) -> V {
    let u = x + 1.0;
    ln_plus(u, (x - (u - 1.0)) / u)
}

/// ln u + low, for a small `low`.
#[inline(always)]
fn ln_plus<V: ElementaryNumber>(u: V, low: V) -> V {
    let (k, reduced) = u.split_exponent();
    let excess = reduced - 1.0;
    let f = excess / (excess + 2.0);
    let square = f * f;
    // ln((1 + f)/(1 − f)) = 2f + f (s − …) in the form that keeps the last bits (Tang 1990): excess − f (excess − rest).
    let rest = square * 2.0 * polynomial(&ATANH, square);
    let low = k * LN_2_LOW + low;
    k * LN_2_HIGH + (excess - (f * (excess - rest) - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance in units in the last place of the true value, or of `least` if that is larger.
    fn ulps(value: f64, truth: f64, least: f64) -> f64 {
        let size = truth.abs().max(least);
        (value - truth).abs() / (f64::from_bits(size.to_bits() + 1) - size)
    }

    #[test]
    fn arc_tangent_agrees_with_the_standard_library() {
        let mut worst = 0.0_f64;
        for i in 1..400_000 {
            let x = 1.000_05_f64.powi(i - 200_000) * 1.37;
            worst = worst.max(ulps(atan(x), x.atan(), 0.0)).max(ulps(atan(-x), -x.atan(), 0.0));
        }
        assert!(worst <= 2.0, "{worst} ulp");
        assert_eq!(atan(0.0), 0.0);
        assert_eq!(atan(f64::INFINITY), FRAC_PI_2);
        assert!(atan(f64::NAN).is_nan());
    }

    #[test]
    fn logarithm_agrees_with_the_standard_library() {
        let mut worst = 0.0_f64;
        for i in 0..400_000 {
            let x = 1.000_2_f64.powi(i - 300_000);
            worst = worst.max(ulps(ln_1p(x), x.ln_1p(), 0.0));
        }
        assert!(worst <= 3.0, "{worst} ulp");
        assert_eq!(ln_1p(0.0), 0.0);
        assert!(ln_1p(f64::NAN).is_nan());
        let mut worst = 0.0_f64;
        for i in 0..400_000 {
            let x = 1.003_f64.powi(i - 200_000);
            if x.is_normal() {
                worst = worst.max(ulps(ln(x), x.ln(), 0.0));
            }
        }
        assert!(worst <= 3.0, "{worst} ulp");
        assert_eq!(ln(1.0), 0.0);
        assert!(ln(f64::NAN).is_nan() && ln(f64::INFINITY).is_nan());
    }

    #[test]
    fn exponential_agrees_with_the_standard_library() {
        let mut worst = 0.0_f64;
        for i in -200_000..200_000 {
            let x = f64::from(i) * 3.5e-3;
            worst = worst.max(ulps(exp(x), x.exp(), f64::MIN_POSITIVE));
        }
        assert!(worst <= 2.0, "{worst} ulp");
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(1e300), f64::INFINITY);
        assert_eq!(exp(f64::NEG_INFINITY), 0.0);
        assert!(exp(f64::NAN).is_nan());
    }

    #[test]
    fn sine_and_cosine_agree_with_the_standard_library() {
        let mut worst = 0.0_f64;
        for i in -200_000..200_000 {
            let x = f64::from(i) * 1.234_567e-4;
            let (s, c) = sin_cos(x);
            // Near a zero the reduction leaves an absolute error of 1e-16 or so.
            worst = worst.max(ulps(s, x.sin(), 0.5)).max(ulps(c, x.cos(), 0.5));
            worst = worst.max(ulps(sin(x), x.sin(), 0.5)).max(ulps(cos(x), x.cos(), 0.5));
        }
        assert!(worst <= 2.0, "{worst} ulp");
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }
}
