//! Models wheels: dynamic radius, slip ratio, and the yaw moment of a differential between two wheels.
#![allow(non_snake_case, reason = "forces and moments are written as in the equations")]

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use tire::Number;

use crate::slip::slip_speed;

/// Radius of the wheels of one axle, with its dependence on load and speed.
///
/// Default: 0.3 m, rigid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelRadiusModel {
    /// Radius without load and at rest [m].
    pub radius: f64,
    /// Vertical stiffness of one tire [N/m]; without it the tire is rigid.
    #[serde(default)]
    pub stiffness: Option<f64>,
    /// Growth of the radius with the square of the wheel speed [m·s²/rad²].
    #[serde(default)]
    pub growth: f64,
}

impl Default for WheelRadiusModel {
    fn default() -> Self {
        Self { radius: 0.3, stiffness: None, growth: 0.0 }
    }
}

impl WheelRadiusModel {
    /// Rolling radius [m] at a wheel speed [rad/s] under the load [N] of an axle with two wheels.
    ///
    /// r_dyn = ⅔ (r + d ω²) + ⅓ (r − F_z / 2c): Schabauer et al., "Experimental Investigation and Semi-physical
    /// Modelling of the Influence of Rotational Speed on the Vertical Tyre Stiffness and Tyre Radii", 2020.
    pub fn dynamic_radius(&self, omega: f64, axle_load: f64) -> f64 {
        let free = self.radius + self.growth * omega * omega;
        let loaded = self.radius - self.stiffness.map_or(0.0, |c| axle_load / (2.0 * c));
        (2.0 * free + loaded) / 3.0
    }
}

/// Longitudinal slip (ω r − v) / v [-] of a wheel that turns at `omega` [rad/s] with a rolling radius [m], while its
/// centre moves at `v` [m/s] along its x axis.
///
/// Positive when driven, as the force is; slower than 1 m/s it is that at 1 m/s.
pub fn slip_ratio(omega: f64, radius: f64, v: f64) -> f64 {
    (omega * radius - v) / slip_speed(v)
}

/// Limited-slip differential between two wheels (Gadola, Chindamo, Lenzo, "On the passive limited slip differential
/// for high performance vehicle applications", AVEC 2018).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitedSlipDifferential {
    /// Difference of the wheel torques over their sum while driving [-], from 0 to 1.
    pub drive_lock: f64,
    /// Difference of the wheel torques over their sum while the engine brakes [-], from 0 to 1.
    pub coast_lock: f64,
    /// Torque difference without load [N·m].
    pub preload: f64,
    /// Largest braking torque of the engine at the wheels [N·m], positive. The rest comes from the brakes behind the
    /// differential.
    pub engine_brake: f64,
    /// Growth of the locking with the difference of the wheel speeds [s/rad].
    pub sensitivity: f64,
    /// Distance between the two wheels [m].
    pub track: f64,
}

/// Friction that locks a differential: how much torque the faster wheel hands to the slower one.
///
/// The default is open: it locks nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DifferentialLock {
    /// Difference of the wheel torques over their sum while driving [-], from 0 to 1.
    pub drive: f64,
    /// Difference of the wheel torques over their sum while the engine brakes [-], from 0 to 1.
    pub coast: f64,
    /// Torque difference without load [N·m].
    pub preload: f64,
    /// Growth of the locking with the difference of the wheel speeds [s/rad].
    pub sensitivity: f64,
}

impl DifferentialLock {
    /// Torque of the right wheel minus that of the left one [N m], from the speeds of the left and the right wheel
    /// [rad/s] and the sum of both torques [N m].
    #[inline]
    pub fn locking_torque<T: Number>(&self, omega: [T; 2], torque: T) -> T {
        let share = if torque > 0.0 { self.drive } else { self.coast };
        let locked = torque.abs() * share;
        let most = if locked > self.preload { locked } else { self.preload.into() };
        if most == T::zero() {
            return most;
        }
        most * ((omega[0] - omega[1]) * self.sensitivity).tanh()
    }
}

impl LimitedSlipDifferential {
    /// Yaw moment on the car [N m], positive to the left, from the speeds of the left and the right wheel [rad/s], the
    /// longitudinal force of their axle [N] and their radius [m].
    ///
    /// The faster wheel hands torque to the slower one. With the left one faster, the right one drives more, which
    /// turns the car to the left.
    pub fn yaw_moment(&self, omega: [f64; 2], F_x: f64, radius: f64) -> f64 {
        let torque = (F_x * radius).max(-self.engine_brake);
        self.lock_parameters().locking_torque(omega, torque) / radius * 0.5 * self.track
    }

    /// Its friction.
    fn lock_parameters(&self) -> DifferentialLock {
        let Self { drive_lock: drive, coast_lock: coast, preload, sensitivity, .. } = *self;
        DifferentialLock { drive, coast, preload, sensitivity }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn radius_grows_with_speed_and_sinks_under_load() {
        let wheel = WheelRadiusModel { radius: 0.3, stiffness: Some(2e5), growth: 2e-7 };
        assert_relative_eq!(wheel.dynamic_radius(0.0, 0.0), 0.3);
        // ⅔ · 2e-7 · 200² = 5.333 mm up, ⅓ · 4000 / 4e5 = 3.333 mm down.
        assert_relative_eq!(wheel.dynamic_radius(200.0, 4000.0), 0.302, max_relative = 1e-12);
        assert_eq!(WheelRadiusModel::default().dynamic_radius(100.0, 4000.0), 0.3);
    }

    #[test]
    fn slip_has_the_sign_of_the_force() {
        assert_relative_eq!(slip_ratio(110.0, 0.3, 30.0), 0.1, max_relative = 1e-12);
        assert_relative_eq!(slip_ratio(0.0, 0.3, 30.0), -1.0);
    }

    #[test]
    fn differential_turns_towards_the_faster_wheel() {
        let lsd = LimitedSlipDifferential {
            drive_lock: 0.2,
            coast_lock: 0.5,
            preload: 100.0,
            engine_brake: 800.0,
            sensitivity: 0.5,
            track: 1.5,
        };
        let locked = |F_x| lsd.yaw_moment([90.0, 10.0], F_x, 0.3);
        assert_relative_eq!(locked(10_000.0), 0.2 * 3000.0 / 0.3 * 0.75, max_relative = 1e-12);
        assert_relative_eq!(locked(-10_000.0), 0.5 * 800.0 / 0.3 * 0.75, max_relative = 1e-12);
        assert_relative_eq!(locked(0.0), 100.0 / 0.3 * 0.75, max_relative = 1e-12);
        assert_eq!(lsd.yaw_moment([10.0, 90.0], 5000.0, 0.3), -lsd.yaw_moment([90.0, 10.0], 5000.0, 0.3));
        assert_eq!(lsd.yaw_moment([50.0, 50.0], 5000.0, 0.3), 0.0);
    }
}
