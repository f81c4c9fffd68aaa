//! Reads the car: its data have no default, as a wrong mass or length makes wrong tires; all that are missing are told at once.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use drive_inference::CarUncertainty;
use numerics::text::format_significant;
use plugin::ConfigError;
use preparation::{BrakeShare, Car};
use schemars::JsonSchema;
use serde::Deserialize;
use vehicle::{Aerodynamics, LimitedSlipDifferential, SingleTrackCar, VehicleBody, WheelRadiusModel};

use super::rules::{self, check_rule};
use super::uncertain_value::{AeroChoice, UncertainValue};

/// Mass, inertia and lengths of the car, all needed. No key is required by the schema: what is missing is told at once, with its use.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MassProperties {
    /// Mass with driver and fuel [kg]; usual standard deviation 2 %.
    m: Option<UncertainValue>,
    /// Yaw moment of inertia about the centre of gravity [kg·m²]; usual standard deviation 10 %.
    I_zz: Option<UncertainValue>,
    /// Distance from the centre of gravity to the front axle [m]; usual standard deviation 0.01 m. It is that of the centre of
    /// gravity: the wheelbase is taken as known.
    l_f: Option<UncertainValue>,
    /// Distance from the centre of gravity to the rear axle [m].
    l_r: Option<f64>,
    /// Height of the centre of gravity above the road [m]; usual standard deviation 0.02 m.
    h: Option<UncertainValue>,
}

/// The car of a closed-loop drive: driven at the rear axle. `body`, `aero` and `brake_front_share` are needed.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClosedLoopCarConfig {
    /// Mass, inertia and lengths: plain numbers with the usual standard deviations, or tables of `value` and `std`, a standard
    /// deviation in the same unit.
    body: Option<MassProperties>,
    /// Drag and downforce, or `"none"`: air density `rho` in kg/m³, frontal `area` in m², drag coefficient `C_d`, downforce
    /// coefficients `C_lf` and `C_lr` of front and rear axle.
    aero: Option<AeroChoice>,
    /// Share of a braking force at the front axle [-], from 0 to 1.
    brake_front_share: Option<f64>,
    /// Standard deviation of the gain of the signal `F_x` [-]; usually 0.05.
    F_x_gain_std: Option<f64>,
    /// Plain numbers are known exactly, as those of a simulated car.
    #[serde(default)]
    exact: bool,
}

/// The car of a log. `body`, `aero`, `drive_front_share` and `brake_front_share` are needed.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoggedCar {
    /// Mass, inertia and lengths: plain numbers with the usual standard deviations, or tables of `value` and `std`, a standard
    /// deviation in the same unit.
    body: Option<MassProperties>,
    /// Drag and downforce, or `"none"`: air density `rho` in kg/m³, frontal `area` in m², drag coefficient `C_d`, downforce
    /// coefficients `C_lf` and `C_lr` of front and rear axle.
    aero: Option<AeroChoice>,
    /// Rolling resistance coefficient [-].
    #[serde(default)]
    c_roll: f64,
    /// Share of the driving force at the front axle [-]; 0 for rear-wheel drive.
    drive_front_share: Option<f64>,
    /// Share of the braking force at the front axle [-], from 0 to 1, or `"by_load"`.
    brake_front_share: Option<BrakeShare>,
    /// Wheels of the front axle; needed with the signals `omega_fl` and `omega_fr`.
    wheel_f: Option<WheelRadiusModel>,
    /// Wheels of the rear axle; needed with the signals `omega_rl` and `omega_rr`.
    wheel_r: Option<WheelRadiusModel>,
    /// Limited-slip differential of the rear axle; without it both wheels drive alike.
    differential: Option<LimitedSlipDifferential>,
    /// Plain numbers are known exactly, as those of a simulated car.
    #[serde(default)]
    exact: bool,
}

/// The car of a prediction. `body` and `drive_front_share` are needed.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PredictionCarConfig {
    /// Mass, inertia and lengths: plain numbers, or tables of `value` and `std`.
    body: Option<MassProperties>,
    /// Share of the driving force at the front axle [-]; 0 for rear-wheel drive.
    drive_front_share: Option<f64>,
    /// Share of the braking force at the front axle [-]; usually 0.5.
    brake_front_share: Option<f64>,
}

/// A missing datum: its key, and its use.
type MissingDatum = (&'static str, &'static str);

const AERO: MissingDatum =
    ("aero", "drag and downforce, for axle loads and longitudinal forces; \"none\" for neither");
const BRAKES: MissingDatum = ("brake_front_share", "share of the braking force at the front axle");
const BRAKES_OR_RULE: MissingDatum =
    ("brake_front_share", "share of the braking force at the front axle; \"by_load\" when unknown");
const DRIVE: MissingDatum =
    ("drive_front_share", "share of the driving force at the front axle; 0 for rear-wheel drive");

impl MassProperties {
    const USES: [MissingDatum; 5] = [
        ("body.m", "mass [kg], for axle loads, and forces from accelerations"),
        ("body.I_zz", "yaw moment of inertia [kg·m²], for the forces of each axle from the yaw acceleration"),
        ("body.l_f", "centre of gravity to front axle [m], for slip angles and axle loads"),
        ("body.l_r", "centre of gravity to rear axle [m], for slip angles and axle loads"),
        ("body.h", "height of the centre of gravity [m], for the load transfer between the axles"),
    ];

    fn missing_data(&self) -> Vec<MissingDatum> {
        let Self { m, I_zz, l_f, l_r, h } = self;
        let there = [m.is_some(), I_zz.is_some(), l_f.is_some(), l_r.is_some(), h.is_some()];
        Self::USES.into_iter().zip(there).filter(|(_, there)| !there).map(|(it, _)| it).collect()
    }

    /// The numbers, and their standard deviations; `exact` without any unless stated.
    fn body_with_uncertainty(
        &self,
        exact: bool,
    ) -> Result<Option<(VehicleBody, CarUncertainty)>, ConfigError> {
        let Self { m: Some(m), I_zz: Some(I_zz), l_f: Some(l_f), l_r: Some(l_r), h: Some(h) } = *self else {
            return Ok(None);
        };
        for (name, value) in [("m", m.value), ("I_zz", I_zz.value), ("l_f", l_f.value), ("l_r", l_r)] {
            rules::check_positive(name, value)?;
        }
        rules::not_negative("h", h.value)?;
        check_body_plausible(&VehicleBody { m: m.value, I_zz: I_zz.value, l_f: l_f.value, l_r, h: h.value })?;
        let usual = if exact { CarUncertainty::NONE } else { CarUncertainty::default() };
        let std = |name: &str, known: UncertainValue, usual: f64, most: f64| {
            let std = known.std.unwrap_or(usual);
            let expected = format!("a standard deviation from 0 to {}", format_significant(most, 4));
            check_rule((0.0..=most).contains(&std), &format!("{name}.std"), &expected, std).map(|()| std)
        };
        // Beyond half of the number, the bell curve of the standard deviation would reach below zero.
        let share = |name, known: UncertainValue, usual| {
            std(name, known, usual * known.value, 0.5 * known.value).map(|std| std / known.value)
        };
        let uncertainty = CarUncertainty {
            m: share("m", m, usual.m)?,
            cg: std("l_f", l_f, usual.cg, 0.5 * l_f.value.min(l_r))?,
            I_zz: share("I_zz", I_zz, usual.I_zz)?,
            h: std("h", h, usual.h, 0.5 * (l_f.value + l_r))?,
            ..usual
        };
        let body = VehicleBody { m: m.value, I_zz: I_zz.value, l_f: l_f.value, l_r, h: h.value };
        Ok(Some((body, uncertainty)))
    }
}

/// The data that are asked for; those that are missing are told at once.
#[derive(Default)]
struct RequiredData {
    missing: Vec<MissingDatum>,
}

impl RequiredData {
    fn take_or_note_missing<T>(&mut self, given: Option<T>, datum: MissingDatum) -> Option<T> {
        self.missing.extend(given.is_none().then_some(datum));
        given
    }

    fn take_body(
        &mut self,
        given: Option<MassProperties>,
        exact: bool,
    ) -> Result<Option<(VehicleBody, CarUncertainty)>, ConfigError> {
        let masses = given.unwrap_or_default();
        self.missing.extend(masses.missing_data());
        masses.body_with_uncertainty(exact).map_err(|error| error.with_parent_key("body"))
    }

    /// Names what is missing, the use of each, and how to say "unknown".
    fn missing_data_error(&self) -> ConfigError {
        let list: String =
            self.missing.iter().map(|(key, its_use)| format!("\n  `{key}`: {its_use}")).collect();
        ConfigError::new(format!(
            "expected the data of the car, which have no default; missing:{list}\n\
             For one that nobody measured, write an estimate with its standard deviation, such as\n  \
             I_zz = {{ value = 1605.0, std = 160.0 }}\n\
             It widens the intervals of the tires."
        ))
    }
}

/// Refuses what no car has: most of it is a unit that is not SI.
fn check_body_plausible(body: &VehicleBody) -> Result<(), ConfigError> {
    let VehicleBody { m, I_zz, l_f, l_r, h } = *body;
    let length = l_f + l_r;
    let longer = if l_f > l_r { "l_f" } else { "l_r" };
    let expected = "metres: l_f + l_r from 0.05 to 20";
    check_rule((0.05..=20.0).contains(&length), longer, expected, length)?;
    check_rule(h <= length, "h", "metres: at most l_f + l_r", h)?;
    // Mass at both axles has m l_f l_r.
    let share = I_zz / (m * l_f * l_r);
    let [low, high] = [0.05, 20.0].map(|share| format_significant(share * m * l_f * l_r, 2));
    let expected = format!("kg·m²: from {low} to {high} for this mass and these lengths");
    check_rule((0.05..=20.0).contains(&share), "I_zz", &expected, I_zz)
}

fn check_share(key: &str, found: f64) -> Result<(), ConfigError> {
    check_rule((0.0..=1.0).contains(&found), key, "a share from 0 to 1", found)
}

pub(super) fn checked_aero(air: AeroChoice) -> Result<Aerodynamics, ConfigError> {
    let aero = Aerodynamics::from(air);
    let Aerodynamics { rho, area, C_d, C_lf, C_lr } = aero;
    for (name, value) in [("rho", rho), ("area", area)] {
        rules::check_positive(&format!("aero.{name}"), value)?;
    }
    rules::not_negative("aero.C_d", C_d)?;
    for (name, value) in [("C_lf", C_lf), ("C_lr", C_lr)] {
        check_rule(value.is_finite(), &format!("aero.{name}"), "a finite number", value)?;
    }
    Ok(aero)
}

fn checked_wheel(key: &str, wheel: Option<WheelRadiusModel>) -> Result<WheelRadiusModel, ConfigError> {
    let Some(WheelRadiusModel { radius, stiffness, growth }) = wheel else {
        return Ok(WheelRadiusModel::default());
    };
    let key = |name: &str| format!("{key}.{name}");
    rules::check_positive(&key("radius"), radius)?;
    stiffness.map_or(Ok(()), |stiffness| rules::check_positive(&key("stiffness"), stiffness))?;
    rules::not_negative(&key("growth"), growth)?;
    Ok(WheelRadiusModel { radius, stiffness, growth })
}

fn check_differential(found: &LimitedSlipDifferential) -> Result<(), ConfigError> {
    let LimitedSlipDifferential { drive_lock, coast_lock, preload, engine_brake, sensitivity, track } =
        *found;
    check_share("differential.drive_lock", drive_lock)?;
    check_share("differential.coast_lock", coast_lock)?;
    for (name, value) in [("preload", preload), ("engine_brake", engine_brake), ("sensitivity", sensitivity)]
    {
        rules::not_negative(&format!("differential.{name}"), value)?;
    }
    rules::check_positive("differential.track", track)
}

impl ClosedLoopCarConfig {
    /// The car, without its tires, and how well it is known.
    ///
    /// # Errors
    /// With all data that are missing, or the first that makes no sense.
    pub fn to_vehicle(&self) -> Result<(SingleTrackCar, CarUncertainty), ConfigError> {
        self.vehicle_without_path().map_err(|error| error.with_parent_key("car"))
    }

    fn vehicle_without_path(&self) -> Result<(SingleTrackCar, CarUncertainty), ConfigError> {
        let mut asked = RequiredData::default();
        let body = asked.take_body(self.body, self.exact)?;
        let aero = asked.take_or_note_missing(self.aero, AERO);
        let brakes = asked.take_or_note_missing(self.brake_front_share, BRAKES);
        let (Some((body, usual)), Some(aero), Some(brake_front_share)) = (body, aero, brakes) else {
            return Err(asked.missing_data_error());
        };
        check_share("brake_front_share", brake_front_share)?;
        let F_x_gain = self.F_x_gain_std.unwrap_or(usual.F_x_gain);
        let expected = "a standard deviation from 0 to 0.5";
        check_rule((0.0..=0.5).contains(&F_x_gain), "F_x_gain_std", expected, F_x_gain)?;
        let car = SingleTrackCar {
            body,
            aero: checked_aero(aero)?,
            brake_front_share,
            ..SingleTrackCar::default()
        };
        Ok((car, CarUncertainty { F_x_gain, ..usual }))
    }
}

impl PredictionCarConfig {
    /// Mass, inertia and lengths, and the shares of driving and braking force at the front axle.
    ///
    /// # Errors
    /// With all that are missing, or the first that makes no sense.
    pub fn body_and_shares(&self) -> Result<(VehicleBody, [f64; 2]), ConfigError> {
        let mut asked = RequiredData::default();
        let body = asked.take_body(self.body, false)?;
        let drive = asked.take_or_note_missing(self.drive_front_share, DRIVE);
        let (Some((body, _)), Some(drive)) = (body, drive) else {
            return Err(asked.missing_data_error());
        };
        let brake = self.brake_front_share.unwrap_or(0.5);
        check_share("drive_front_share", drive)?;
        check_share("brake_front_share", brake)?;
        Ok((body, [drive, brake]))
    }
}

impl LoggedCar {
    /// The car, and how well it is known.
    ///
    /// # Errors
    /// With all data that are missing, or the first that makes no sense.
    pub fn to_car(&self) -> Result<(Car, CarUncertainty), ConfigError> {
        self.car_without_path().map_err(|error| error.with_parent_key("car"))
    }

    fn car_without_path(&self) -> Result<(Car, CarUncertainty), ConfigError> {
        let mut asked = RequiredData::default();
        let body = asked.take_body(self.body, self.exact)?;
        let aero = asked.take_or_note_missing(self.aero, AERO);
        let drive = asked.take_or_note_missing(self.drive_front_share, DRIVE);
        let brakes = asked.take_or_note_missing(self.brake_front_share, BRAKES_OR_RULE);
        let (Some((body, usual)), Some(aero), Some(drive_front_share), Some(brake_front_share)) =
            (body, aero, drive, brakes)
        else {
            return Err(asked.missing_data_error());
        };
        check_share("drive_front_share", drive_front_share)?;
        if let BrakeShare::Fixed(found) = brake_front_share {
            check_share("brake_front_share", found)?;
        }
        rules::not_negative("c_roll", self.c_roll)?;
        self.differential.as_ref().map_or(Ok(()), check_differential)?;
        let car = Car {
            body,
            aero: checked_aero(aero)?,
            c_roll: self.c_roll,
            drive_front_share,
            brake_front_share,
            wheel_f: checked_wheel("wheel_f", self.wheel_f)?,
            wheel_r: checked_wheel("wheel_r", self.wheel_r)?,
            differential: self.differential,
        };
        Ok((car, usual))
    }

    /// Refuses wheel speeds of an axle whose wheels nobody described.
    ///
    /// # Errors
    /// With what is missing.
    pub fn check_wheel_data(&self, has: impl Fn(&str) -> bool) -> Result<(), ConfigError> {
        let wheels = [
            (["omega_fl", "omega_fr"], "wheel_f", self.wheel_f),
            (["omega_rl", "omega_rr"], "wheel_r", self.wheel_r),
        ];
        for (signals, key, wheel) in wheels {
            let message = format!(
                "expected `{key}` = {{ radius = ... }} [m], for the slip ratios from `{}` and `{}`; or leave these signals out",
                signals[0], signals[1]
            );
            if wheel.is_none() && signals.iter().all(|name| has(name)) {
                return Err(ConfigError::at_key("car", message));
            }
        }
        Ok(())
    }
}
