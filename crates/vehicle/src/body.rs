//! Weighs the axles: gravity, aerodynamics and longitudinal load transfer.
#![allow(non_snake_case, reason = "forces and moments of inertia are written as in the equations")]

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use tire::Number;

/// Gravity where the modelled cars drive [m/s²]: between that of the equator, 9.780, and the poles, 9.832, rounded as in textbooks of
/// vehicle dynamics. It is no unit: accelerations stated in g are multiples of `units::STANDARD_GRAVITY`.
pub const G: f64 = 9.81;

/// Rigid body of the car, seen in the plane of symmetry. The default is the demo car.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleBody {
    /// Mass [kg].
    pub m: f64,
    /// Yaw moment of inertia about the centre of gravity [kg·m²].
    pub I_zz: f64,
    /// Distance from the centre of gravity to the front axle [m].
    pub l_f: f64,
    /// Distance from the centre of gravity to the rear axle [m].
    pub l_r: f64,
    /// Height of the centre of gravity above the road [m].
    pub h: f64,
}

impl Default for VehicleBody {
    fn default() -> Self {
        Self { m: 780.0, I_zz: 1000.0, l_f: 1.4, l_r: 1.6, h: 0.35 }
    }
}

impl VehicleBody {
    /// Distance between the axles [m].
    #[inline]
    pub fn wheelbase(&self) -> f64 {
        self.l_f + self.l_r
    }

    /// Loads of the front and the rear axle at rest [N].
    pub fn static_loads(&self) -> [f64; 2] {
        let per_length = self.m * G / self.wheelbase();
        [per_length * self.l_r, per_length * self.l_f]
    }

    /// Loads of the front and the rear axle [N] while forces act on the car.
    ///
    /// `downforce` is that of each axle [N]; `F_long` is the sum of all forces along the body's x
    /// axis [N] but for the lateral force of the front tires, which is `mu_f` times the front load
    /// and turned by the steering angle, of which `sin_delta` is the sine.
    ///
    /// Assumes a road without slope, quasi-steady pitch (no suspension dynamics), and h |mu_f
    /// sin_delta| below the wheelbase L. With the inertial force −m a_x in the centre of gravity,
    /// moments about the rear contact point give F_zf L = m g l_r + L F_df − h m a_x, where m a_x =
    /// F_long − mu_f F_zf sin_delta. As this is linear in F_zf it is solved for it, and the load
    /// transfer has no delay. An axle that would be pulled off the road carries nothing, the other
    /// one all.
    #[inline]
    pub fn axle_loads<T: Number>(&self, downforce: [T; 2], F_long: T, mu_f: T, sin_delta: T) -> [T; 2] {
        self.axle_loads_with_weight(T::from(self.m * G), downforce, F_long, mu_f, sin_delta)
    }

    /// The same with another weight that presses on the road [N], as on a slope.
    #[inline]
    pub(crate) fn axle_loads_with_weight<T: Number>(
        &self,
        weight: T,
        downforce: [T; 2],
        F_long: T,
        mu_f: T,
        sin_delta: T,
    ) -> [T; 2] {
        let L = self.wheelbase();
        let total = downforce[0] + downforce[1] + weight;
        let moment = downforce[0] * L - F_long * self.h + weight * self.l_r;
        let F_zf = moment / (-mu_f * sin_delta * self.h + L);
        if F_zf <= 0.0 {
            [T::zero(), total]
        } else if F_zf >= total {
            [total, T::zero()]
        } else {
            [F_zf, total - F_zf]
        }
    }
}

/// Aerodynamics of the car in still air. The default is the demo car, which has drag only.
///
/// The downforce coefficients are referred to the axles and to the road, as a wind tunnel balance
/// reads them under the wheels of a standing car: they contain the pitching moment of the drag.
/// Zero for both means that the air moves no load between the axles of a car held at rest in the
/// wind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Aerodynamics {
    /// Air density [kg/m³].
    pub rho: f64,
    /// Frontal area [m²].
    pub area: f64,
    /// Drag coefficient [-].
    pub C_d: f64,
    /// Downforce coefficient of the front axle [-], positive downwards.
    pub C_lf: f64,
    /// Downforce coefficient of the rear axle [-], positive downwards.
    pub C_lr: f64,
}

impl Default for Aerodynamics {
    fn default() -> Self {
        Self { rho: 1.225, area: 1.5, C_d: 0.3, C_lf: 0.0, C_lr: 0.0 }
    }
}

impl Aerodynamics {
    /// Drag [N] at a forward speed [m/s], against the direction of travel: ½ ρ A C_d v_x |v_x|.
    #[inline]
    pub fn drag<T: Number>(&self, v_x: T) -> T {
        v_x * v_x.abs() * (0.5 * self.rho * self.area * self.C_d)
    }

    /// Downforce on the front and the rear axle [N] at a forward speed [m/s]: ½ ρ A C_l v_x².
    #[inline]
    pub fn downforce<T: Number>(&self, v_x: T) -> [T; 2] {
        let pressed_area = v_x * v_x * (0.5 * self.rho * self.area);
        [pressed_area * self.C_lf, pressed_area * self.C_lr]
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn rest_is_the_lever_law() {
        let body = VehicleBody::default();
        let loads = body.axle_loads([0.0; 2], 0.0, 0.7, 0.0);
        assert_relative_eq!(loads[0], 4080.96, max_relative = 1e-14);
        assert_relative_eq!(loads[1], 3570.84, max_relative = 1e-14);
        assert_relative_eq!(loads[0], body.static_loads()[0], max_relative = 1e-15);
        assert_relative_eq!(loads[1], body.static_loads()[1], max_relative = 1e-15);
    }

    #[test]
    fn lifted_axle_hands_over_all_weight() {
        let body = VehicleBody::default();
        let weight = body.m * G;
        assert_eq!(body.axle_loads([0.0; 2], 4e4, 0.0, 0.0), [0.0, weight], "wheelie");
        assert_eq!(body.axle_loads([0.0; 2], -4e4, 0.0, 0.0), [weight, 0.0], "stoppie");
    }

    #[test]
    fn drag_opposes_motion() {
        let aero = Aerodynamics::default();
        assert_relative_eq!(aero.drag(80.0), 1764.0, max_relative = 1e-14);
        assert_eq!(aero.drag(-80.0), -aero.drag(80.0));
    }

    proptest! {
        #[test]
        fn pitch_and_heave_are_balanced(
            F_long in -8e3..8e3, mu_f in -1.6..1.6, delta in -0.4..0.4f64,
            F_df in 0.0..2e3, F_dr in 0.0..2e3,
        ) {
            let body = VehicleBody::default();
            let [F_zf, F_zr] = body.axle_loads([F_df, F_dr], F_long, mu_f, delta.sin());
            assert_relative_eq!(F_zf + F_zr, body.m * G + F_df + F_dr, max_relative = 1e-14);
            // Moments about the centre of gravity: here tire forces act at the distance h below.
            let F_x = F_long - mu_f * F_zf * delta.sin();
            let pitch = (F_zr - F_dr) * body.l_r - (F_zf - F_df) * body.l_f - body.h * F_x;
            prop_assert!(pitch.abs() < 1e-9);
        }
    }
}
