//! Drives the wheels: demand to torque by limits or a map of the engine, split between axles, differentials.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use serde::{Deserialize, Serialize};

use tire::Number;

use super::brakes::pedal_position;
use super::{FRONT, PerAxle, PerWheel, REAR};
use crate::table::{BilinearMap, PiecewiseLinearCurve};
use crate::wheel::DifferentialLock;

/// Speed of the driven wheels [rad/s] around standstill over which the drag of an engine changes its sign.
const IDLE: f64 = 1.0;

/// Torque of an engine [N m] over its speed [rad/s].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum EngineTorque {
    /// Its largest torque: the demanded one is met up to it.
    FullLoad(PiecewiseLinearCurve),
    /// Its torque over speed and pedal [0 to 1]; below 0 it drags.
    Pedal(BilinearMap),
}

impl EngineTorque {
    /// The torque with the pedal down [N m] at a speed [rad/s].
    pub fn full_load_torque(&self, speed: f64) -> f64 {
        match self {
            Self::FullLoad(curve) => curve.interpolate(speed),
            Self::Pedal(map) => map.interpolate(speed, 1.0)[0],
        }
    }

    /// The first and the last speed of the table [rad/s]; `None` of one with a single speed, which has no end.
    pub fn speed_range(&self) -> Option<[f64; 2]> {
        match self {
            Self::FullLoad(curve) => curve.argument_range(),
            Self::Pedal(map) => map.argument_ranges()[0],
        }
    }

    /// Every torque of the table [N m].
    pub(super) fn table_torques(&self) -> Vec<f64> {
        match self {
            Self::FullLoad(curve) => curve.values().to_vec(),
            Self::Pedal(map) => map.values().flatten().copied().collect(),
        }
    }

    /// The steepest slope over speed [N m s/rad].
    fn steepest_torque_slope(&self) -> f64 {
        match self {
            Self::FullLoad(curve) => curve.steepest_slope(),
            Self::Pedal(map) => map.steepest_slope(),
        }
    }
}

/// Engine and driveline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drivetrain {
    /// Share of the torque that goes to the front axle [-].
    pub front_share: f64,
    /// Largest driving torque of all wheels together [N m].
    pub torque_max: f64,
    /// Largest driving power [W].
    pub power_max: f64,
    /// What the engine gives; without it, the torque that the demanded force needs.
    pub engine: Option<EngineTorque>,
    /// Speed of the engine over that of the driven wheels [-].
    pub ratio: f64,
    /// Demanded force [N] at which the pedal is down, for a map.
    pub force_max: f64,
    /// Limited-slip differential of each axle.
    pub locks: PerAxle<DifferentialLock>,
}

impl Default for Drivetrain {
    fn default() -> Self {
        Self {
            front_share: 0.0,
            torque_max: 3000.0,
            power_max: 300e3,
            engine: None,
            ratio: 1.0,
            force_max: 10e3,
            locks: [DifferentialLock::default(); 2],
        }
    }
}

impl Drivetrain {
    /// Driving torque of each wheel [N m] for a demanded force [N].
    #[inline]
    pub(super) fn wheel_torques<T: Number>(
        &self,
        F_x: T,
        omega: PerWheel<T>,
        radius: PerAxle<f64>,
    ) -> PerWheel<T> {
        let share = [self.front_share, 1.0 - self.front_share];
        let speed = self.driven_wheel_speed(omega);
        let lever = radius[FRONT] * share[FRONT] + radius[REAR] * share[REAR];
        let total = self.total_wheel_torque(F_x, speed, lever);
        let mut torques = [T::zero(); 4];
        for axle in [FRONT, REAR] {
            let (i, torque) = (2 * axle, total * share[axle]);
            let held = self.locks[axle].locking_torque([omega[i], omega[i + 1]], torque);
            torques[i] = (torque - held) * 0.5;
            torques[i + 1] = (torque + held) * 0.5;
        }
        torques
    }

    /// Speed of the driven wheels [rad/s].
    #[inline]
    pub(super) fn driven_wheel_speed<T: Number>(&self, omega: PerWheel<T>) -> T {
        (omega[0] + omega[1]) * (0.5 * self.front_share)
            + (omega[2] + omega[3]) * (0.5 * (1.0 - self.front_share))
    }

    /// How far the pedal is down [0 to 1] for a demanded force [N].
    #[inline]
    pub(super) fn pedal_position<T: Number>(&self, F_x: T) -> T {
        if F_x > 0.0 { pedal_position(F_x, self.force_max) } else { T::zero() }
    }

    /// Torque of all wheels together [N m].
    #[inline]
    fn total_wheel_torque<T: Number>(&self, F_x: T, speed: T, lever: f64) -> T {
        let demand = if F_x > 0.0 { F_x * lever } else { T::zero() };
        let wanted = match &self.engine {
            None => demand,
            Some(engine) => {
                let revs = speed.abs() * self.ratio;
                let torque = match engine {
                    EngineTorque::FullLoad(curve) => {
                        let most = curve.interpolate(revs) * self.ratio;
                        if demand > most { most } else { demand }
                    }
                    EngineTorque::Pedal(map) => {
                        map.interpolate(revs, self.pedal_position(F_x))[0] * self.ratio
                    }
                };
                // The drag of an engine brakes in both directions, and not at rest.
                if torque < 0.0 { torque * speed / (speed.abs() + IDLE) } else { torque }
            }
        };
        let most = if speed * wanted > self.power_max { T::from(self.power_max) / speed } else { wanted };
        if most > self.torque_max { self.torque_max.into() } else { most }
    }

    /// Upper bound of the pole that the engine gives to wheels of a moment of inertia [kg m²], each [1/s].
    pub(super) fn fastest_pole(&self, inertia: f64) -> f64 {
        let Some(engine) = &self.engine else { return 0.0 };
        let drag = engine.table_torques().into_iter().fold(0.0, |most, torque| f64::max(most, -torque));
        // The wheels of an axle share the torque: those of one axle turn slowest against it.
        (engine.steepest_torque_slope() * self.ratio * self.ratio + drag * self.ratio / IDLE)
            / (2.0 * inertia)
    }
}
