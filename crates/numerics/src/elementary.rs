//! Computes arc tangent, sine, cosine and logarithm without branches, so that the compiler calculates several at once.
//!
//! The polynomials interpolate in Chebyshev nodes (computed with 60 digits, remainder below 2e-17) on the reduced range. There
//! is no fused multiply-add in them on purpose: all instruction sets give the same bits.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4};

/// π/2 minus its nearest double.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;
/// π/2 to 33 bits: its product with a small integer is exact.
const FRAC_PI_2_HIGH: f64 = 1.570_796_326_734_125_6;
/// π/2 minus the 33 bits, as a double.
const FRAC_PI_2_LOW: f64 = 6.077_100_506_506_192e-11;
/// Added and subtracted, it rounds to the nearest integer, which then stands in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

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
/// ln 2 to 32 bits, and the rest: the product of the first with an exponent is exact.
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Even and odd powers apart: half as many additions wait for each other.
#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f64; N], t: f64) -> f64 {
    let square = t * t;
    let (mut even, mut odd) = (0.0, 0.0);
    for k in (0..N).rev() {
        if k % 2 == 0 {
            even = even * square + coefficients[k];
        } else {
            odd = odd * square + coefficients[k];
        }
    }
    even + t * odd
}

/// atan x, to 1.5 units in the last place.
#[inline(always)]
pub fn atan(x: f64) -> f64 {
    let t = x.abs();
    let middle = t > TAN_PI_8;
    let far = t > TAN_3PI_8;
    let numerator = if far {
        -1.0
    } else if middle {
        t - 1.0
    } else {
        t
    };
    let denominator = if far {
        t
    } else if middle {
        t + 1.0
    } else {
        1.0
    };
    let offset = if far {
        FRAC_PI_2
    } else if middle {
        FRAC_PI_4
    } else {
        0.0
    };
    let rest = if far {
        FRAC_PI_2_REST
    } else if middle {
        0.5 * FRAC_PI_2_REST
    } else {
        0.0
    };
    let z = numerator / denominator;
    let square = z * z;
    let small = z * square * polynomial(&ATAN, square) + rest;
    (offset + (z + small)).copysign(x)
}

/// sin x and cos x, to 1.5 units in the last place of 1, for |x| below 1e5.
#[inline(always)]
pub fn sin_cos(x: f64) -> (f64, f64) {
    let rounded = x * FRAC_2_PI + ROUND;
    let quadrant = rounded.to_bits();
    let k = rounded - ROUND;
    let r = (x - k * FRAC_PI_2_HIGH) - k * FRAC_PI_2_LOW;
    let square = r * r;
    let sin = r + r * square * polynomial(&SIN, square);
    let cos = 1.0 - 0.5 * square + square * square * polynomial(&COS, square);
    let odd = quadrant & 1 == 1;
    let (s, c) = if odd { (cos, sin) } else { (sin, cos) };
    // Sine is negative in the quadrants 2 and 3, cosine in 1 and 2.
    let sign = |bits: u64| (bits & 2) << 62;
    (f64::from_bits(s.to_bits() ^ sign(quadrant)), f64::from_bits(c.to_bits() ^ sign(quadrant + 1)))
}

/// ln(1 + x) of finite x ≥ 0, to 2 units in the last place.
#[inline(always)]
pub fn ln_1p(x: f64) -> f64 {
    /// Bits of the root of ½: 1 + x is 2^k times a number from there to the root of 2.
    const ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    /// 2^52, whose lowest bits count ones.
    const COUNTER: u64 = 0x4330_0000_0000_0000;
    let u = 1.0 + x;
    let lost = x - (u - 1.0);
    let shifted = u.to_bits() + (ONE - ROOT);
    let k = f64::from_bits(COUNTER | (shifted >> 52)) - f64::from_bits(COUNTER) - 1023.0;
    let reduced = f64::from_bits((shifted & 0x000f_ffff_ffff_ffff) + ROOT);
    let excess = reduced - 1.0;
    let f = excess / (2.0 + excess);
    let square = f * f;
    // ln((1 + f)/(1 − f)) = 2f + f (s − …) in the form that keeps the last bits (Tang 1990): excess − f (excess − rest).
    let rest = 2.0 * square * polynomial(&ATANH, square);
    let low = k * LN_2_LOW + lost / u;
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
    }

    #[test]
    fn sine_and_cosine_agree_with_the_standard_library() {
        let mut worst = 0.0_f64;
        for i in -200_000..200_000 {
            let x = f64::from(i) * 1.234_567e-4;
            let (s, c) = sin_cos(x);
            // Near a zero the reduction leaves an absolute error of 1e-16 or so.
            worst = worst.max(ulps(s, x.sin(), 0.5)).max(ulps(c, x.cos(), 0.5));
        }
        assert!(worst <= 2.0, "{worst} ulp");
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }
}
