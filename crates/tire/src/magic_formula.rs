//! Defines the Magic Formula in its simple form: the friction coefficient of a tire over its slip angle, and where it peaks.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use elementary::Number;

/// Magic Formula of one axle in pure lateral slip (Pacejka, Tire and Vehicle Dynamics, section
/// 4.3).
///
/// The force is proportional to the load and positive slip gives positive force. The default is the
/// tire of the demo car.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MagicFormula<T = f64> {
    /// Stiffness factor [1/rad].
    pub B: T,
    /// Shape factor [-]; a peak exists above 1.
    pub C: T,
    /// Peak friction coefficient [-].
    pub D: T,
    /// Curvature factor [-]; usually at most 1.
    pub E: T,
    /// Horizontal shift [rad].
    pub S_h: T,
    /// Vertical shift of the friction coefficient [-].
    pub S_v: T,
}

impl Default for MagicFormula {
    fn default() -> Self {
        Self { B: 22.0, C: 1.8, D: 1.6, E: 0.8, S_h: 0.0, S_v: 0.0 }
    }
}

impl<T: Number> MagicFormula<T> {
    /// Friction coefficient F_y / F_z [-] at a slip angle [rad].
    ///
    /// μ = D sin(C atan(Bx − E(Bx − atan Bx))) + S_v with x = slip_angle + S_h.
    #[inline]
    pub fn friction_coefficient(&self, slip_angle: T) -> T {
        let Bx = self.B * (slip_angle + self.S_h);
        let phi = Bx - self.E * (Bx - Bx.atan());
        self.D * (self.C * phi.atan()).sin() + self.S_v
    }

    /// Lateral force [N] at a slip angle [rad] under a load `F_z` [N].
    #[inline]
    pub fn lateral_force(&self, slip_angle: T, F_z: T) -> T {
        F_z * self.friction_coefficient(slip_angle)
    }

    /// Cornering stiffness per unit of load, B C D [1/rad]: the slope where slip_angle = −S_h.
    #[inline]
    pub fn cornering_stiffness_per_load(&self) -> T {
        self.B * self.C * self.D
    }
}

impl MagicFormula {
    /// The same tire as constants of another number type.
    pub fn cast<T: Number>(&self) -> MagicFormula<T> {
        MagicFormula {
            B: self.B.into(),
            C: self.C.into(),
            D: self.D.into(),
            E: self.E.into(),
            S_h: self.S_h.into(),
            S_v: self.S_v.into(),
        }
    }

    /// Positive slip angle [rad] of the first force maximum; `None` for a curve that only rises, as
    /// for C ≤ 1 with E ≤ 1, or unless B > 0.
    ///
    /// The sine peaks where φ(z) = (1 − E) z + E atan z reaches tan(π / 2C), with z = B x.
    pub fn peak_slip(&self) -> Option<f64> {
        let Self { B, C, E, S_h, .. } = *self;
        if B.is_nan() || B <= 0.0 {
            return None;
        }
        let phi = |z: f64| (1.0 - E) * z + E * z.atan();
        // Above E = 1 φ itself turns back, and the force with it, whether or not the sine has
        // peaked.
        let turn = (E > 1.0).then(|| 1.0 / (E - 1.0).sqrt());
        let highest = match turn {
            Some(z) => phi(z),
            None if E == 1.0 => FRAC_PI_2,
            None => f64::INFINITY,
        };
        let target = if C > 1.0 { (PI / (2.0 * C)).tan() } else { f64::INFINITY };
        let z = if target < highest { self.solve_for_argument(phi, target) } else { turn? };
        Some(z / B - S_h)
    }

    /// Solves φ(z) = target for a target that φ reaches.
    ///
    /// φ is concave with φ(z) ≤ z for E ≥ 0, convex with φ(z) ≥ z for E < 0, and rises up to the
    /// root: from z = target Newton's method therefore approaches the root from one side and needs
    /// no bracket.
    fn solve_for_argument(&self, phi: impl Fn(f64) -> f64, target: f64) -> f64 {
        let mut z = target;
        for _ in 0..100 {
            let slope = 1.0 - self.E + self.E / (1.0 + z * z);
            let step = (target - phi(z)) / slope;
            z += step;
            if step.abs() <= 1e-15 * z {
                break;
            }
        }
        z
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use num_dual::{Dual64, first_derivative};
    use proptest::prelude::*;

    use super::*;

    fn tires() -> impl Strategy<Value = MagicFormula> {
        (5.0..40.0, 1.05..2.2, 0.5..2.5, -2.0..0.98).prop_map(|(B, C, D, E)| MagicFormula {
            B,
            C,
            D,
            E,
            S_h: 0.0,
            S_v: 0.0,
        })
    }

    fn highest_on_grid(tire: &MagicFormula, end: f64) -> f64 {
        let slip = |i: u32| end * f64::from(i) / 200_000.0;
        (0..=200_000)
            .map(slip)
            .max_by(|a, b| tire.friction_coefficient(*a).total_cmp(&tire.friction_coefficient(*b)))
            .expect("the grid has points")
    }

    #[test]
    fn demo_peak_is_where_a_dense_grid_has_it() {
        let tire = MagicFormula::default();
        let peak = tire.peak_slip().expect("C = 1.8 has a peak");
        assert_relative_eq!(peak, 0.0796, max_relative = 1e-3);
        assert_relative_eq!(peak, highest_on_grid(&tire, 0.3), epsilon = 3e-6);
        assert_relative_eq!(tire.friction_coefficient(peak), 1.6, max_relative = 1e-15);
    }

    #[test]
    fn curves_that_only_rise_have_no_peak() {
        let tire = |C, E| MagicFormula { C, E, ..MagicFormula::default() };
        assert_eq!(tire(1.0, 0.5).peak_slip(), None);
        assert_eq!(tire(0.8, 1.0).peak_slip(), None);
        // tan(π / 2.2) = 6.9 is above π / 2, the limit of φ for E = 1.
        assert_eq!(tire(1.1, 1.0).peak_slip(), None);
        assert_eq!(tire(f64::NAN, f64::NAN).peak_slip(), None);
    }

    #[test]
    fn curvature_above_one_peaks_where_its_argument_turns() {
        let tire = MagicFormula { C: 1.1, E: 1.4, ..MagicFormula::default() };
        let peak = tire.peak_slip().expect("φ turns");
        assert_relative_eq!(peak, highest_on_grid(&tire, 0.2), epsilon = 2e-6);
    }

    #[test]
    fn shifts_move_the_curve() {
        let plain = MagicFormula::default();
        let shifted = MagicFormula { S_h: 0.01, S_v: 0.05, ..plain };
        let expected = plain.friction_coefficient(0.04) + 0.05;
        assert_relative_eq!(shifted.friction_coefficient(0.03), expected, max_relative = 1e-15);
        let peaks = [plain, shifted].map(|t| t.peak_slip().expect("C > 1"));
        assert_relative_eq!(peaks[1], peaks[0] - 0.01, max_relative = 1e-13);
    }

    proptest! {
        #[test]
        fn odd_without_shifts(tire in tires(), slip in -1.0..1.0f64) {
            prop_assert_eq!(tire.lateral_force(-slip, 4000.0), -tire.lateral_force(slip, 4000.0));
        }

        #[test]
        fn bounded_by_peak_and_shift(tire in tires(), S_v in -0.2..0.2f64, slip in -1.5..1.5) {
            let tire = MagicFormula { S_v, ..tire };
            prop_assert!(tire.friction_coefficient(slip).abs() <= tire.D + S_v.abs() + 1e-15);
        }

        #[test]
        fn slope_at_zero_slip_is_the_stiffness(tire in tires(), F_z in 1.0..1e4f64) {
            let force = |slip: Dual64| tire.cast().lateral_force(slip, F_z.into());
            let (at_zero, slope) = first_derivative(force, 0.0);
            prop_assert_eq!(at_zero, 0.0);
            assert_relative_eq!(slope, F_z * tire.cornering_stiffness_per_load(), max_relative = 1e-14);
        }

        #[test]
        fn peak_reaches_the_peak_factor(tire in tires()) {
            let peak = tire.peak_slip().expect("C > 1 and E < 1");
            assert_relative_eq!(tire.friction_coefficient(peak), tire.D, max_relative = 1e-12);
            let before = |share: f64| tire.friction_coefficient(share * peak);
            prop_assert!(before(0.9) < before(0.99) && before(0.99) < tire.D);
        }
    }
}
