//! Gathers the parameters of the dual-track car, and refuses those of no car.
#![allow(non_snake_case, reason = "forces and moments of inertia are written as in the equations")]

use serde::{Deserialize, Serialize};

use super::aero::AeroMap;
use super::brakes::Brakes;
use super::driveline::Drivetrain;
use super::rims::RimParameters;
use super::steering::SteeringGeometry;
use super::suspension::Suspension;
use crate::body::{G, VehicleBody};

/// Everything about a car but its tires. The default is the demo car.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DualTrackParameters {
    /// Masses and lengths.
    pub body: VehicleBody,
    /// Springs, dampers and links.
    pub suspension: Suspension,
    /// Angles of the wheels.
    pub steering: SteeringGeometry,
    /// Drag and downforce.
    pub aero: AeroMap,
    /// Engine and driveline.
    pub drive: Drivetrain,
    /// Brakes.
    pub brakes: Brakes,
    /// Wheels without their tires.
    pub rims: RimParameters,
}

/// A parameter that describes no car, alone or together with others.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}, expected {expected}")]
pub struct BadParameter {
    /// Its name, as in the FMU.
    pub name: &'static str,
    /// Its value [SI].
    pub value: f64,
    /// What it has to be.
    pub expected: String,
}

/// What a parameter has to be.
pub(crate) enum ParameterBound {
    Positive,
    NotNegative,
    Share,
    AtLeast(f64),
    Within(f64),
}

impl ParameterBound {
    pub fn is_met_by(&self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Share => (0.0..=1.0).contains(&value),
                Self::AtLeast(least) => value >= *least,
                Self::Within(most) => value.abs() <= *most,
            }
    }

    pub fn describe(&self) -> String {
        match self {
            Self::Positive => "a number above 0".to_owned(),
            Self::NotNegative => "a number of at least 0".to_owned(),
            Self::Share => "a number from 0 to 1".to_owned(),
            Self::AtLeast(least) => format!("a number of at least {least}"),
            Self::Within(most) => format!("a number from -{most} to {most}"),
        }
    }
}

impl DualTrackParameters {
    /// Asserts that they describe a car that stands on its wheels and can be integrated.
    ///
    /// # Errors
    /// Names the first parameter that does not, and its bound.
    pub fn check(&self) -> Result<(), BadParameter> {
        let bounds = self.body_bounds().into_iter().chain(self.wheel_bounds());
        for (name, value, bound) in bounds {
            check_parameter(name, value, bound.is_met_by(value), || bound.describe())?;
        }
        self.check_tables()?;
        check_static_stability(&self.body, &self.suspension)
    }

    fn body_bounds(&self) -> Vec<(&'static str, f64, ParameterBound)> {
        use ParameterBound::{AtLeast, NotNegative, Positive, Within};
        let VehicleBody { m, I_zz, l_f, l_r, h } = self.body;
        let s = &self.suspension;
        let air = &self.aero.constant;
        vec![
            ("body.m", m, Positive),
            ("body.I_zz", I_zz, Positive),
            ("body.I_xx", s.I_xx, Positive),
            ("body.I_yy", s.I_yy, Positive),
            ("body.l_f", l_f, Positive),
            ("body.l_r", l_r, Positive),
            ("body.h", h, NotNegative),
            ("body.track_f", s.track[0], Positive),
            ("body.track_r", s.track[1], Positive),
            ("ride.stiffness_f", s.ride_stiffness[0], Positive),
            ("ride.stiffness_r", s.ride_stiffness[1], Positive),
            ("ride.damping_f", s.ride_damping[0], NotNegative),
            ("ride.damping_r", s.ride_damping[1], NotNegative),
            ("roll.stiffness_f", s.roll_stiffness[0], NotNegative),
            ("roll.stiffness_r", s.roll_stiffness[1], NotNegative),
            ("roll.damping_f", s.roll_damping[0], NotNegative),
            ("roll.damping_r", s.roll_damping[1], NotNegative),
            ("roll.centre_f", s.roll_centre[0], Within(10.0)),
            ("roll.centre_r", s.roll_centre[1], Within(10.0)),
            ("pitch.centre", s.pitch_centre, Within(10.0)),
            ("suspension.lag", s.lag, AtLeast(1e-3)),
            ("aero.rho", air.rho, NotNegative),
            ("aero.area", air.area, NotNegative),
            ("aero.C_d", air.C_d, NotNegative),
            ("aero.C_lf", air.C_lf, Within(100.0)),
            ("aero.C_lr", air.C_lr, Within(100.0)),
            ("aero.ride_height_f", self.aero.ride_height[0], Within(10.0)),
            ("aero.ride_height_r", self.aero.ride_height[1], Within(10.0)),
        ]
    }

    fn wheel_bounds(&self) -> Vec<(&'static str, f64, ParameterBound)> {
        use ParameterBound::{AtLeast, NotNegative, Positive, Share, Within};
        let (steer, drive, brake, rims) = (&self.steering, &self.drive, &self.brakes, &self.rims);
        let [front, rear] = &drive.locks;
        vec![
            ("steer.ackermann", steer.ackermann, Within(2.0)),
            ("steer.compliance", steer.compliance, NotNegative),
            ("drive.front_share", drive.front_share, Share),
            ("drive.torque_max", drive.torque_max, NotNegative),
            ("drive.power_max", drive.power_max, NotNegative),
            ("drive.ratio", drive.ratio, Positive),
            ("drive.force_max", drive.force_max, Positive),
            ("diff_f.drive_lock", front.drive, Share),
            ("diff_f.coast_lock", front.coast, Share),
            ("diff_f.preload", front.preload, NotNegative),
            ("diff_f.sensitivity", front.sensitivity, NotNegative),
            ("diff_r.drive_lock", rear.drive, Share),
            ("diff_r.coast_lock", rear.coast, Share),
            ("diff_r.preload", rear.preload, NotNegative),
            ("diff_r.sensitivity", rear.sensitivity, NotNegative),
            ("brake.front_share", brake.front_share, Share),
            ("brake.torque_max", brake.torque_max, NotNegative),
            ("brake.force_max", brake.force_max, Positive),
            ("brake.windup", brake.windup, AtLeast(1e-3)),
            ("wheel.I_yy", rims.I_yy, Positive),
            ("wheel.radius", rims.radius, Positive),
            ("wheel.relaxation_min", rims.relaxation_min, AtLeast(1e-3)),
        ]
    }
}

/// Refuses springs that hold a car less than its weight tips it: it would fall over at rest.
///
/// # Errors
/// With the stiffness that is too low.
pub fn check_static_stability(body: &VehicleBody, suspension: &Suspension) -> Result<(), BadParameter> {
    let VehicleBody { m, l_f, l_r, h, .. } = *body;
    let [roll_f, roll_r] = suspension.roll_centre;
    let axis = (l_r * roll_f + l_f * roll_r) / (l_f + l_r);
    let roll = suspension.roll_stiffness[0] + suspension.roll_stiffness[1];
    let tipping = m * G * (h - axis);
    check_parameter("roll.stiffness_f + roll.stiffness_r", roll, roll > tipping.max(0.0), || {
        format!("above {tipping:.4} N.m/rad, with which the weight tips the body about its roll axis")
    })?;
    let pitch = suspension.pitch_stiffness(body);
    let tipping = m * G * (h - suspension.pitch_centre);
    check_parameter("2 (ride.stiffness_f l_f² + ride.stiffness_r l_r²)", pitch, pitch > tipping, || {
        format!("above {tipping:.4} N.m/rad, with which the weight tips the body about its pitch centre")
    })
}

pub(crate) fn check_parameter(
    name: &'static str,
    value: f64,
    holds: bool,
    expected: impl Fn() -> String,
) -> Result<(), BadParameter> {
    if holds { Ok(()) } else { Err(BadParameter { name, value, expected: expected() }) }
}
