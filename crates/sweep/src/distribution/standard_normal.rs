//! Computes the standard normal distribution and its inverse, with the same bits on every machine.

use std::f64::consts::FRAC_1_SQRT_2;

/// √(π/2).
const SQRT_FRAC_PI_2: f64 = 1.253_314_137_315_500_3;

/// Where the continued fraction takes over: below, the error function is as good and faster.
const FAR: f64 = 6.0;
/// Enough for the last bit from [`FAR`] on.
const TERMS: u32 = 60;

/// A quotient of two polynomials of degree 7, of which the lower one begins with 1.
type RationalCoefficients = ([f64; 8], [f64; 7]);

/// Wichura, "Algorithm AS 241: the percentage points of the normal distribution", Applied Statistics 37 (1988), PPND16: about
/// one part in 1e16. In the middle, in the tails, and far out.
const MIDDLE: RationalCoefficients = (
    [
        3.387_132_872_796_366_5,
        1.331_416_678_917_843_8e2,
        1.971_590_950_306_551_3e3,
        1.373_169_376_550_946e4,
        4.592_195_393_154_987e4,
        6.726_577_092_700_87e4,
        3.343_057_558_358_813e4,
        2.509_080_928_730_122_7e3,
    ],
    [
        4.231_333_070_160_091e1,
        6.871_870_074_920_579e2,
        5.394_196_021_424_751e3,
        2.121_379_430_158_659_7e4,
        3.930_789_580_009_271e4,
        2.872_908_573_572_194_3e4,
        5.226_495_278_852_854e3,
    ],
);
const TAIL: RationalCoefficients = (
    [
        1.423_437_110_749_683_5,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        2.417_807_251_774_506e-1,
        2.272_384_498_926_918_4e-2,
        7.745_450_142_783_414e-4,
    ],
    [
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        6.897_673_349_851e-1,
        1.481_039_764_274_800_8e-1,
        1.519_866_656_361_645_7e-2,
        5.475_938_084_995_345e-4,
        1.050_750_071_644_416_9e-9,
    ],
);
const FAR_TAIL: RationalCoefficients = (
    [
        6.657_904_643_501_103,
        5.463_784_911_164_114,
        1.784_826_539_917_291_3,
        2.965_605_718_285_048_7e-1,
        2.653_218_952_657_612_4e-2,
        1.242_660_947_388_078_4e-3,
        2.711_555_568_743_487_6e-5,
        2.010_334_399_292_288_1e-7,
    ],
    [
        5.998_322_065_558_879e-1,
        1.369_298_809_227_358e-1,
        1.487_536_129_085_061_5e-2,
        7.868_691_311_456_133e-4,
        1.846_318_317_510_054_8e-5,
        1.421_511_758_316_446e-7,
        2.044_263_103_389_939_8e-15,
    ],
);

/// The probability of less than z.
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

/// The z that has this probability below it, 0 < p < 1.
pub fn normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        return q * evaluate_rational(&MIDDLE, 0.180_625 - q * q);
    }
    let r = (-libm::log(p.min(1.0 - p))).sqrt();
    let z = if r <= 5.0 { evaluate_rational(&TAIL, r - 1.6) } else { evaluate_rational(&FAR_TAIL, r - 5.0) };
    z.copysign(q)
}

/// A quantile of what lies between a and b, a < b, as the distance from the end that it is given with: from a if the first is
/// true, from b otherwise.
pub fn truncated_quantile_from_end(u: f64, a: f64, b: f64) -> (bool, f64) {
    if a > 0.0 {
        return (true, upper_tail_quantile(u, a, b));
    }
    if b < 0.0 {
        return (false, -upper_tail_quantile(1.0 - u, -b, -a));
    }
    let below = normal_cdf(a);
    let above = normal_cdf(-b);
    let inside = 1.0 - below - above;
    let p = below + u * inside;
    let z = if p < 0.5 { normal_quantile(p) } else { -normal_quantile(above + (1.0 - u) * inside) };
    if -a < b { (true, z - a) } else { (false, z - b) }
}

/// A quantile of what lies between a and b in the upper tail, 0 < a < b, as the distance from a. The logarithm of the tail's
/// probability is concave, so Newton's method goes down to the solution from the first tangent's.
fn upper_tail_quantile(u: f64, a: f64, b: f64) -> f64 {
    let mills_a = mills_ratio(a);
    let left =
        if b.is_finite() { libm::exp(-0.5 * (b - a) * (b + a)) * mills_ratio(b) / mills_a } else { 0.0 };
    let wanted = libm::log1p(-u * (1.0 - left));
    let (mut distance, mut last) = (-wanted * mills_a, f64::INFINITY);
    for _ in 0..100 {
        let mills = mills_ratio(a + distance);
        let found = libm::log(mills / mills_a) - distance * (a + 0.5 * distance);
        let step = (found - wanted) * mills;
        distance += step;
        // The error after a step is about the square of it; rounding errors do not get smaller.
        if step.abs() <= 1e-9 * distance || step.abs() >= last {
            break;
        }
        last = step.abs();
    }
    distance.clamp(0.0, b - a)
}

/// The probability of more than x, divided by the density there; x ≥ 0.
fn mills_ratio(x: f64) -> f64 {
    if x < FAR {
        return SQRT_FRAC_PI_2 * libm::exp(0.5 * x * x) * libm::erfc(x * FRAC_1_SQRT_2);
    }
    // Laplace's continued fraction.
    1.0 / (1..=TERMS).rev().fold(x, |sum, k| x + f64::from(k) / sum)
}

fn evaluate_rational((upper, lower): &RationalCoefficients, t: f64) -> f64 {
    let polynomial = |terms: &[f64]| terms.iter().rev().fold(0.0, |sum, term| sum * t + term);
    polynomial(upper) / (polynomial(lower) * t + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_inverse_of_probabilities() {
        for k in 1..3000 {
            let z = -0.0125 * f64::from(k);
            let p = normal_cdf(z);
            // A relative error e of p is one of e/(z²+1) of z.
            assert!((normal_quantile(p) / z - 1.0).abs() < 2e-15 * (1.0 + 1.0 / z.abs()), "{z}");
        }
        // NormalDist().inv_cdf of Python 3.11.
        for (p, z) in [(0.975, 1.959_963_984_540_053_8), (1e-10, -6.361_340_902_404_056)] {
            assert!((normal_quantile(p) / z - 1.0).abs() < 1e-15);
        }
        assert_eq!(normal_quantile(0.5), 0.0);
    }

    #[test]
    fn both_ways_to_the_tail_agree() {
        let direct = |x: f64| SQRT_FRAC_PI_2 * libm::exp(0.5 * x * x) * libm::erfc(x * FRAC_1_SQRT_2);
        for k in 0..40 {
            let x = FAR + 0.25 * f64::from(k);
            assert!((mills_ratio(x) / direct(x) - 1.0).abs() < 1e-13, "{x}");
        }
    }
}
