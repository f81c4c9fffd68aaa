//! Makes a car of named parameters: those that plants and drivers have, with their units.
#![allow(non_snake_case, reason = "forces and lengths are written as in the equations")]

use tire::{MfTire, Tire, TireOperatingPoint};
use tire_file::{TireFileMessage, TireSpecification};
use vehicle::{Aerodynamics, G, MagicFormula, VehicleBody};

use crate::car::{ActuatorLimits, LapCar};
use crate::tires::LapTire;

/// Braking force that no road car's tires transmit, over its weight [-]: the limit where none is told.
const UNLIMITED_FORCE: f64 = 5.0;
/// Rate of the longitudinal force where none is told, over the weight [1/s]: full braking builds up within 0.2 s.
const FORCE_RATE: f64 = 5.0;

/// Parameters of a car, by the names that plants and drivers have for them.
#[derive(Clone, Debug, PartialEq)]
pub struct CarParameters {
    body: VehicleBody,
    aero: Aerodynamics,
    track_widths: [f64; 2],
    roll_stiffness: [f64; 2],
    spring_rate: [f64; 2],
    motion_ratio: [f64; 2],
    bar_stiffness: [f64; 2],
    brake_front_share: f64,
    drive_front_share: f64,
    drive_torque: f64,
    drive_power: f64,
    brake_torque: f64,
    F_x_min: f64,
    F_x_max: f64,
    F_x_rate: f64,
    delta: f64,
    delta_rate: f64,
    simple_tires: [MagicFormula; 2],
    tires: [TireSpecification; 2],
}

impl Default for CarParameters {
    fn default() -> Self {
        let unknown = f64::NAN;
        let body = VehicleBody { m: unknown, I_zz: unknown, l_f: unknown, l_r: unknown, h: unknown };
        CarParameters {
            body,
            aero: Aerodynamics { area: 0.0, C_d: 0.0, ..Aerodynamics::default() },
            track_widths: [0.0; 2],
            roll_stiffness: [0.0; 2],
            spring_rate: [0.0; 2],
            motion_ratio: [1.0; 2],
            bar_stiffness: [0.0; 2],
            brake_front_share: 0.6,
            drive_front_share: 0.0,
            drive_torque: f64::INFINITY,
            drive_power: unknown,
            brake_torque: f64::INFINITY,
            F_x_min: f64::NEG_INFINITY,
            F_x_max: f64::INFINITY,
            F_x_rate: f64::INFINITY,
            delta: 0.5,
            delta_rate: 1.0,
            simple_tires: [MagicFormula::default(); 2],
            tires: <[TireSpecification; 2]>::default(),
        }
    }
}

/// A parameter by its name.
pub struct ParameterKey {
    /// Name, such as `body.m`.
    pub name: &'static str,
    /// Unit; `1` for a share or factor.
    pub unit: &'static str,
    /// Least and largest sensible value.
    range: [f64; 2],
    field: fn(&mut CarParameters) -> &mut f64,
}

/// A range of a parameter, in SI units.
#[derive(Clone, Copy)]
pub struct ParameterRange {
    /// The parameter.
    pub key: &'static ParameterKey,
    /// Its least value.
    pub low: f64,
    /// Its largest value.
    pub high: f64,
}

const fn key(
    name: &'static str,
    unit: &'static str,
    range: [f64; 2],
    field: fn(&mut CarParameters) -> &mut f64,
) -> ParameterKey {
    ParameterKey { name, unit, range, field }
}

const POSITIVE: [f64; 2] = [f64::MIN_POSITIVE, f64::MAX];
const FROM_ZERO: [f64; 2] = [0.0, f64::MAX];
const SHARE: [f64; 2] = [0.0, 1.0];
const ANY: [f64; 2] = [f64::MIN, f64::MAX];

/// All numbers that a car of a lap has.
pub const PARAMETER_KEYS: [ParameterKey; 50] = [
    key("body.m", "kg", POSITIVE, |p| &mut p.body.m),
    key("body.I_zz", "kg.m2", POSITIVE, |p| &mut p.body.I_zz),
    key("body.l_f", "m", POSITIVE, |p| &mut p.body.l_f),
    key("body.l_r", "m", POSITIVE, |p| &mut p.body.l_r),
    key("body.h", "m", FROM_ZERO, |p| &mut p.body.h),
    key("body.track_f", "m", FROM_ZERO, |p| &mut p.track_widths[0]),
    key("body.track_r", "m", FROM_ZERO, |p| &mut p.track_widths[1]),
    key("roll.stiffness_f", "N.m/rad", FROM_ZERO, |p| &mut p.roll_stiffness[0]),
    key("roll.stiffness_r", "N.m/rad", FROM_ZERO, |p| &mut p.roll_stiffness[1]),
    key("spring.rate_f", "N/m", FROM_ZERO, |p| &mut p.spring_rate[0]),
    key("spring.rate_r", "N/m", FROM_ZERO, |p| &mut p.spring_rate[1]),
    key("spring.motion_ratio_f", "1", POSITIVE, |p| &mut p.motion_ratio[0]),
    key("spring.motion_ratio_r", "1", POSITIVE, |p| &mut p.motion_ratio[1]),
    key("bar.roll_stiffness_f", "N.m/rad", FROM_ZERO, |p| &mut p.bar_stiffness[0]),
    key("bar.roll_stiffness_r", "N.m/rad", FROM_ZERO, |p| &mut p.bar_stiffness[1]),
    key("aero.rho", "kg/m3", FROM_ZERO, |p| &mut p.aero.rho),
    key("aero.area", "m2", FROM_ZERO, |p| &mut p.aero.area),
    key("aero.C_d", "1", FROM_ZERO, |p| &mut p.aero.C_d),
    key("aero.C_lf", "1", ANY, |p| &mut p.aero.C_lf),
    key("aero.C_lr", "1", ANY, |p| &mut p.aero.C_lr),
    key("brake.front_share", "1", SHARE, |p| &mut p.brake_front_share),
    key("brake.torque_max", "N.m", POSITIVE, |p| &mut p.brake_torque),
    key("drive.front_share", "1", SHARE, |p| &mut p.drive_front_share),
    key("drive.torque_max", "N.m", POSITIVE, |p| &mut p.drive_torque),
    key("drive.power_max", "W", POSITIVE, |p| &mut p.drive_power),
    key("limit.F_x_min", "N", [f64::MIN, -f64::MIN_POSITIVE], |p| &mut p.F_x_min),
    key("limit.F_x_max", "N", POSITIVE, |p| &mut p.F_x_max),
    key("limit.F_x_rate", "N/s", POSITIVE, |p| &mut p.F_x_rate),
    key("limit.delta", "rad", POSITIVE, |p| &mut p.delta),
    key("limit.delta_rate", "rad/s", POSITIVE, |p| &mut p.delta_rate),
    key("tire_f.B", "1/rad", POSITIVE, |p| &mut p.simple_tires[0].B),
    key("tire_f.C", "1", POSITIVE, |p| &mut p.simple_tires[0].C),
    key("tire_f.D", "1", POSITIVE, |p| &mut p.simple_tires[0].D),
    key("tire_f.E", "1", ANY, |p| &mut p.simple_tires[0].E),
    key("tire_f.S_h", "rad", ANY, |p| &mut p.simple_tires[0].S_h),
    key("tire_f.S_v", "1", ANY, |p| &mut p.simple_tires[0].S_v),
    key("tire_r.B", "1/rad", POSITIVE, |p| &mut p.simple_tires[1].B),
    key("tire_r.C", "1", POSITIVE, |p| &mut p.simple_tires[1].C),
    key("tire_r.D", "1", POSITIVE, |p| &mut p.simple_tires[1].D),
    key("tire_r.E", "1", ANY, |p| &mut p.simple_tires[1].E),
    key("tire_r.S_h", "rad", ANY, |p| &mut p.simple_tires[1].S_h),
    key("tire_r.S_v", "1", ANY, |p| &mut p.simple_tires[1].S_v),
    key("tire_f.LMUX", "1", POSITIVE, |p| &mut p.tires[0].LMUX),
    key("tire_f.LMUY", "1", POSITIVE, |p| &mut p.tires[0].LMUY),
    key("tire_f.LKX", "1", POSITIVE, |p| &mut p.tires[0].LKX),
    key("tire_f.LKY", "1", POSITIVE, |p| &mut p.tires[0].LKY),
    key("tire_r.LMUX", "1", POSITIVE, |p| &mut p.tires[1].LMUX),
    key("tire_r.LMUY", "1", POSITIVE, |p| &mut p.tires[1].LMUY),
    key("tire_r.LKX", "1", POSITIVE, |p| &mut p.tires[1].LKX),
    key("tire_r.LKY", "1", POSITIVE, |p| &mut p.tires[1].LKY),
];

/// Names of the texts that a car of a lap has: tires of the front and the rear axle.
pub const TEXT_KEYS: [&str; 2] = ["tire_f.tir", "tire_r.tir"];

impl ParameterKey {
    /// The key of a name.
    pub fn find(name: &str) -> Option<&'static ParameterKey> {
        PARAMETER_KEYS.iter().find(|key| key.name == name)
    }

    /// The key of a name that may have the name of a node before it.
    pub fn find_of_node(name: &str) -> Option<&'static ParameterKey> {
        let behind_node = name.split_once('.').and_then(|(_, rest)| Self::find(rest));
        Self::find(name).or(behind_node)
    }

    /// The value in these parameters; NaN where it has to be told and was not, infinite where there is no limit.
    pub fn value(&self, parameters: &CarParameters) -> f64 {
        *(self.field)(&mut parameters.clone())
    }

    /// Whether a car on its tires has this parameter at all.
    pub fn is_used(&self, parameters: &CarParameters) -> bool {
        let coefficient = self.name.strip_prefix("tire_f.").or(self.name.strip_prefix("tire_r."));
        let simple = matches!(coefficient, Some("B" | "C" | "D" | "E" | "S_h" | "S_v"));
        let of_file = self.name.starts_with("tire_") && !simple;
        let has_springs = parameters.spring_rate.iter().all(|rate| *rate > 0.0);
        let of_springs = self.name.starts_with("spring.") || self.name.starts_with("bar.");
        match parameters.has_tire_files() {
            true if simple => false,
            false if of_file => false,
            _ if of_springs => has_springs,
            _ if self.name.starts_with("roll.") => !has_springs,
            _ => true,
        }
    }

    /// Refuses a parameter without effect: draws of it alone would give an interval of no width, as if all were known.
    ///
    /// # Errors
    /// In words, when the car has no such parameter, or another one goes before it.
    pub fn check_changes_car(&self, car: &CarParameters) -> Result<(), String> {
        if self.is_used(car) {
            return Ok(());
        }
        let name = self.name;
        let factor = matches!(name.rsplit('.').next(), Some("LMUX" | "LMUY" | "LKX" | "LKY"));
        let why = match name.split_once('.') {
            Some(("tire_f" | "tire_r", _)) if factor => "no .tir file is told for its tires",
            Some(("tire_f" | "tire_r", _)) => {
                "its tires are those of a .tir file; lap a car without tire_f.tir and tire_r.tir"
            }
            Some(("roll", _)) => "its springs and bars say how stiff it is in roll",
            _ => "it has not spring.rate_f and spring.rate_r",
        };
        Err(format!("`{name}` changes nothing in this car: {why}"))
    }
}

impl CarParameters {
    /// A car of these numbers, by their names, in SI units.
    ///
    /// # Errors
    /// In words, when there is no such parameter, or when a number is out of its range.
    pub fn from_numbers(numbers: &[(&str, f64)]) -> Result<Self, String> {
        let mut parameters = CarParameters::default();
        for (name, value) in numbers {
            let key = ParameterKey::find(name).ok_or_else(|| format!("a lap has no parameter `{name}`"))?;
            parameters.set_number(key, *value).map_err(|message| format!("`{name}`: {message}"))?;
        }
        Ok(parameters)
    }

    /// Sets a number in SI units.
    ///
    /// # Errors
    /// In words, when it is out of its range.
    pub fn set_number(&mut self, key: &ParameterKey, value: f64) -> Result<(), String> {
        let [least, largest] = key.range;
        if !(least..=largest).contains(&value) {
            let range = match key.range {
                SHARE => "from 0 to 1",
                FROM_ZERO => "of at least 0",
                POSITIVE => "above 0",
                _ if largest < 0.0 => "below 0",
                _ => "that is finite",
            };
            return Err(format!("expected a number {range}, found {value}"));
        }
        *(key.field)(self) = value;
        Ok(())
    }

    /// Sets the text of a `.tir` file for an axle: 0 front, 1 rear.
    pub fn set_tire_text(&mut self, axle: usize, text: &str) {
        text.clone_into(&mut self.tires[axle].tir);
    }

    fn has_tire_files(&self) -> bool {
        self.tires.iter().any(|tire| !tire.tir.trim().is_empty())
    }

    /// Names of parameters that have to be told and were not.
    pub fn missing_names(&self) -> Vec<&'static str> {
        PARAMETER_KEYS.iter().filter(|key| key.value(self).is_nan()).map(|key| key.name).collect()
    }

    /// The parameters whose worth in seconds can be asked: those that the car has, and that are not 0 or without a limit.
    pub fn varied_keys(&self) -> Vec<&'static ParameterKey> {
        let is_number = |key: &&ParameterKey| {
            let value = key.value(self);
            value.is_finite() && value != 0.0 && key.is_used(self)
        };
        PARAMETER_KEYS.iter().filter(is_number).collect()
    }

    /// The car, and what the files of its tires are warned of.
    ///
    /// # Errors
    /// In words, when a number is missing or the file of a tire is none.
    pub fn car(&self) -> Result<(LapCar, Vec<TireFileMessage>), String> {
        let missing = self.missing_names();
        if !missing.is_empty() {
            return Err(format!("the car has no {}", missing.join(", ")));
        }
        let mut messages = Vec::new();
        let mut radii = [None; 2];
        let mut tires = self.simple_tires.map(LapTire::from);
        if self.has_tire_files() {
            let loads = self.body.static_loads();
            for (axle, name) in TEXT_KEYS.into_iter().enumerate() {
                let (tire, told) = self.tires[axle].load_tire(name)?;
                messages.extend(told);
                radii[axle] = effective_radius(&tire, 0.5 * loads[axle]);
                tires[axle] = LapTire::from(tire);
            }
        }
        let car = LapCar {
            body: self.body,
            aero: self.aero,
            track_widths: self.track_widths,
            roll_stiffness: self.axle_roll_stiffness(),
            brake_front_share: self.brake_front_share,
            drive_front_share: self.drive_front_share,
            tires,
            limits: self.limits(radii),
        };
        Ok((car, messages))
    }

    /// Roll stiffness of both axles: rate i² t² / 2 of the springs and that of the bar, or as it was told.
    fn axle_roll_stiffness(&self) -> [f64; 2] {
        if self.spring_rate.contains(&0.0) {
            return self.roll_stiffness;
        }
        [0, 1].map(|axle| {
            let wheel_rate = self.spring_rate[axle] * self.motion_ratio[axle].powi(2);
            0.5 * wheel_rate * self.track_widths[axle].powi(2) + self.bar_stiffness[axle]
        })
    }

    /// Limits of the actuators; torques become forces on wheels of these radii [m], and none where the tires know no radius.
    fn limits(&self, radii: [Option<f64>; 2]) -> ActuatorLimits {
        let weight = self.body.m * G;
        let driven = if self.drive_front_share > 0.5 { radii[0] } else { radii[1] };
        let force = |torque: f64, radius: Option<f64>| radius.map_or(f64::INFINITY, |radius| torque / radius);
        let unlimited = UNLIMITED_FORCE * weight;
        ActuatorLimits {
            delta: self.delta,
            delta_rate: self.delta_rate,
            F_x_rate: if self.F_x_rate.is_finite() { self.F_x_rate } else { FORCE_RATE * weight },
            drive_force: self.F_x_max.min(force(self.drive_torque, driven)).min(unlimited),
            brake_force: (-self.F_x_min).min(force(self.brake_torque, radii[0])).min(unlimited),
            power: self.drive_power,
        }
    }
}

/// The radius [m] of a wheel that rolls under a load [N]; none where the load crushes it.
fn effective_radius(tire: &MfTire, F_z: f64) -> Option<f64> {
    let radius =
        tire.effective_radius(&TireOperatingPoint { F_z, v_x: 20.0, ..TireOperatingPoint::default() });
    radius.filter(|radius| *radius > 0.0)
}
