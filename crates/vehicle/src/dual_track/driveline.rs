//! Drives the wheels: demand to torque by limits or a map of the engine, split between axles, differentials.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use serde::{Deserialize, Serialize};

use tire::Number;

use super::{FRONT, PerAxle, PerWheel, REAR};
use crate::table::Map;
use crate::wheel::Lock;

/// Speed of the driven wheels [rad/s] around standstill over which the drag of an engine changes its sign.
const IDLE: f64 = 1.0;

/// Engine and driveline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// Share of the torque that goes to the front axle [-].
    pub front_share: f64,
    /// Largest driving torque of all wheels together [N m].
    pub torque_max: f64,
    /// Largest driving power [W].
    pub power_max: f64,
    /// Torque of all wheels together [N m] over their speed [rad/s] and the pedal [0 to 1]; without it, the torque
    /// that the demanded force needs.
    pub map: Option<Map>,
    /// Demanded force [N] at which the pedal is down, for a map.
    pub force_max: f64,
    /// Limited-slip differential of each axle.
    pub locks: PerAxle<Lock>,
}

impl Default for Drive {
    fn default() -> Self {
        Self {
            front_share: 0.0,
            torque_max: 3000.0,
            power_max: 300e3,
            map: None,
            force_max: 10e3,
            locks: [Lock::default(); 2],
        }
    }
}

impl Drive {
    /// Driving torque of each wheel [N m] for a demanded force [N].
    #[inline]
    pub(super) fn torques<T: Number>(
        &self,
        F_x: T,
        omega: PerWheel<T>,
        radius: PerAxle<f64>,
    ) -> PerWheel<T> {
        let share = [self.front_share, 1.0 - self.front_share];
        let mean = |values: PerAxle<T>| values[FRONT] * share[FRONT] + values[REAR] * share[REAR];
        let speed = mean([(omega[0] + omega[1]) * 0.5, (omega[2] + omega[3]) * 0.5]);
        let lever = radius[FRONT] * share[FRONT] + radius[REAR] * share[REAR];
        let total = self.total(F_x, speed, lever);
        let mut torques = [T::zero(); 4];
        for axle in [FRONT, REAR] {
            let (i, torque) = (2 * axle, total * share[axle]);
            let held = self.locks[axle].held([omega[i], omega[i + 1]], torque);
            torques[i] = (torque - held) * 0.5;
            torques[i + 1] = (torque + held) * 0.5;
        }
        torques
    }

    /// Torque of all wheels together [N m].
    #[inline]
    fn total<T: Number>(&self, F_x: T, speed: T, lever: f64) -> T {
        let demand = if F_x > 0.0 { F_x } else { T::zero() };
        let wanted = match &self.map {
            None => demand * lever,
            Some(map) => {
                let torque = map.at(speed.abs(), demand / self.force_max);
                // The drag of an engine brakes in both directions, and not at rest.
                if torque < 0.0 { torque * speed / (speed.abs() + IDLE) } else { torque }
            }
        };
        let most =
            if speed * wanted > self.power_max { T::from(self.power_max) / speed } else { wanted };
        if most > self.torque_max { self.torque_max.into() } else { most }
    }
}
