//! The data of a car that turn its motion into forces: masses, lengths, air, wheels, driven and braked axles.
#![allow(non_snake_case, reason = "forces and moments are written as in the equations")]

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vehicle::{Aerodynamics, AxleForces, LimitedSlipDifferential, VehicleBody, WheelRadiusModel, slip_ratio};

use crate::error::Error;
use crate::row::MotionSample;

/// The car. The default is the demo car.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Car {
    /// Mass, inertia and lengths.
    pub body: VehicleBody,
    /// Drag and downforce.
    pub aero: Aerodynamics,
    /// Rolling resistance coefficient [-].
    pub c_roll: f64,
    /// Share of the driving force at the front axle [-]; 0 for rear-wheel drive.
    pub drive_front_share: f64,
    /// Share of the braking force at the front axle [-], from 0 to 1, or `"by_load"`.
    pub brake_front_share: BrakeShare,
    /// Wheels of the front axle.
    pub wheel_f: WheelRadiusModel,
    /// Wheels of the rear axle.
    pub wheel_r: WheelRadiusModel,
    /// Limited-slip differential of the rear axle; without it both wheels drive alike.
    pub differential: Option<LimitedSlipDifferential>,
}

/// Share of the braking force at the front axle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected the front axle's share, from 0 to 1, or \"by_load\"")]
pub enum BrakeShare {
    /// Constant share [-].
    Fixed(f64),
    /// Share by a rule.
    Rule(ShareRule),
}

/// A rule for the share of the braking force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShareRule {
    /// In proportion to the loads of the axles (Goblirsch et al., eq. 9).
    ByLoad,
}

impl Default for BrakeShare {
    /// That of the demo car.
    fn default() -> Self {
        Self::Fixed(0.6)
    }
}

/// What the axles do at one instant, front and rear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxleSample {
    /// Loads [N].
    pub F_z: [f64; 2],
    /// Forces of the tires [N], in the frames of the wheels.
    pub force: AxleForces,
    /// Slip angles [rad].
    pub alpha: [f64; 2],
    /// Slip ratios [-], where both wheel speeds are known.
    pub kappa: [Option<f64>; 2],
}

impl Car {
    /// Loads, forces and slips of the axles from what was measured.
    pub fn axle_sample(&self, row: &MotionSample) -> AxleSample {
        let body = &self.body;
        let F_z = body.axle_loads_from_accelerations(self.aero.downforce(row.v_x), row.a_x, row.a_z);
        let resistance = self.aero.drag(row.v_x) + self.c_roll * body.m * row.a_z;
        let F_long = body.m * row.a_x + resistance;
        let share = [self.drive_front_share, self.brake_share(F_z)];
        let forces = |M_z| {
            let lateral = body.lateral_forces(row.a_y, row.r_dot, M_z);
            AxleForces::from_body_axes(F_long, lateral, row.delta, share)
        };
        let mut force = forces(0.0);
        if let (Some(differential), Some(omega)) = (self.differential, row.omega[1]) {
            let radius = self.wheel_r.radius;
            // The differential's moment changes F_xr by its share of the front's lateral force times sin δ only: one
            // correction is enough.
            force = forces(differential.yaw_moment(omega, force.F_x[1], radius));
        }
        let alpha = body.slip_angles(row.v_x, row.v_y, row.r, row.delta);
        AxleSample { F_z, force, alpha, kappa: self.slip_ratios(row, F_z) }
    }

    fn brake_share(&self, F_z: [f64; 2]) -> f64 {
        match self.brake_front_share {
            BrakeShare::Fixed(share) => share,
            BrakeShare::Rule(ShareRule::ByLoad) => F_z[0] / (F_z[0] + F_z[1]),
        }
    }

    /// The mean of both wheels' speeds against the velocity of the axle's middle along its wheels.
    fn slip_ratios(&self, row: &MotionSample, F_z: [f64; 2]) -> [Option<f64>; 2] {
        let (sin, cos) = row.delta.sin_cos();
        let along = [row.v_x * cos + (row.v_y + self.body.l_f * row.r) * sin, row.v_x];
        let wheels = [self.wheel_f, self.wheel_r];
        std::array::from_fn(|axle| {
            row.omega[axle].map(|[left, right]| {
                let omega = 0.5 * (left + right);
                slip_ratio(omega, wheels[axle].dynamic_radius(omega, F_z[axle]), along[axle])
            })
        })
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let VehicleBody { m, I_zz, l_f, l_r, h } = self.body;
        let positive = "a positive number";
        for (name, found) in [
            ("car.body.m", m),
            ("car.body.I_zz", I_zz),
            ("car.body.l_f", l_f),
            ("car.body.l_r", l_r),
            ("car.wheel_f.radius", self.wheel_f.radius),
            ("car.wheel_r.radius", self.wheel_r.radius),
        ] {
            Error::check_setting(found > 0.0 && found.is_finite(), name, found, positive)?;
        }
        for (name, wheel) in
            [("car.wheel_f.stiffness", self.wheel_f), ("car.wheel_r.stiffness", self.wheel_r)]
        {
            let found = wheel.stiffness.unwrap_or(f64::INFINITY);
            Error::check_setting(found > 0.0, name, found, positive)?;
        }
        Error::check_setting(self.c_roll >= 0.0, "car.c_roll", self.c_roll, "zero or a positive number")?;
        Error::check_setting(h >= 0.0 && h.is_finite(), "car.body.h", h, "zero or a positive number")?;
        let share =
            |name, found: f64| Error::check_setting((0.0..=1.0).contains(&found), name, found, "0 to 1");
        share("car.drive_front_share", self.drive_front_share)?;
        match self.brake_front_share {
            BrakeShare::Fixed(found) => share("car.brake_front_share", found),
            BrakeShare::Rule(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn row() -> MotionSample {
        MotionSample {
            v_x: 30.0,
            a_y: 8.0,
            r: 0.27,
            r_dot: 0.5,
            delta: 0.03,
            a_z: 9.81,
            ..MotionSample::default()
        }
    }

    #[test]
    fn differential_takes_its_moment_off_the_front_axle() {
        let differential = LimitedSlipDifferential {
            drive_lock: 0.2,
            coast_lock: 0.5,
            preload: 100.0,
            engine_brake: 800.0,
            sensitivity: 0.5,
            track: 1.5,
        };
        let open = Car::default();
        let locking = Car { differential: Some(differential), ..open };
        let driven = MotionSample { a_x: 4.0, omega: [None, Some([110.0, 100.0])], ..row() };
        let [before, after] = [open, locking].map(|car| car.axle_sample(&driven).force);
        // The left wheel is faster, and so the right one drives more and turns the car left: the front does less.
        let moment = differential.yaw_moment([110.0, 100.0], after.F_x[1], 0.3);
        assert!(moment > 300.0);
        let less = moment / open.body.wheelbase() / driven.delta.cos();
        assert_relative_eq!(after.F_y[0], before.F_y[0] - less, max_relative = 1e-4);
        let [a, b] = [before, after].map(|f| f.F_y[0] * driven.delta.cos() + f.F_y[1]);
        assert_relative_eq!(a, b, max_relative = 1e-12);
    }

    #[test]
    fn braking_by_load_is_alike_at_both_axles() {
        let car = Car { brake_front_share: BrakeShare::Rule(ShareRule::ByLoad), ..Car::default() };
        let axles = car.axle_sample(&MotionSample { a_x: -6.0, ..row() });
        assert_relative_eq!(
            axles.force.F_x[0] / axles.F_z[0],
            axles.force.F_x[1] / axles.F_z[1],
            max_relative = 1e-12
        );
        let driven = car.axle_sample(&MotionSample { a_x: 3.0, ..row() });
        assert_eq!(driven.force.F_x[0], 0.0, "rear-wheel drive");
    }

    #[test]
    fn crest_and_rolling_resistance() {
        let car = Car { c_roll: 0.01, ..Car::default() };
        let [level, crest] = [9.81, 6.0].map(|a_z| car.axle_sample(&MotionSample { a_z, ..row() }));
        assert_relative_eq!(level.F_z[0] + level.F_z[1], 780.0 * 9.81, max_relative = 1e-12);
        assert_relative_eq!(crest.F_z[0] + crest.F_z[1], 780.0 * 6.0, max_relative = 1e-12);
        let straight = MotionSample { v_x: 30.0, a_z: 9.81, ..MotionSample::default() };
        let drag = car.aero.drag(30.0);
        assert_relative_eq!(
            car.axle_sample(&straight).force.F_x[1],
            drag + 0.01 * 780.0 * 9.81,
            max_relative = 1e-12
        );
    }
}
