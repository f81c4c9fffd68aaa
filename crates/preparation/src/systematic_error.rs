//! The systematic errors of sensors, inputs and car that a log can have: one table of their names and units, how each acts, and the
//! key of a column that corrects it.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::borrow::Cow;
use std::fmt;

use numerics::text::format_significant;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use vehicle::SingleTrackCar;

use crate::drive::Drive;
use crate::resample::Interpolation;

/// How many errors a fit can estimate; those of the table after them only show in a log.
pub const ESTIMATED: usize = 34;

/// An error that is constant over a drive. Of a channel the record is (1 + gain) × the true value, one delay before, + offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(usize)]
pub enum SystematicError {
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
    /// Bank of the road in left turns, positive where its inside is lower [rad].
    BankLeft,
    /// The same in right turns [rad].
    BankRight,
    /// Relative fall of the friction of an axle per relative rise of its load above the static one [-].
    LoadSensitivity,
    /// Relative change of the friction of both axles from some row on [-].
    FrictionChange,
    /// Drift of the clock of v_y after the other channels': delay per time [-].
    SideslipClock,
    /// Drift of the clock of yaw rate and lateral acceleration [-].
    InertialClock,
    /// Drift of the clock of steering angle and longitudinal force [-].
    InputClock,
    /// Group delay λ of a low-pass of v_y: over rows that are h apart it gives λ/(λ + h) of its last value and the rest of the true one [s].
    SideslipLowPass,
    /// The same of the yaw rate [s].
    YawRateLowPass,
    /// The same of the lateral acceleration [s].
    AccelerationLowPass,
    /// Part of v_y that is a roll rate, per rate of a_y [(m/s)/(m/s³)].
    Roll,
    /// Part of v_y that is a roll acceleration, per second derivative of a_y [(m/s)/(m/s⁴)].
    RollAcceleration,
    /// Relative error of the scale of v_y [-].
    SideslipGain,
}

/// How an error acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// Time by which the record is late [s].
    Delay,
    /// Share by which the record is too large; of the longitudinal force the share by which the truth is larger.
    Gain,
    /// Record at a true value of zero, in its unit.
    Offset,
    /// Distance of the sensor ahead of the centre of gravity [m].
    Lever,
    /// Angle by which the sensor is turned about the vertical axis [rad].
    MountingAngle,
    /// Distance that the tires roll until their force follows the slip [m]: no error of the log, but it looks like one.
    RelaxationLength,
    /// A datum of the car that is another one.
    CarParameter,
    /// A property of the road or the tires that the model takes as constant.
    RoadOrTire,
    /// Delay that grows with time, about the middle of the drive [-].
    ClockDrift,
    /// Group delay of a low-pass of first order at low frequencies [s].
    LowPass,
    /// Motion of a body that rolls, in a sensor that is not on its axis.
    Roll,
}

/// A row of the table of errors.
#[derive(Clone, Copy, Debug)]
pub struct ErrorDescription {
    /// The error.
    pub error: SystematicError,
    /// The channel that has it; `car` and `tires` where it is none of a channel.
    pub channel: &'static str,
    /// How it acts.
    pub kind: ErrorKind,
    /// Name in configurations and reports.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Standard deviation before any data, in that unit: of sensors that somebody mounted and calibrated with care, but for mistakes
    /// that happen.
    pub std: f64,
    /// What people read it in: factor and unit.
    pub display: (f64, &'static str),
    /// The smallest error that matters to an examination of the log. `None` where that does not look for it.
    pub least: Option<f64>,
}

const DEGREES: (f64, &str) = (180.0 / std::f64::consts::PI, "deg");
const PERCENT: (f64, &str) = (100.0, "%");
const MILLISECONDS: (f64, &str) = (1000.0, "ms");

use ErrorKind::{
    CarParameter, ClockDrift, Delay, Gain, Lever, LowPass, MountingAngle, Offset, RelaxationLength,
    RoadOrTire,
};
use SystematicError::{
    AccelerationDelay, AccelerationGain, AccelerationLever, AccelerationLowPass, AccelerationOffset,
    BankLeft, BankRight, CentreOfGravity, ForceDelay, ForceGain, FrictionChange, Height, Inertia,
    InertialClock, InputClock, LoadSensitivity, Mass, RelaxationFront, RelaxationRear, Roll,
    RollAcceleration, SideslipClock, SideslipDelay, SideslipGain, SideslipLever, SideslipLowPass,
    SideslipOffset, SpeedGain, SteeringDelay, SteeringGain, SteeringOffset, YawRateDelay, YawRateGain,
    YawRateLowPass, YawRateOffset,
};

/// All errors, in the order of their values.
#[rustfmt::skip]
const TABLE: [ErrorDescription; ESTIMATED + 1] = [
    ErrorDescription { error: SteeringOffset, channel: "delta", kind: Offset, name: "steering_offset", title: "offset of the steering angle", unit: "rad", std: 0.01, display: DEGREES, least: Some(0.0015) },
    ErrorDescription { error: SteeringGain, channel: "delta", kind: Gain, name: "steering_gain", title: "scale error of the steering angle", unit: "-", std: 0.05, display: PERCENT, least: Some(0.03) },
    ErrorDescription { error: SteeringDelay, channel: "delta", kind: Delay, name: "steering_delay", title: "delay of the steering angle", unit: "s", std: 0.05, display: MILLISECONDS, least: Some(0.008) },
    ErrorDescription { error: SpeedGain, channel: "v_x", kind: Gain, name: "v_x_gain", title: "scale error of v_x", unit: "-", std: 0.02, display: PERCENT, least: None },
    ErrorDescription { error: SideslipOffset, channel: "v_y", kind: MountingAngle, name: "v_y_angle", title: "mounting angle of the v_y sensor", unit: "rad", std: 0.01, display: DEGREES, least: Some(0.003) },
    ErrorDescription { error: SideslipLever, channel: "v_y", kind: Lever, name: "v_y_lever", title: "distance of the v_y sensor ahead of the cg", unit: "m", std: 0.5, display: (1.0, "m"), least: Some(0.1) },
    ErrorDescription { error: SideslipDelay, channel: "v_y", kind: Delay, name: "v_y_delay", title: "delay of v_y", unit: "s", std: 0.05, display: MILLISECONDS, least: Some(0.008) },
    ErrorDescription { error: YawRateOffset, channel: "r", kind: Offset, name: "r_offset", title: "offset of the yaw rate", unit: "rad/s", std: 0.01, display: (DEGREES.0, "deg/s"), least: Some(0.004) },
    ErrorDescription { error: YawRateGain, channel: "r", kind: Gain, name: "r_gain", title: "scale error of the yaw rate", unit: "-", std: 0.03, display: PERCENT, least: Some(0.02) },
    ErrorDescription { error: YawRateDelay, channel: "r", kind: Delay, name: "r_delay", title: "delay of the yaw rate", unit: "s", std: 0.05, display: MILLISECONDS, least: Some(0.008) },
    ErrorDescription { error: AccelerationOffset, channel: "a_y", kind: Offset, name: "a_y_offset", title: "offset of the lateral acceleration", unit: "m/s2", std: 0.2, display: (1.0, "m/s2"), least: Some(0.15) },
    ErrorDescription { error: AccelerationGain, channel: "a_y", kind: Gain, name: "a_y_gain", title: "scale error of the lateral acceleration", unit: "-", std: 0.03, display: PERCENT, least: Some(0.03) },
    ErrorDescription { error: AccelerationLever, channel: "a_y", kind: Lever, name: "a_y_lever", title: "distance of the accelerometer ahead of the cg", unit: "m", std: 0.5, display: (1.0, "m"), least: Some(0.1) },
    ErrorDescription { error: AccelerationDelay, channel: "a_y", kind: Delay, name: "a_y_delay", title: "delay of the lateral acceleration", unit: "s", std: 0.05, display: MILLISECONDS, least: Some(0.008) },
    ErrorDescription { error: ForceDelay, channel: "F_x", kind: Delay, name: "F_x_delay", title: "delay of the longitudinal force", unit: "s", std: 0.05, display: MILLISECONDS, least: None },
    ErrorDescription { error: ForceGain, channel: "F_x", kind: Gain, name: "F_x_gain", title: "relative error of the longitudinal force", unit: "-", std: 0.05, display: PERCENT, least: None },
    ErrorDescription { error: Mass, channel: "car", kind: CarParameter, name: "mass", title: "relative error of the mass", unit: "-", std: 0.02, display: PERCENT, least: None },
    ErrorDescription { error: CentreOfGravity, channel: "car", kind: CarParameter, name: "cg", title: "distance of the cg ahead of its place in the configuration", unit: "m", std: 0.01, display: (100.0, "cm"), least: None },
    ErrorDescription { error: Inertia, channel: "car", kind: CarParameter, name: "inertia", title: "relative error of the yaw inertia", unit: "-", std: 0.1, display: PERCENT, least: None },
    ErrorDescription { error: Height, channel: "car", kind: CarParameter, name: "height", title: "height of the cg above its height in the configuration", unit: "m", std: 0.02, display: (100.0, "cm"), least: None },
    ErrorDescription { error: RelaxationFront, channel: "tires", kind: RelaxationLength, name: "relaxation_front", title: "relaxation length of the front tires", unit: "m", std: 0.3, display: (1.0, "m"), least: Some(0.1) },
    ErrorDescription { error: RelaxationRear, channel: "tires", kind: RelaxationLength, name: "relaxation_rear", title: "relaxation length of the rear tires", unit: "m", std: 0.3, display: (1.0, "m"), least: Some(0.1) },
    ErrorDescription { error: BankLeft, channel: "road", kind: RoadOrTire, name: "bank_left", title: "bank of the road in left turns", unit: "rad", std: 0.05, display: DEGREES, least: None },
    ErrorDescription { error: BankRight, channel: "road", kind: RoadOrTire, name: "bank_right", title: "bank of the road in right turns", unit: "rad", std: 0.05, display: DEGREES, least: None },
    ErrorDescription { error: LoadSensitivity, channel: "tires", kind: RoadOrTire, name: "load_sensitivity", title: "load sensitivity of the tires' friction", unit: "-", std: 0.15, display: PERCENT, least: None },
    ErrorDescription { error: FrictionChange, channel: "tires", kind: RoadOrTire, name: "friction_change", title: "change of friction during the drive", unit: "-", std: 0.2, display: PERCENT, least: None },
    ErrorDescription { error: SideslipClock, channel: "v_y", kind: ClockDrift, name: "v_y_clock", title: "drift of the clock of v_y", unit: "-", std: 0.003, display: PERCENT, least: None },
    ErrorDescription { error: InertialClock, channel: "r", kind: ClockDrift, name: "inertial_clock", title: "drift of the clock of yaw rate and a_y", unit: "-", std: 0.003, display: PERCENT, least: None },
    ErrorDescription { error: InputClock, channel: "delta", kind: ClockDrift, name: "input_clock", title: "drift of the clock of the steering angle", unit: "-", std: 0.003, display: PERCENT, least: None },
    ErrorDescription { error: SideslipLowPass, channel: "v_y", kind: LowPass, name: "v_y_low_pass", title: "group delay of the low-pass of v_y", unit: "s", std: 0.05, display: MILLISECONDS, least: None },
    ErrorDescription { error: YawRateLowPass, channel: "r", kind: LowPass, name: "r_low_pass", title: "group delay of the low-pass of the yaw rate", unit: "s", std: 0.05, display: MILLISECONDS, least: None },
    ErrorDescription { error: AccelerationLowPass, channel: "a_y", kind: LowPass, name: "a_y_low_pass", title: "group delay of the low-pass of a_y", unit: "s", std: 0.05, display: MILLISECONDS, least: None },
    ErrorDescription { error: Roll, channel: "v_y", kind: ErrorKind::Roll, name: "v_y_roll", title: "part of the roll rate in v_y", unit: "s2", std: 0.005, display: (1000.0, "mm/s per m/s3"), least: None },
    ErrorDescription { error: RollAcceleration, channel: "v_y", kind: ErrorKind::Roll, name: "v_y_roll_acceleration", title: "part of the roll acceleration in v_y", unit: "s3", std: 0.0005, display: (1000.0, "mm/s per m/s4"), least: None },
    ErrorDescription { error: SideslipGain, channel: "v_y", kind: Gain, name: "v_y_gain", title: "scale error of v_y", unit: "-", std: 0.05, display: PERCENT, least: Some(0.05) },
];

impl SystematicError {
    /// All that a fit can estimate, in the order of their values.
    pub const ALL: [Self; ESTIMATED] = {
        let mut all = [SteeringOffset; ESTIMATED];
        let mut i = 0;
        while i < ESTIMATED {
            all[i] = TABLE[i].error;
            i += 1;
        }
        all
    };

    /// Errors of the car, which are always estimated: the data hardly see them, so that their standard deviations widen intervals.
    pub const CAR: [Self; 5] = [ForceGain, Mass, CentreOfGravity, Inertia, Height];

    /// Delays of channels; one of all of them at once would not be seen.
    pub const DELAYS: [Self; 5] = [SteeringDelay, SideslipDelay, YawRateDelay, AccelerationDelay, ForceDelay];

    /// Low-passes, whose group delays are never negative.
    pub const LOW_PASSES: [Self; 3] = [SideslipLowPass, YawRateLowPass, AccelerationLowPass];

    /// Drifts of clocks.
    pub const CLOCKS: [Self; 3] = [SideslipClock, InertialClock, InputClock];

    /// What tires do that curves do not tell.
    pub const TIRES: [Self; 2] = [RelaxationFront, RelaxationRear];

    /// Its row of the table.
    pub fn describe(self) -> &'static ErrorDescription {
        &TABLE[self as usize]
    }

    /// The key of the channel's column that takes an error of this size out, with the error `gain` of the scale of that channel. `None`
    /// where no column can.
    pub fn correction_key(self, value: f64, gain: f64) -> Option<ColumnKey> {
        match self.describe().kind {
            Delay => Some(ColumnKey::Delay(value)),
            Gain if self == ForceGain => Some(ColumnKey::Gain(1.0 + value)),
            Gain => Some(ColumnKey::Gain(1.0 / (1.0 + value))),
            Offset => Some(ColumnKey::Offset(-value / (1.0 + gain))),
            Lever
            | MountingAngle
            | RelaxationLength
            | CarParameter
            | RoadOrTire
            | ClockDrift
            | LowPass
            | ErrorKind::Roll => None,
        }
    }
}

/// A key of a column in a scenario: the column has gain · record + offset, read one delay later.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColumnKey {
    /// [-]
    Gain(f64),
    /// In the unit of the channel.
    Offset(f64),
    /// [s]
    Delay(f64),
}

/// As a line of TOML.
impl fmt::Display for ColumnKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (key, value) = match *self {
            Self::Gain(value) => ("gain", value),
            Self::Offset(value) => ("offset", value),
            Self::Delay(value) => ("delay", value),
        };
        write!(f, "{key} = {}", format_significant(value, 4))
    }
}

/// By its name.
impl JsonSchema for SystematicError {
    fn schema_name() -> Cow<'static, str> {
        "Cause".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        let choice = |error: Self| {
            let ErrorDescription { name, title, unit, std, .. } = error.describe();
            let words = format!("The {title} [{unit}]; usual standard deviation {std}.");
            json_schema!({ "const": name, "description": words })
        };
        json_schema!({ "type": "string", "oneOf": Self::ALL.map(choice).to_vec() })
    }
}

impl<'de> Deserialize<'de> for SystematicError {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        let found = Self::ALL.into_iter().find(|error| error.describe().name == name);
        found.ok_or_else(|| {
            let known = Self::ALL.map(|error| format!("`{}`", error.describe().name)).join(", ");
            D::Error::custom(format!("unknown error `{name}`, expected one of {known}"))
        })
    }
}

/// Relaxation length where a fit starts [m].
pub const START_RELAXATION_LENGTH: f64 = 0.2;

/// A value for each error that a fit can estimate, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystematicErrors<T = f64>(pub [T; ESTIMATED]);

impl Default for SystematicErrors {
    /// No error.
    fn default() -> Self {
        Self([0.0; ESTIMATED])
    }
}

impl<T> std::ops::Index<SystematicError> for SystematicErrors<T> {
    type Output = T;

    #[inline(always)]
    fn index(&self, error: SystematicError) -> &T {
        &self.0[error as usize]
    }
}

impl<T> std::ops::IndexMut<SystematicError> for SystematicErrors<T> {
    #[inline(always)]
    fn index_mut(&mut self, error: SystematicError) -> &mut T {
        &mut self.0[error as usize]
    }
}

impl SystematicErrors {
    /// Moves relaxation lengths to where their fit starts.
    pub fn set_initial_relaxation(&mut self) {
        SystematicError::TIRES.iter().for_each(|error| self[*error] = START_RELAXATION_LENGTH);
    }

    /// The true car behind that of a configuration.
    pub fn corrected_car(&self, car: &SingleTrackCar) -> SingleTrackCar {
        let vehicle::VehicleBody { m, I_zz, l_f, l_r, h } = car.body;
        let ahead = self[CentreOfGravity];
        let body = vehicle::VehicleBody {
            m: m * (1.0 + self[Mass]),
            I_zz: I_zz * (1.0 + self[Inertia]),
            l_f: l_f - ahead,
            l_r: l_r + ahead,
            h: h + self[Height],
        };
        SingleTrackCar { body, ..*car }
    }

    /// A drive with its true inputs.
    pub fn corrected_inputs(&self, drive: &Drive) -> Drive {
        let (start, end) = (drive.t[0], drive.t[drive.len() - 1]);
        let moved = |column: &[f64], delay: f64| {
            let late = drive.t.iter().map(|t| (t + delay).clamp(start, end));
            Interpolation::Linear.resample(&drive.t, column, &late.collect::<Vec<_>>())
        };
        let read = moved(&drive.delta, self[SteeringDelay]);
        let pushed = moved(&drive.F_x, self[ForceDelay]);
        let offset = self[SteeringOffset];
        let scale = 1.0 + self[SteeringGain];
        let force = 1.0 + self[ForceGain];
        Drive {
            delta: read.iter().map(|delta| (delta - offset) / scale).collect(),
            F_x: pushed.iter().map(|F_x| force * F_x).collect(),
            ..drive.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_the_order_of_the_values_and_names_differ() {
        for (index, row) in TABLE.iter().enumerate() {
            assert_eq!(row.error as usize, index);
            assert!(row.std > 0.0);
        }
        let mut names: Vec<_> = TABLE.iter().map(|row| row.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), TABLE.len());
    }

    #[test]
    fn a_key_takes_the_error_out() {
        let line = |error: SystematicError, value| {
            error.correction_key(value, 0.0).map(|key| key.to_string()).unwrap_or_default()
        };
        assert_eq!(line(YawRateDelay, 0.012), "delay = 0.01200");
        assert_eq!(line(SteeringGain, 0.25), "gain = 0.8000");
        assert_eq!(line(ForceGain, 0.25), "gain = 1.250");
        assert_eq!(line(AccelerationOffset, 0.1), "offset = -0.1000");
        assert_eq!(line(SideslipLever, 0.1), "");
    }
}
