//! Gathers the parameters of the detailed single track, and refuses those of no car.
#![allow(non_snake_case, reason = "forces and moments of inertia are written as in the equations")]

use serde::{Deserialize, Serialize};

use crate::body::{Aerodynamics, VehicleBody};
use crate::dual_track::{BadParameter, Brakes, ParameterBound, RimParameters, check_parameter};
use crate::wheel::DifferentialLock;

/// Shortest lag of the steering [s] of an actuator that has a limit of its rate.
pub const SHORTEST_LAG: f64 = 0.005;

/// Everything about a car but its tires. The default is the demo car without any option.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetailedSingleTrackParameters {
    /// Masses and lengths.
    pub body: VehicleBody,
    /// Drag and downforce.
    pub aero: Aerodynamics,
    /// Share of a driving force that acts at the front axle [-].
    pub front_drive: f64,
    /// Brakes. Without spin, of these only the balance counts.
    pub brakes: Brakes,
    /// Wheels without their tires.
    pub rims: RimParameters,
    /// Limited-slip differential of the rear axle.
    pub lock: DifferentialLock,
    /// Distance between the rear wheels [m], for the differential.
    pub track_r: f64,
    /// What is between the demanded and the actual steering angle.
    pub steering: SteeringActuator,
    /// What wheels and tires do.
    pub options: WheelDynamicsOptions,
}

/// What wheels and tires do beyond pure lateral slip that is there at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WheelDynamicsOptions {
    /// Longitudinal force weakens lateral force and is limited with it.
    pub combined: bool,
    /// Slip builds up over the relaxation length.
    pub relaxation: bool,
    /// Wheels turn by themselves, and their slip makes the longitudinal force: combined slip with relaxation.
    pub spin: bool,
}

/// Actuator of the steering. The default is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SteeringActuator {
    /// Time constant [s]; 0 for none.
    pub lag: f64,
    /// Largest rate [rad/s]; 0 for no limit.
    pub rate_max: f64,
    /// Steering angle that the front axle loses for a lateral force on it [rad/N].
    pub compliance: f64,
}

impl SteeringActuator {
    /// Whether the angle follows its demand with a delay.
    pub fn has_lag(&self) -> bool {
        self.lag > 0.0 || self.rate_max > 0.0
    }

    /// Time constant [s] of one that lags.
    pub fn time_constant(&self) -> f64 {
        self.lag.max(SHORTEST_LAG)
    }
}

impl DetailedSingleTrackParameters {
    /// Whether one of the options is on; without, the plain car is the same one.
    pub fn has_options(&self) -> bool {
        let WheelDynamicsOptions { combined, relaxation, spin } = self.options;
        let lock = self.lock.drive > 0.0 || self.lock.coast > 0.0 || self.lock.preload > 0.0;
        let steering = self.steering.has_lag() || self.steering.compliance > 0.0;
        combined || relaxation || spin || lock || steering || self.front_drive > 0.0
    }

    /// Asserts that they describe a car that can be integrated.
    ///
    /// # Errors
    /// Names the first parameter that does not, and its bound.
    pub fn check(&self) -> Result<(), BadParameter> {
        use ParameterBound::{AtLeast, NotNegative, Positive, Share, Within};
        let VehicleBody { m, I_zz, l_f, l_r, h } = self.body;
        let (brake, rims, lock) = (&self.brakes, &self.rims, &self.lock);
        for (name, value, bound) in [
            ("body.m", m, Positive),
            ("body.I_zz", I_zz, Positive),
            ("body.l_f", l_f, Positive),
            ("body.l_r", l_r, Positive),
            ("body.h", h, NotNegative),
            ("body.track_r", self.track_r, Positive),
            ("drive.front_share", self.front_drive, Share),
            ("brake.front_share", brake.front_share, Share),
            ("brake.torque_max", brake.torque_max, NotNegative),
            ("brake.windup", brake.windup, AtLeast(1e-3)),
            ("wheel.I_yy", rims.I_yy, Positive),
            ("wheel.radius", rims.radius, Positive),
            ("wheel.relaxation_min", rims.relaxation_min, AtLeast(1e-3)),
            ("diff_r.drive_lock", lock.drive, Share),
            ("diff_r.coast_lock", lock.coast, Share),
            ("diff_r.preload", lock.preload, NotNegative),
            ("diff_r.sensitivity", lock.sensitivity, NotNegative),
            ("steer.lag", self.steering.lag, NotNegative),
            ("steer.rate_max", self.steering.rate_max, NotNegative),
            ("steer.compliance", self.steering.compliance, Within(1e-4)),
        ] {
            check_parameter(name, value, bound.is_met_by(value), || bound.describe())?;
        }
        Ok(())
    }
}

impl Default for DetailedSingleTrackParameters {
    fn default() -> Self {
        Self {
            body: VehicleBody::default(),
            aero: Aerodynamics::default(),
            front_drive: 0.0,
            brakes: Brakes::default(),
            rims: RimParameters::default(),
            lock: DifferentialLock::default(),
            track_r: 1.5,
            steering: SteeringActuator::default(),
            options: WheelDynamicsOptions::default(),
        }
    }
}
