//! Computes slip angles, loads and forces of the axles from measurements in the body.
#![allow(non_snake_case, reason = "forces and moments are written as in the equations")]

use crate::body::VehicleBody;
use crate::slip::slip_speed;
use tire::Number;

/// Forces of the two axles [N], each in the frame of its wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxleForces {
    /// Longitudinal, front and rear.
    pub F_x: [f64; 2],
    /// Lateral, front and rear.
    pub F_y: [f64; 2],
}

impl VehicleBody {
    /// Slip angles of the front and the rear axle [rad].
    ///
    /// α_f = δ − atan((v_y + l_f r) / v) and α_r = −atan((v_y − l_r r) / v), where v = max(v_x, 1 m/s): with the
    /// velocities of the centre of gravity [m/s], the yaw rate [rad/s] and the steering angle [rad].
    #[inline]
    pub fn slip_angles<T: Number>(&self, v_x: T, v_y: T, r: T, delta: T) -> [T; 2] {
        let v = slip_speed(v_x);
        [delta - (v_y + r * self.l_f).atan2(v), -(v_y - r * self.l_r).atan2(v)]
    }

    /// Loads of the front and the rear axle [N] from the specific force along x and z [m/s²] that an accelerometer in
    /// the centre of gravity measures: at rest a_z = g.
    ///
    /// The sums of [`VehicleBody::axle_loads`], with the acceleration known: F_zf L = m a_z l_r + L F_df − h m a_x.
    pub fn axle_loads_from_accelerations(&self, downforce: [f64; 2], a_x: f64, a_z: f64) -> [f64; 2] {
        let total = self.m * a_z + downforce[0] + downforce[1];
        let F_zf = downforce[0] + self.m * (a_z * self.l_r - self.h * a_x) / self.wheelbase();
        let F_zf = F_zf.clamp(0.0, total.max(0.0));
        [F_zf, total - F_zf]
    }

    /// Forces of the front and the rear axle along the body's y axis [N], from the lateral acceleration [m/s²] and the
    /// yaw acceleration [rad/s²].
    ///
    /// `M_z` is any yaw moment that is not the axles' lateral force, such as a differential's [N m]. From m a_y = F_f +
    /// F_r and I_zz r' = l_f F_f − l_r F_r + M_z follows F_f = (l_r m a_y + I_zz r' − M_z) / L.
    pub fn lateral_forces(&self, a_y: f64, yaw_acceleration: f64, M_z: f64) -> [f64; 2] {
        let moment = self.I_zz * yaw_acceleration - M_z;
        let front = (self.l_r * self.m * a_y + moment) / self.wheelbase();
        [front, self.m * a_y - front]
    }
}

impl AxleForces {
    /// Turns forces along the body's axes into those of the wheels.
    ///
    /// `F_long` is the sum of all tire forces along x [N]: m a_x and the drag. `lateral` is that of
    /// [`VehicleBody::lateral_forces`]. `front_share` is the part of the driving and of the braking force that acts at the
    /// front [-].
    ///
    /// With F = F_xf + F_xr, F_xf = s F and the front wheels turned by δ, F_long = F_xf cos δ + F_xr − F_yf sin δ and
    /// lateral_f = F_yf cos δ + F_xf sin δ give F (s / cos δ + 1 − s) = F_long + lateral_f tan δ: the front tires'
    /// lateral force, which slows a cornering car, is separated from braking.
    pub fn from_body_axes(F_long: f64, lateral: [f64; 2], delta: f64, front_share: [f64; 2]) -> Self {
        let (sin, cos) = delta.sin_cos();
        let driving = F_long + lateral[0] * sin / cos;
        let share = front_share[usize::from(driving < 0.0)];
        let F = driving / (share / cos + 1.0 - share);
        let F_xf = share * F;
        Self { F_x: [F_xf, F - F_xf], F_y: [(lateral[0] - F_xf * sin) / cos, lateral[1]] }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;
    use crate::{Aerodynamics, G, MagicFormula, PlanarState, SingleTrackCar, SingleTrackInput};

    proptest! {
        #[test]
        fn forces_are_those_that_accelerated_the_car(
            v_x in 5.0..70.0f64, v_y in -6.0..6.0f64, r in -1.5..1.5f64, F_x in -8e3..6e3f64, delta in -0.4..0.4f64,
        ) {
            let aero = Aerodynamics { C_lf: 0.4, C_lr: 0.6, ..Aerodynamics::default() };
            let tire_r = MagicFormula { B: 14.0, S_h: 0.002, ..MagicFormula::default() };
            let car = SingleTrackCar { aero, tire_r, ..SingleTrackCar::default() };
            let state = PlanarState { v_x, v_y, r, ..PlanarState::default() };
            let m = car.evaluate(&state, &SingleTrackInput { F_x, delta });
            let loads = car.body.axle_loads_from_accelerations(aero.downforce(v_x), m.a_x, G);
            let lateral = car.body.lateral_forces(m.a_y, m.derivative.r, 0.0);
            let share = [0.0, car.brake_front_share];
            let found = AxleForces::from_body_axes(car.body.m * m.a_x + m.drag, lateral, delta, share);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-8;
            prop_assert!(near(loads[0], m.F_zf) && near(loads[1], m.F_zr), "{loads:?} {m:?}");
            prop_assert!(near(found.F_x[0], m.F_xf) && near(found.F_x[1], m.F_xr), "{found:?} {m:?}");
            prop_assert!(near(found.F_y[0], m.F_yf) && near(found.F_y[1], m.F_yr), "{found:?} {m:?}");
        }
    }

    #[test]
    fn yaw_moment_of_others_is_not_the_front_axles() {
        let body = VehicleBody::default();
        let [front, rear] = body.lateral_forces(0.0, 0.0, 300.0);
        assert_relative_eq!(front, -100.0);
        assert_relative_eq!(rear, 100.0);
    }

    #[test]
    fn lifted_axle_carries_nothing() {
        let body = VehicleBody::default();
        assert_eq!(body.axle_loads_from_accelerations([0.0; 2], 60.0, G), [0.0, body.m * G]);
    }
}
