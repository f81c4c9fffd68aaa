//! Differentiates the Magic Formula: with respect to its parameters, to the slip, and both.
//!
//! With x = slip + S_h, u = B x, b = u − atan u, v = u − E b, w = atan v and φ = C w, the coefficient is μ = D sin φ + S_v. With
//! S = D C cos φ / (1 + v²) and p = 1 − E + E / (1 + u²) its derivatives are μ_B = S p x, μ_C = D w cos φ, μ_D = sin φ,
//! μ_E = −S b, μ_x = S p B and μ_xx = B² (p_u S + p² S_v), where p_u = −2 E u / (1 + u²)² and
//! S_v = −D C (C sin φ + 2 v cos φ) / (1 + v²)².

use super::MagicFormula;
use crate::number::Number;

/// The functions that the Magic Formula is made of, as the caller computes them: those of its [`Number`] by
/// [`Standard`], or faster ones.
pub trait Elementary<T> {
    /// Arc tangent.
    fn atan(x: T) -> T;
    /// Sine and cosine.
    fn sin_cos(x: T) -> (T, T);
}

/// The functions of the number type itself.
#[derive(Clone, Copy, Debug)]
pub struct Standard;

impl<T: Number> Elementary<T> for Standard {
    #[inline(always)]
    fn atan(x: T) -> T {
        x.atan()
    }

    #[inline(always)]
    fn sin_cos(x: T) -> (T, T) {
        x.sin_cos()
    }
}

/// The curve around one slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalCurve<T = f64> {
    /// Friction coefficient [-].
    pub value: T,
    /// Its first derivative with respect to slip.
    pub slope: T,
    /// Its second derivative with respect to slip.
    pub curvature: T,
}

/// A number, and its derivatives with respect to B, C, D, E and the slip.
pub type Graded<T = f64> = (T, [T; 5]);

// Only operators of the numbers here, no other method of theirs: operators are always inlined, so that loops over
// `f64` become vector instructions.
impl<T: Number> MagicFormula<T> {
    /// Friction coefficient at a slip, with the functions of `F`.
    #[inline(always)]
    pub fn coefficient_with<F: Elementary<T>>(&self, slip: T) -> T {
        let Self { B, C, D, E, S_h, S_v } = *self;
        let u = B * (slip + S_h);
        let v = u - E * (u - F::atan(u));
        D * F::sin_cos(C * F::atan(v)).0 + S_v
    }

    /// Friction coefficient at a slip, and its derivatives with respect to B, C, D, E, S_h and S_v.
    #[inline(always)]
    pub fn gradient_with<F: Elementary<T>>(&self, slip: T) -> (T, [T; 6]) {
        let Self { B, C, D, E, S_h, S_v } = *self;
        let one = T::from(1.0);
        let x = slip + S_h;
        let u = B * x;
        let bend = u - F::atan(u);
        let v = u - E * bend;
        let w = F::atan(v);
        let (sin, cos) = F::sin_cos(C * w);
        // One division instead of two: 1 / (1 + u²) and 1 / (1 + v²).
        let (uu, vv) = (one + u * u, one + v * v);
        let both = one / (uu * vv);
        let S = D * C * cos * (uu * both);
        let Sp = S * (one - E + E * (vv * both));
        (D * sin + S_v, [Sp * x, D * w * cos, sin, -(S * bend), Sp * B, one])
    }

    /// Value, slope and curvature at a slip.
    #[inline(always)]
    pub fn local_with<F: Elementary<T>>(&self, slip: T) -> LocalCurve<T> {
        let Self { B, C, D, E, S_h, S_v } = *self;
        let one = T::from(1.0);
        let u = B * (slip + S_h);
        let v = u - E * (u - F::atan(u));
        let (sin, cos) = F::sin_cos(C * F::atan(v));
        let narrow = one / (one + u * u);
        let flat = one / (one + v * v);
        let p = one - E + E * narrow;
        let p_u = -(E * u * narrow * narrow * 2.0);
        let S = D * C * cos * flat;
        let S_by_v = -(D * C * flat * flat * (C * sin + v * cos * 2.0));
        LocalCurve {
            value: D * sin + S_v,
            slope: B * p * S,
            curvature: B * B * (p_u * S + p * p * S_by_v),
        }
    }

    /// Friction coefficient and slope at a slip, with their derivatives.
    ///
    /// With G = p S the slope is B G; G_u = p_u S + p² S_v, S_C = D (cos φ − φ sin φ) / (1 + v²) and
    /// p_E = −u² / (1 + u²).
    #[inline(always)]
    pub fn value_and_slope_with<F: Elementary<T>>(&self, slip: T) -> [Graded<T>; 2] {
        let Self { B, C, D, E, S_h, S_v } = *self;
        let one = T::from(1.0);
        let x = slip + S_h;
        let u = B * x;
        let bend = u - F::atan(u);
        let v = u - E * bend;
        let w = F::atan(v);
        let phi = C * w;
        let (sin, cos) = F::sin_cos(phi);
        let (uu, vv) = (one + u * u, one + v * v);
        let both = one / (uu * vv);
        let (narrow, flat) = (vv * both, uu * both);
        let p = one - E + E * narrow;
        let p_u = -(E * 2.0) * u * narrow * narrow;
        let S_by_D = C * cos * flat;
        let S = D * S_by_D;
        let S_by_v = -D * C * flat * flat * (C * sin + v * cos * 2.0);
        let G_u = p_u * S + p * p * S_by_v;
        let slope = B * p * S;
        let slope_by = [
            p * S + u * G_u,
            B * p * D * flat * (cos - phi * sin),
            B * p * S_by_D,
            -B * (S_by_v * bend * p + S * u * u * narrow),
            B * B * G_u,
        ];
        let value_by = [S * p * x, D * w * cos, sin, -(S * bend), slope];
        [(D * sin + S_v, value_by), (slope, slope_by)]
    }

    /// The sine's argument φ = C atan v at a slip, and its derivatives with respect to B, C, D, E, S_h and S_v. The
    /// curve peaks where φ reaches π / 2.
    #[inline(always)]
    pub fn sine_argument_with<F: Elementary<T>>(&self, slip: T) -> (T, [T; 6]) {
        let Self { B, C, E, S_h, .. } = *self;
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let x = slip + S_h;
        let u = B * x;
        let bend = u - F::atan(u);
        let v = u - E * bend;
        let w = F::atan(v);
        let by_v = C / (one + v * v);
        let by_u = by_v * (one - E + E / (one + u * u));
        (C * w, [by_u * x, w, zero, -(by_v * bend), by_u * B, zero])
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use num_dual::{
        Dual64, DualNum, HyperDual64, first_derivative, second_derivative,
        second_partial_derivative,
    };
    use proptest::prelude::*;

    use super::*;

    /// Any curve with a peak, and a slip on it.
    fn curves() -> impl Strategy<Value = ([f64; 6], f64)> {
        let shifts = (-0.02..0.02f64, -0.1..0.1f64);
        let shape = (5.0..40.0f64, 1.05..2.2f64, 0.5..2.5f64, -2.0..0.98f64);
        (shape, shifts, -0.3..0.3f64)
            .prop_map(|((B, C, D, E), (S_h, S_v), slip)| ([B, C, D, E, S_h, S_v], slip))
    }

    fn curve<T>([B, C, D, E, S_h, S_v]: [T; 6]) -> MagicFormula<T> {
        MagicFormula { B, C, D, E, S_h, S_v }
    }

    /// The parameters, of which one is a variable.
    fn with_parameter<T: DualNum<Primitive = f64> + Copy>(
        theta: [f64; 6],
        i: usize,
        x: T,
    ) -> [T; 6] {
        std::array::from_fn(|j| if i == j { x } else { T::from(theta[j]) })
    }

    fn assert_close(found: f64, expected: f64) {
        assert_relative_eq!(found, expected, max_relative = 1e-9, epsilon = 1e-9);
    }

    proptest! {
        #[test]
        fn all_forms_have_the_same_value((theta, slip) in curves()) {
            let tire = curve(theta);
            let mu = tire.coefficient(slip);
            for found in [
                tire.coefficient_with::<Standard>(slip),
                tire.gradient_with::<Standard>(slip).0,
                tire.local_with::<Standard>(slip).value,
                tire.value_and_slope_with::<Standard>(slip)[0].0,
                theta[2] * tire.sine_argument_with::<Standard>(slip).0.sin() + theta[5],
            ] {
                assert_relative_eq!(found, mu, max_relative = 1e-14, epsilon = 1e-14);
            }
        }

        #[test]
        fn derivatives_with_respect_to_parameters_are_those_of_dual_numbers((theta, slip) in curves()) {
            let tire = curve(theta);
            let (_, gradient) = tire.gradient_with::<Standard>(slip);
            let (_, argument) = tire.sine_argument_with::<Standard>(slip);
            let [(_, value_by), (_, slope_by)] = tire.value_and_slope_with::<Standard>(slip);
            for i in 0..6 {
                let at = |x: Dual64| curve(with_parameter(theta, i, x));
                let slip_of = Dual64::from(slip);
                let (_, mu_by) = first_derivative(|x| at(x).coefficient(slip_of), theta[i]);
                assert_close(gradient[i], mu_by);
                let phi = |x: Dual64| at(x).sine_argument_with::<Standard>(slip_of).0;
                assert_close(argument[i], first_derivative(phi, theta[i]).1);
                if i < 4 {
                    let mu = |(x, slip): (HyperDual64, HyperDual64)| {
                        curve(with_parameter(theta, i, x)).coefficient(slip)
                    };
                    let (.., both) = second_partial_derivative(mu, (theta[i], slip));
                    assert_close(value_by[i], mu_by);
                    assert_close(slope_by[i], both);
                }
            }
        }

        #[test]
        fn derivatives_with_respect_to_slip_are_those_of_dual_numbers((theta, slip) in curves()) {
            let tire = curve(theta);
            let (value, slope, curvature) =
                second_derivative(|slip| tire.lift().coefficient(slip), slip);
            let found = tire.local_with::<Standard>(slip);
            for (found, expected) in
                [(found.value, value), (found.slope, slope), (found.curvature, curvature)]
            {
                assert_close(found, expected);
            }
            let [(_, value_by), (found, slope_by)] = tire.value_and_slope_with::<Standard>(slip);
            assert_close(value_by[4], slope);
            assert_close(found, slope);
            assert_close(slope_by[4], curvature);
        }
    }
}
