//! Names the errors of sensors and car that can be estimated together with the tires: the causes of a misfit.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::borrow::Cow;

use preparation::Interpolation;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use vehicle::Vehicle;

use crate::recording::Drive;

/// How many causes there are.
pub const COUNT: usize = 22;

/// An error that is constant over a drive. Of a channel the record is (1 + gain) × the true value, one delay before, + offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(usize)]
pub enum Cause {
    /// Offset of the steering angle [rad].
    SteeringOffset,
    /// Relative error of the scale of the steering angle [-].
    SteeringGain,
    /// Delay of the steering angle after the sensors of motion [s].
    SteeringDelay,
    /// Relative error of the scale of v_x [-].
    SpeedGain,
    /// Mounting angle of the sensor of v_y [rad]: v_x that it takes for v_y.
    SideslipOffset,
    /// Distance of the sensor of v_y ahead of the centre of gravity [m].
    SideslipLever,
    /// Delay of v_y [s].
    SideslipDelay,
    /// Offset of the yaw rate [rad/s].
    YawRateOffset,
    /// Relative error of the scale of the yaw rate [-].
    YawRateGain,
    /// Delay of the yaw rate [s].
    YawRateDelay,
    /// Offset of the lateral acceleration [m/s²].
    AccelerationOffset,
    /// Relative error of the scale of the lateral acceleration [-].
    AccelerationGain,
    /// Distance of the accelerometer ahead of the centre of gravity [m].
    AccelerationLever,
    /// Delay of the lateral acceleration [s].
    AccelerationDelay,
    /// Delay of the longitudinal force after the sensors of motion [s].
    ForceDelay,
    /// Relative error of the longitudinal force [-].
    ForceGain,
    /// Relative error of the mass [-].
    Mass,
    /// Distance of the centre of gravity ahead of where the configuration has it [m].
    CentreOfGravity,
    /// Relative error of the yaw inertia [-].
    Inertia,
    /// Height of the centre of gravity above that of the configuration [m].
    Height,
    /// Relaxation length of the front tires [m].
    RelaxationFront,
    /// Relaxation length of the rear tires [m].
    RelaxationRear,
}

/// What is told of a cause.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// Name in configurations and reports.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Standard deviation before any data, in that unit.
    pub std: f64,
    /// What people read it in: factor and unit.
    pub shown: (f64, &'static str),
}

const DEGREES: (f64, &str) = (180.0 / std::f64::consts::PI, "deg");
const PERCENT: (f64, &str) = (100.0, "%");
const MILLISECONDS: (f64, &str) = (1000.0, "ms");

impl Cause {
    /// All of them, in the order of their values.
    pub const ALL: [Self; COUNT] = [
        Self::SteeringOffset,
        Self::SteeringGain,
        Self::SteeringDelay,
        Self::SpeedGain,
        Self::SideslipOffset,
        Self::SideslipLever,
        Self::SideslipDelay,
        Self::YawRateOffset,
        Self::YawRateGain,
        Self::YawRateDelay,
        Self::AccelerationOffset,
        Self::AccelerationGain,
        Self::AccelerationLever,
        Self::AccelerationDelay,
        Self::ForceDelay,
        Self::ForceGain,
        Self::Mass,
        Self::CentreOfGravity,
        Self::Inertia,
        Self::Height,
        Self::RelaxationFront,
        Self::RelaxationRear,
    ];

    /// Errors of the car, which are always estimated: the data hardly see them, so that their standard deviations widen intervals.
    pub const CAR: [Self; 5] =
        [Self::ForceGain, Self::Mass, Self::CentreOfGravity, Self::Inertia, Self::Height];

    /// Delays of channels; one of all of them at once would not be seen.
    pub const DELAYS: [Self; 5] = [
        Self::SteeringDelay,
        Self::SideslipDelay,
        Self::YawRateDelay,
        Self::AccelerationDelay,
        Self::ForceDelay,
    ];

    /// What tires do that curves do not tell.
    pub const TIRES: [Self; 2] = [Self::RelaxationFront, Self::RelaxationRear];

    /// What is told of it. The standard deviations are those of sensors that somebody mounted and calibrated with care, but for
    /// mistakes that happen.
    pub fn about(self) -> About {
        let (name, title, unit, std, shown) = match self {
            Self::SteeringOffset => {
                ("steering_offset", "offset of the steering angle", "rad", 0.01, DEGREES)
            }
            Self::SteeringGain => {
                ("steering_gain", "scale error of the steering angle", "-", 0.05, PERCENT)
            }
            Self::SteeringDelay => {
                ("steering_delay", "delay of the steering angle", "s", 0.05, MILLISECONDS)
            }
            Self::SpeedGain => ("v_x_gain", "scale error of v_x", "-", 0.02, PERCENT),
            Self::SideslipOffset => {
                ("v_y_angle", "mounting angle of the v_y sensor", "rad", 0.01, DEGREES)
            }
            Self::SideslipLever => {
                ("v_y_lever", "distance of the v_y sensor ahead of the cg", "m", 0.5, (1.0, "m"))
            }
            Self::SideslipDelay => ("v_y_delay", "delay of v_y", "s", 0.05, MILLISECONDS),
            Self::YawRateOffset => {
                ("r_offset", "offset of the yaw rate", "rad/s", 0.01, (DEGREES.0, "deg/s"))
            }
            Self::YawRateGain => ("r_gain", "scale error of the yaw rate", "-", 0.03, PERCENT),
            Self::YawRateDelay => ("r_delay", "delay of the yaw rate", "s", 0.05, MILLISECONDS),
            Self::AccelerationOffset => {
                ("a_y_offset", "offset of the lateral acceleration", "m/s2", 0.2, (1.0, "m/s2"))
            }
            Self::AccelerationGain => {
                ("a_y_gain", "scale error of the lateral acceleration", "-", 0.03, PERCENT)
            }
            Self::AccelerationLever => {
                ("a_y_lever", "distance of the accelerometer ahead of the cg", "m", 0.5, (1.0, "m"))
            }
            Self::AccelerationDelay => {
                ("a_y_delay", "delay of the lateral acceleration", "s", 0.05, MILLISECONDS)
            }
            Self::ForceDelay => {
                ("F_x_delay", "delay of the longitudinal force", "s", 0.05, MILLISECONDS)
            }
            Self::ForceGain => {
                ("F_x_gain", "relative error of the longitudinal force", "-", 0.05, PERCENT)
            }
            Self::Mass => ("mass", "relative error of the mass", "-", 0.02, PERCENT),
            Self::CentreOfGravity => (
                "cg",
                "distance of the cg ahead of its place in the configuration",
                "m",
                0.01,
                (100.0, "cm"),
            ),
            Self::Inertia => ("inertia", "relative error of the yaw inertia", "-", 0.1, PERCENT),
            Self::Height => (
                "height",
                "height of the cg above its height in the configuration",
                "m",
                0.02,
                (100.0, "cm"),
            ),
            Self::RelaxationFront => {
                ("relaxation_front", "relaxation length of the front tires", "m", 0.3, (1.0, "m"))
            }
            Self::RelaxationRear => {
                ("relaxation_rear", "relaxation length of the rear tires", "m", 0.3, (1.0, "m"))
            }
        };
        About { name, title, unit, std, shown }
    }
}

/// By its name.
impl JsonSchema for Cause {
    fn schema_name() -> Cow<'static, str> {
        "Cause".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        let choice = |cause: Self| {
            let About { name, title, unit, std, .. } = cause.about();
            let words = format!("The {title} [{unit}]; usual standard deviation {std}.");
            json_schema!({ "const": name, "description": words })
        };
        json_schema!({ "type": "string", "oneOf": Self::ALL.map(choice) })
    }
}

impl<'de> Deserialize<'de> for Cause {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        let found = Self::ALL.into_iter().find(|cause| cause.about().name == name);
        found.ok_or_else(|| {
            let known = Self::ALL.map(|cause| format!("`{}`", cause.about().name)).join(", ");
            D::Error::custom(format!("unknown error `{name}`, expected one of {known}"))
        })
    }
}

/// Relaxation length where a fit starts [m].
pub const LENGTH: f64 = 0.2;

/// A value for each cause, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Causes<T = f64>(pub [T; COUNT]);

impl Default for Causes {
    /// No error.
    fn default() -> Self {
        Self([0.0; COUNT])
    }
}

impl<T> std::ops::Index<Cause> for Causes<T> {
    type Output = T;

    #[inline(always)]
    fn index(&self, cause: Cause) -> &T {
        &self.0[cause as usize]
    }
}

impl<T> std::ops::IndexMut<Cause> for Causes<T> {
    #[inline(always)]
    fn index_mut(&mut self, cause: Cause) -> &mut T {
        &mut self.0[cause as usize]
    }
}

impl Causes {
    /// Moves relaxation lengths to where their fit starts.
    pub fn relax(&mut self) {
        Cause::TIRES.iter().for_each(|cause| self[*cause] = LENGTH);
    }

    /// The true car behind that of a configuration.
    pub fn car(&self, car: &Vehicle) -> Vehicle {
        let vehicle::Body { m, I_zz, l_f, l_r, h } = car.body;
        let ahead = self[Cause::CentreOfGravity];
        let body = vehicle::Body {
            m: m * (1.0 + self[Cause::Mass]),
            I_zz: I_zz * (1.0 + self[Cause::Inertia]),
            l_f: l_f - ahead,
            l_r: l_r + ahead,
            h: h + self[Cause::Height],
        };
        Vehicle { body, ..*car }
    }

    /// A recording with its true inputs.
    pub fn inputs(&self, recording: &Drive) -> Drive {
        let (start, end) = (recording.t[0], recording.t[recording.len() - 1]);
        let moved = |column: &[f64], delay: f64| {
            let late = recording.t.iter().map(|t| (t + delay).clamp(start, end));
            Interpolation::Linear.resample(&recording.t, column, &late.collect::<Vec<_>>())
        };
        let read = moved(&recording.delta, self[Cause::SteeringDelay]);
        let pushed = moved(&recording.F_x, self[Cause::ForceDelay]);
        let offset = self[Cause::SteeringOffset];
        let scale = 1.0 + self[Cause::SteeringGain];
        let force = 1.0 + self[Cause::ForceGain];
        Drive {
            delta: read.iter().map(|delta| (delta - offset) / scale).collect(),
            F_x: pushed.iter().map(|F_x| force * F_x).collect(),
            ..recording.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_the_values_and_names_are_those_of_reports() {
        for (index, cause) in Cause::ALL.into_iter().enumerate() {
            assert_eq!(cause as usize, index);
            assert!(cause.about().std > 0.0);
        }
        let mut names: Vec<_> = Cause::ALL.iter().map(|cause| cause.about().name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), COUNT);
    }
}
