//! Reads the car: its data have no default, as a wrong mass or length makes wrong tires; all that are missing are told at once.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use drive_inference::CarUncertainty;
use numerics::text::significant;
use plugin::ConfigError;
use preparation::{BrakeShare, Car};
use schemars::JsonSchema;
use serde::Deserialize;
use vehicle::{Aero, Body, Differential, Vehicle, Wheel};

use super::rules::{self, demand};
use super::uncertain_value::{Air, UncertainValue};

/// Mass, inertia and lengths of the car, all needed. No key is required by the schema: what is missing is told at once, with its use.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Masses {
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
pub struct DrivenCar {
    /// Mass, inertia and lengths: plain numbers with the usual standard deviations, or tables of `value` and `std`, a standard
    /// deviation in the same unit.
    body: Option<Masses>,
    /// Drag and downforce, or `"none"`: air density `rho` in kg/m³, frontal `area` in m², drag coefficient `C_d`, downforce
    /// coefficients `C_lf` and `C_lr` of front and rear axle.
    aero: Option<Air>,
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
    body: Option<Masses>,
    /// Drag and downforce, or `"none"`: air density `rho` in kg/m³, frontal `area` in m², drag coefficient `C_d`, downforce
    /// coefficients `C_lf` and `C_lr` of front and rear axle.
    aero: Option<Air>,
    /// Rolling resistance coefficient [-].
    #[serde(default)]
    c_roll: f64,
    /// Share of the driving force at the front axle [-]; 0 for rear-wheel drive.
    drive_front_share: Option<f64>,
    /// Share of the braking force at the front axle [-], from 0 to 1, or `"by_load"`.
    brake_front_share: Option<BrakeShare>,
    /// Wheels of the front axle; needed with the signals `omega_fl` and `omega_fr`.
    wheel_f: Option<Wheel>,
    /// Wheels of the rear axle; needed with the signals `omega_rl` and `omega_rr`.
    wheel_r: Option<Wheel>,
    /// Limited-slip differential of the rear axle; without it both wheels drive alike.
    differential: Option<Differential>,
    /// Plain numbers are known exactly, as those of a simulated car.
    #[serde(default)]
    exact: bool,
}

/// The car of a prediction. `body` and `drive_front_share` are needed.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteeredCar {
    /// Mass, inertia and lengths: plain numbers, or tables of `value` and `std`.
    body: Option<Masses>,
    /// Share of the driving force at the front axle [-]; 0 for rear-wheel drive.
    drive_front_share: Option<f64>,
    /// Share of the braking force at the front axle [-]; usually 0.5.
    brake_front_share: Option<f64>,
}

/// A missing datum: its key, and its use.
type Missing = (&'static str, &'static str);

const AERO: Missing =
    ("aero", "drag and downforce, for axle loads and longitudinal forces; \"none\" for neither");
const BRAKES: Missing = ("brake_front_share", "share of the braking force at the front axle");
const BRAKES_OR_RULE: Missing =
    ("brake_front_share", "share of the braking force at the front axle; \"by_load\" when unknown");
const DRIVE: Missing =
    ("drive_front_share", "share of the driving force at the front axle; 0 for rear-wheel drive");

impl Masses {
    const USES: [Missing; 5] = [
        ("body.m", "mass [kg], for axle loads, and forces from accelerations"),
        (
            "body.I_zz",
            "yaw moment of inertia [kg·m²], for the forces of each axle from the yaw acceleration",
        ),
        ("body.l_f", "centre of gravity to front axle [m], for slip angles and axle loads"),
        ("body.l_r", "centre of gravity to rear axle [m], for slip angles and axle loads"),
        ("body.h", "height of the centre of gravity [m], for the load transfer between the axles"),
    ];

    fn missing(&self) -> Vec<Missing> {
        let Self { m, I_zz, l_f, l_r, h } = self;
        let there = [m.is_some(), I_zz.is_some(), l_f.is_some(), l_r.is_some(), h.is_some()];
        Self::USES.into_iter().zip(there).filter(|(_, there)| !there).map(|(it, _)| it).collect()
    }

    /// The numbers, and their standard deviations; `exact` without any unless stated.
    fn read(&self, exact: bool) -> Result<Option<(Body, CarUncertainty)>, ConfigError> {
        let Self { m: Some(m), I_zz: Some(I_zz), l_f: Some(l_f), l_r: Some(l_r), h: Some(h) } =
            *self
        else {
            return Ok(None);
        };
        for (name, value) in
            [("m", m.value), ("I_zz", I_zz.value), ("l_f", l_f.value), ("l_r", l_r)]
        {
            rules::positive(name, value)?;
        }
        rules::not_negative("h", h.value)?;
        plausible(&Body { m: m.value, I_zz: I_zz.value, l_f: l_f.value, l_r, h: h.value })?;
        let usual = if exact { CarUncertainty::NONE } else { CarUncertainty::default() };
        let std = |name: &str, known: UncertainValue, usual: f64, most: f64| {
            let std = known.std.unwrap_or(usual);
            let expected = format!("a standard deviation from 0 to {}", significant(most, 4));
            demand((0.0..=most).contains(&std), &format!("{name}.std"), &expected, std)
                .map(|()| std)
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
        let body = Body { m: m.value, I_zz: I_zz.value, l_f: l_f.value, l_r, h: h.value };
        Ok(Some((body, uncertainty)))
    }
}

/// The data that are asked for; those that are missing are told at once.
#[derive(Default)]
struct RequiredData {
    missing: Vec<Missing>,
}

impl RequiredData {
    fn take<T>(&mut self, given: Option<T>, datum: Missing) -> Option<T> {
        self.missing.extend(given.is_none().then_some(datum));
        given
    }

    fn body(
        &mut self,
        given: Option<Masses>,
        exact: bool,
    ) -> Result<Option<(Body, CarUncertainty)>, ConfigError> {
        let masses = given.unwrap_or_default();
        self.missing.extend(masses.missing());
        masses.read(exact).map_err(|error| error.within("body"))
    }

    /// Names what is missing, the use of each, and how to say "unknown".
    fn needed(&self) -> ConfigError {
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
fn plausible(body: &Body) -> Result<(), ConfigError> {
    let Body { m, I_zz, l_f, l_r, h } = *body;
    let length = l_f + l_r;
    let longer = if l_f > l_r { "l_f" } else { "l_r" };
    let expected = "metres: l_f + l_r from 0.05 to 20";
    demand((0.05..=20.0).contains(&length), longer, expected, length)?;
    demand(h <= length, "h", "metres: at most l_f + l_r", h)?;
    // Mass at both axles has m l_f l_r.
    let share = I_zz / (m * l_f * l_r);
    let [low, high] = [0.05, 20.0].map(|share| significant(share * m * l_f * l_r, 2));
    let expected = format!("kg·m²: from {low} to {high} for this mass and these lengths");
    demand((0.05..=20.0).contains(&share), "I_zz", &expected, I_zz)
}

fn share(key: &str, found: f64) -> Result<(), ConfigError> {
    demand((0.0..=1.0).contains(&found), key, "a share from 0 to 1", found)
}

fn air(air: Air) -> Result<Aero, ConfigError> {
    let aero = Aero::from(air);
    let Aero { rho, area, C_d, C_lf, C_lr } = aero;
    for (name, value) in [("rho", rho), ("area", area)] {
        rules::positive(&format!("aero.{name}"), value)?;
    }
    rules::not_negative("aero.C_d", C_d)?;
    for (name, value) in [("C_lf", C_lf), ("C_lr", C_lr)] {
        demand(value.is_finite(), &format!("aero.{name}"), "a finite number", value)?;
    }
    Ok(aero)
}

fn wheel(key: &str, wheel: Option<Wheel>) -> Result<Wheel, ConfigError> {
    let Some(Wheel { radius, stiffness, growth }) = wheel else { return Ok(Wheel::default()) };
    let key = |name: &str| format!("{key}.{name}");
    rules::positive(&key("radius"), radius)?;
    stiffness.map_or(Ok(()), |stiffness| rules::positive(&key("stiffness"), stiffness))?;
    rules::not_negative(&key("growth"), growth)?;
    Ok(Wheel { radius, stiffness, growth })
}

fn differential(found: &Differential) -> Result<(), ConfigError> {
    let Differential { drive_lock, coast_lock, preload, engine_brake, sensitivity, track } = *found;
    share("differential.drive_lock", drive_lock)?;
    share("differential.coast_lock", coast_lock)?;
    for (name, value) in
        [("preload", preload), ("engine_brake", engine_brake), ("sensitivity", sensitivity)]
    {
        rules::not_negative(&format!("differential.{name}"), value)?;
    }
    rules::positive("differential.track", track)
}

impl DrivenCar {
    /// The car, without its tires, and how well it is known.
    ///
    /// # Errors
    /// With all data that are missing, or the first that makes no sense.
    pub fn read(&self) -> Result<(Vehicle, CarUncertainty), ConfigError> {
        self.complete().map_err(|error| error.within("car"))
    }

    fn complete(&self) -> Result<(Vehicle, CarUncertainty), ConfigError> {
        let mut asked = RequiredData::default();
        let body = asked.body(self.body, self.exact)?;
        let aero = asked.take(self.aero, AERO);
        let brakes = asked.take(self.brake_front_share, BRAKES);
        let (Some((body, usual)), Some(aero), Some(brake_front_share)) = (body, aero, brakes)
        else {
            return Err(asked.needed());
        };
        share("brake_front_share", brake_front_share)?;
        let F_x_gain = self.F_x_gain_std.unwrap_or(usual.F_x_gain);
        let expected = "a standard deviation from 0 to 0.5";
        demand((0.0..=0.5).contains(&F_x_gain), "F_x_gain_std", expected, F_x_gain)?;
        let car = Vehicle { body, aero: air(aero)?, brake_front_share, ..Vehicle::default() };
        Ok((car, CarUncertainty { F_x_gain, ..usual }))
    }
}

impl SteeredCar {
    /// Mass, inertia and lengths, and the shares of driving and braking force at the front axle.
    ///
    /// # Errors
    /// With all that are missing, or the first that makes no sense.
    pub fn read(&self) -> Result<(Body, [f64; 2]), ConfigError> {
        let mut asked = RequiredData::default();
        let body = asked.body(self.body, false)?;
        let drive = asked.take(self.drive_front_share, DRIVE);
        let (Some((body, _)), Some(drive)) = (body, drive) else { return Err(asked.needed()) };
        let brake = self.brake_front_share.unwrap_or(0.5);
        share("drive_front_share", drive)?;
        share("brake_front_share", brake)?;
        Ok((body, [drive, brake]))
    }
}

impl LoggedCar {
    /// The car, and how well it is known.
    ///
    /// # Errors
    /// With all data that are missing, or the first that makes no sense.
    pub fn read(&self) -> Result<(Car, CarUncertainty), ConfigError> {
        self.complete().map_err(|error| error.within("car"))
    }

    fn complete(&self) -> Result<(Car, CarUncertainty), ConfigError> {
        let mut asked = RequiredData::default();
        let body = asked.body(self.body, self.exact)?;
        let aero = asked.take(self.aero, AERO);
        let drive = asked.take(self.drive_front_share, DRIVE);
        let brakes = asked.take(self.brake_front_share, BRAKES_OR_RULE);
        let (Some((body, usual)), Some(aero), Some(drive_front_share), Some(brake_front_share)) =
            (body, aero, drive, brakes)
        else {
            return Err(asked.needed());
        };
        share("drive_front_share", drive_front_share)?;
        if let BrakeShare::Fixed(found) = brake_front_share {
            share("brake_front_share", found)?;
        }
        rules::not_negative("c_roll", self.c_roll)?;
        self.differential.as_ref().map_or(Ok(()), differential)?;
        let car = Car {
            body,
            aero: air(aero)?,
            c_roll: self.c_roll,
            drive_front_share,
            brake_front_share,
            wheel_f: wheel("wheel_f", self.wheel_f)?,
            wheel_r: wheel("wheel_r", self.wheel_r)?,
            differential: self.differential,
        };
        Ok((car, usual))
    }

    /// Refuses wheel speeds of an axle whose wheels nobody described.
    ///
    /// # Errors
    /// With what is missing.
    pub fn demand_wheels(&self, has: impl Fn(&str) -> bool) -> Result<(), ConfigError> {
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
                return Err(ConfigError::at("car", message));
            }
        }
        Ok(())
    }
}
