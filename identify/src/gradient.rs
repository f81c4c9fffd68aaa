//! Differentiates the friction coefficient by its parameters.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::parameters::Theta;

/// The friction coefficient [-] at a slip, and its derivatives by B, C, D, E, S_h and S_v.
#[inline]
pub fn gradient(theta: &Theta, slip: f64) -> (f64, Theta) {
    let [B, C, D, E, S_h, S_v] = *theta;
    let x = slip + S_h;
    let u = B * x;
    let a = u.atan();
    let v = u - E * (u - a);
    let w = v.atan();
    let (sine, cosine) = (C * w).sin_cos();
    // By v, and of v by u.
    let S = D * C * cosine / (1.0 + v * v);
    let p = 1.0 - E + E / (1.0 + u * u);
    (D * sine + S_v, [S * p * x, D * w * cosine, sine, -S * (u - a), S * p * B, 1.0])
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use num_dual::Dual64;
    use vehicle::MagicFormula;

    use super::*;
    use crate::parameters::curve;

    #[test]
    fn the_derivatives_are_those_of_dual_numbers() {
        for theta in [[15.0, 2.0, 1.5, 0.8, 0.0, 0.0], [25.0, 1.1, 1.5, -1.0, 0.01, -0.05]] {
            for slip in [-0.3, -0.02, 0.0, 0.005, 0.08, 0.75] {
                let (value, derivatives) = gradient(&theta, slip);
                assert_relative_eq!(
                    value,
                    curve(&theta).coefficient(slip),
                    max_relative = 1e-14,
                    epsilon = 1e-15
                );
                for i in 0..theta.len() {
                    let number = |j| Dual64::new(theta[j], if i == j { 1.0 } else { 0.0 });
                    let dual = MagicFormula {
                        B: number(0),
                        C: number(1),
                        D: number(2),
                        E: number(3),
                        S_h: number(4),
                        S_v: number(5),
                    };
                    let expected = dual.coefficient(slip.into()).eps;
                    assert_relative_eq!(
                        derivatives[i],
                        expected,
                        max_relative = 1e-12,
                        epsilon = 1e-14
                    );
                }
            }
        }
    }
}
