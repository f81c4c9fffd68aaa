//! The speed controller (PI) and the path follower (preview steering) of the driver.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::characteristic_value::ParameterError;
use crate::path::GroundPath;

/// Gains of the speed controller: the driving force is proportional to the missing speed, and to its integral.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpeedController {
    /// Driving force for a missing speed [N.s/m].
    #[schemars(example = 4000.0)]
    pub gain: f64,
    /// Time after which a missing speed asks for as much force again [s].
    #[schemars(example = 2.0)]
    pub integral_time: f64,
    /// Largest driving force [N].
    #[schemars(example = 8000.0)]
    pub max_drive: f64,
    /// Largest braking force [N], a positive number.
    #[schemars(example = 10000.0)]
    pub max_brake: f64,
}

impl Default for SpeedController {
    fn default() -> Self {
        SpeedController { gain: 4000.0, integral_time: 2.0, max_drive: 8000.0, max_brake: 10000.0 }
    }
}

impl SpeedController {
    /// Refuses gains that control nothing.
    ///
    /// # Errors
    /// With the first one.
    pub fn check_gains(&self) -> Result<(), ParameterError> {
        let keys = [
            ("gain", self.gain, "N.s/m"),
            ("integral_time", self.integral_time, "s"),
            ("max_drive", self.max_drive, "N"),
            ("max_brake", self.max_brake, "N"),
        ];
        ParameterError::check_positive(keys)
            .map_err(|it| ParameterError::at_common_key("speed_controller", it.message))
    }

    /// The driving force [N] for a missing speed [m/s], with the integral of it [m] over steps of `step` [s]. The integral waits while
    /// the force is at its limit.
    pub fn driving_force(&self, missing: f64, integral: &mut f64, step: f64) -> f64 {
        let wanted = self.gain * (missing + *integral / self.integral_time);
        let force = wanted.clamp(-self.max_brake, self.max_drive);
        if force == wanted || (wanted > force) != (missing > 0.0) {
            *integral += missing * step;
        }
        force
    }
}

/// Gains of the path follower, which steers for the arc that leads to the path where the car will be soon.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PathFollower {
    /// Time by which the driver looks ahead [s].
    #[schemars(example = 0.5)]
    pub preview: f64,
    /// Road-wheel angle for a missing yaw rate [s].
    #[schemars(example = 0.1)]
    pub yaw_gain: f64,
    /// Time after which an offset from a circle asks for as much steering again [s].
    #[schemars(example = 4.0)]
    pub integral_time: f64,
    /// Largest road-wheel angle [rad].
    #[schemars(example = 0.6)]
    pub max_steer: f64,
}

impl Default for PathFollower {
    fn default() -> Self {
        PathFollower { preview: 0.5, yaw_gain: 0.1, integral_time: 4.0, max_steer: 0.6 }
    }
}

/// The wheelbase that the path follower steers for when nobody says another one [m].
const USUAL_WHEELBASE: f64 = 2.7;
/// The driver looks ahead by this much at least [m].
const SHORTEST: f64 = 3.0;

/// Position and motion of the car in the frame of the path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlanarMotion {
    pub x: f64,
    pub y: f64,
    pub psi: f64,
    pub v_x: f64,
    pub r: f64,
}

impl PathFollower {
    /// Refuses gains that follow nothing.
    ///
    /// # Errors
    /// With the first one.
    pub fn check_gains(&self) -> Result<(), ParameterError> {
        let keys = [
            ("preview", self.preview, "s"),
            ("integral_time", self.integral_time, "s"),
            ("max_steer", self.max_steer, "rad"),
        ];
        let wrong = |it: ParameterError| ParameterError::at_common_key("path_follower", it.message);
        ParameterError::check_positive(keys).map_err(wrong)?;
        if self.yaw_gain.is_finite() && self.yaw_gain >= 0.0 {
            return Ok(());
        }
        let message = format!("expected a number from 0 on for `yaw_gain` [s], found {}", self.yaw_gain);
        Err(ParameterError::at_common_key("path_follower", message))
    }

    /// The road-wheel angle [rad], with the integral of the offset [m.s] over steps of `step` [s].
    ///
    /// The arc through the car, along its heading, and through a point at the distance L ahead and e to the side has the curvature
    /// 2 e / L². A car of the wheelbase l without slip angles has it at the road-wheel angle l times that.
    pub(crate) fn road_wheel_angle(
        &self,
        path: &GroundPath,
        car: PlanarMotion,
        wheelbase: Option<f64>,
        integral: &mut f64,
        step: f64,
    ) -> f64 {
        let ahead = (car.v_x * self.preview).max(SHORTEST);
        let (sin, cos) = car.psi.sin_cos();
        let wheelbase = wheelbase.unwrap_or(USUAL_WHEELBASE);
        if matches!(path, GroundPath::Circle(_)) {
            *integral += path.lateral_offset(car.x, car.y) * step;
        }
        let offset =
            path.lateral_offset(car.x + ahead * cos, car.y + ahead * sin) + *integral / self.integral_time;
        let curvature = 2.0 * offset / (ahead * ahead);
        let wanted = wheelbase * curvature + self.yaw_gain * (car.v_x * curvature - car.r);
        wanted.clamp(-self.max_steer, self.max_steer)
    }
}
