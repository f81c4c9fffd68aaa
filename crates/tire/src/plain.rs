//! Makes the simple Magic Formula a tire: one curve for both directions, proportional to load.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::magic_formula::MagicFormula;
use crate::slip::{RelaxationLengths, TireForces, TireOperatingPoint, ValidityExcess};
use crate::tire::Tire;
use elementary::Number;

/// Combined slip by similarity (Pacejka, Tire and Vehicle Dynamics, section 4.3.4): the force is that of the curve at the
/// length of the slip vector, and opposes it, so its length never exceeds μ D F_z while S_v is 0.
///
/// Moments are 0. There is no load under 0, no effect of camber, speed and pressure, and no limit of validity.
impl<T: Number> Tire<T> for MagicFormula<T> {
    fn forces(&self, slip: &TireOperatingPoint<T>) -> TireForces<T> {
        let [F_x, F_y] = self.F_xy(slip);
        let zero = T::from(0.0);
        TireForces { F_x, F_y, M_x: zero, M_y: zero, M_z: zero }
    }

    fn F_xy(&self, slip: &TireOperatingPoint<T>) -> [T; 2] {
        let zero = T::from(0.0);
        let F_z = if slip.F_z < zero { zero } else { slip.F_z };
        let centred = Self { S_h: zero, S_v: zero, ..*self };
        // The curve's positive slip makes positive force.
        let (x, y) = (slip.kappa, self.S_h - slip.alpha);
        let square = x * x + y * y;
        // The root has no derivative at 0; the curve there is its tangent.
        let secant = if square == zero {
            self.cornering_stiffness_per_load()
        } else {
            let length = square.sqrt();
            centred.friction_coefficient(length) / length
        };
        let reverse = if slip.v_x < zero { -1.0 } else { 1.0 };
        [slip.mu * F_z * secant * x * reverse, slip.mu * F_z * (secant * y + self.S_v)]
    }

    fn F_xy_M_z(&self, slip: &TireOperatingPoint<T>) -> [T; 3] {
        let [F_x, F_y] = self.F_xy(slip);
        [F_x, F_y, T::from(0.0)]
    }

    fn relaxation(&self, _: &TireOperatingPoint<T>) -> RelaxationLengths<T> {
        RelaxationLengths { x: T::from(0.0), y: T::from(0.0) }
    }

    fn effective_radius(&self, _: &TireOperatingPoint<T>) -> Option<T> {
        None
    }

    fn loaded_radius(&self, _: &TireOperatingPoint<T>, _: &TireForces<T>) -> Option<T> {
        None
    }

    fn validity_excess(&self, _: &TireOperatingPoint<T>) -> ValidityExcess {
        ValidityExcess::default()
    }
}
