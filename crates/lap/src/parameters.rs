//! Makes a car of named parameters: those that plants and drivers have, with their units.
#![allow(non_snake_case, reason = "forces and lengths are written as in the equations")]

use std::sync::Arc;

use tire::{MfTire, Tire, TireOperatingPoint};
use tire_file::{TireFileMessage, TireSpecification};
use vehicle::dual_track::{AxleSprings, AxleStiffness, Suspension, check_static_stability};
use vehicle::{Aerodynamics, DifferentialLock, G, MagicFormula, VehicleBody};

use crate::aero::{AeroPlatform, LapAero};
use crate::car::{ActuatorLimits, BrakeBalance, EnginePower, LapCar, LapDifferential};
use crate::spline::BSplineCurve;
use crate::tires::LapTire;

/// Braking force that no road car's tires transmit, over its weight [-]: the limit where none is told.
const UNLIMITED_FORCE: f64 = 5.0;
/// Rate of the longitudinal force where none is told, over the weight [1/s]: full braking builds up within 0.2 s.
const FORCE_RATE: f64 = 5.0;
/// Speeds over which the power of an engine is smoothed [m/s], and their intervals: one each 0.25 m/s.
const ENGINE_SPEEDS: [f64; 2] = [0.0, 150.0];
const ENGINE_INTERVALS: usize = 600;
/// Intervals of the smoothed force of the front brakes, and of the pedal that is looked for.
const BRAKE_INTERVALS: usize = 200;
const PEDAL_INTERVALS: usize = 1000;

/// Parameters of a car, by the names that plants and drivers have for them.
#[derive(Clone, Debug, PartialEq)]
pub struct CarParameters {
    body: VehicleBody,
    aero: Aerodynamics,
    track_widths: [f64; 2],
    roll_stiffness: [f64; 2],
    springs: [AxleSprings; 2],
    ride_stiffness: [f64; 2],
    ride_damping: [f64; 2],
    roll_damping: [f64; 2],
    roll_centre: [f64; 2],
    I_xx: f64,
    I_yy: f64,
    transients: bool,
    ride_height: [f64; 2],
    pitch_centre: f64,
    brake_front_share: f64,
    drive_front_share: f64,
    drive_torque: f64,
    drive_power: f64,
    drive_ratio: f64,
    differentials: [DifferentialLock; 2],
    brake_torque: f64,
    F_x_min: f64,
    F_x_max: f64,
    F_x_rate: f64,
    delta: f64,
    delta_rate: f64,
    simple_tires: [MagicFormula; 2],
    tires: [TireSpecification; 2],
    aero_map: String,
    brake_map: String,
    drive_map: String,
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
            springs: <[AxleSprings; 2]>::default(),
            ride_stiffness: [f64::INFINITY; 2],
            ride_damping: [unknown; 2],
            roll_damping: [unknown; 2],
            roll_centre: [0.0; 2],
            I_xx: unknown,
            I_yy: unknown,
            transients: false,
            ride_height: [unknown; 2],
            pitch_centre: 0.0,
            brake_front_share: 0.6,
            drive_front_share: 0.0,
            drive_torque: f64::INFINITY,
            drive_power: unknown,
            drive_ratio: 1.0,
            differentials: [DifferentialLock::default(); 2],
            brake_torque: f64::INFINITY,
            F_x_min: f64::NEG_INFINITY,
            F_x_max: f64::INFINITY,
            F_x_rate: f64::INFINITY,
            delta: 0.5,
            delta_rate: 1.0,
            simple_tires: [MagicFormula::default(); 2],
            tires: <[TireSpecification; 2]>::default(),
            aero_map: String::new(),
            brake_map: String::new(),
            drive_map: String::new(),
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
pub const PARAMETER_KEYS: [ParameterKey; 70] = [
    key("body.m", "kg", POSITIVE, |p| &mut p.body.m),
    key("body.I_zz", "kg.m2", POSITIVE, |p| &mut p.body.I_zz),
    key("body.I_xx", "kg.m2", POSITIVE, |p| &mut p.I_xx),
    key("body.I_yy", "kg.m2", POSITIVE, |p| &mut p.I_yy),
    key("body.l_f", "m", POSITIVE, |p| &mut p.body.l_f),
    key("body.l_r", "m", POSITIVE, |p| &mut p.body.l_r),
    key("body.h", "m", FROM_ZERO, |p| &mut p.body.h),
    key("body.track_f", "m", FROM_ZERO, |p| &mut p.track_widths[0]),
    key("body.track_r", "m", FROM_ZERO, |p| &mut p.track_widths[1]),
    key("roll.stiffness_f", "N.m/rad", FROM_ZERO, |p| &mut p.roll_stiffness[0]),
    key("roll.stiffness_r", "N.m/rad", FROM_ZERO, |p| &mut p.roll_stiffness[1]),
    key("roll.damping_f", "N.m.s/rad", FROM_ZERO, |p| &mut p.roll_damping[0]),
    key("roll.damping_r", "N.m.s/rad", FROM_ZERO, |p| &mut p.roll_damping[1]),
    key("roll.centre_f", "m", ANY, |p| &mut p.roll_centre[0]),
    key("roll.centre_r", "m", ANY, |p| &mut p.roll_centre[1]),
    key("spring.rate_f", "N/m", FROM_ZERO, |p| &mut p.springs[0].rate),
    key("spring.rate_r", "N/m", FROM_ZERO, |p| &mut p.springs[1].rate),
    key("spring.motion_ratio_f", "1", POSITIVE, |p| &mut p.springs[0].motion_ratio),
    key("spring.motion_ratio_r", "1", POSITIVE, |p| &mut p.springs[1].motion_ratio),
    key("bar.roll_stiffness_f", "N.m/rad", FROM_ZERO, |p| &mut p.springs[0].bar_stiffness),
    key("bar.roll_stiffness_r", "N.m/rad", FROM_ZERO, |p| &mut p.springs[1].bar_stiffness),
    key("ride.stiffness_f", "N/m", POSITIVE, |p| &mut p.ride_stiffness[0]),
    key("ride.stiffness_r", "N/m", POSITIVE, |p| &mut p.ride_stiffness[1]),
    key("ride.damping_f", "N.s/m", FROM_ZERO, |p| &mut p.ride_damping[0]),
    key("ride.damping_r", "N.s/m", FROM_ZERO, |p| &mut p.ride_damping[1]),
    key("pitch.centre", "m", ANY, |p| &mut p.pitch_centre),
    key("aero.rho", "kg/m3", FROM_ZERO, |p| &mut p.aero.rho),
    key("aero.area", "m2", FROM_ZERO, |p| &mut p.aero.area),
    key("aero.C_d", "1", FROM_ZERO, |p| &mut p.aero.C_d),
    key("aero.C_lf", "1", ANY, |p| &mut p.aero.C_lf),
    key("aero.C_lr", "1", ANY, |p| &mut p.aero.C_lr),
    key("aero.ride_height_f", "m", ANY, |p| &mut p.ride_height[0]),
    key("aero.ride_height_r", "m", ANY, |p| &mut p.ride_height[1]),
    key("brake.front_share", "1", SHARE, |p| &mut p.brake_front_share),
    key("brake.torque_max", "N.m", POSITIVE, |p| &mut p.brake_torque),
    key("drive.front_share", "1", SHARE, |p| &mut p.drive_front_share),
    key("drive.torque_max", "N.m", POSITIVE, |p| &mut p.drive_torque),
    key("drive.power_max", "W", POSITIVE, |p| &mut p.drive_power),
    key("drive.ratio", "1", POSITIVE, |p| &mut p.drive_ratio),
    key("diff_f.drive_lock", "1", SHARE, |p| &mut p.differentials[0].drive),
    key("diff_f.preload", "N.m", FROM_ZERO, |p| &mut p.differentials[0].preload),
    key("diff_f.sensitivity", "s/rad", FROM_ZERO, |p| &mut p.differentials[0].sensitivity),
    key("diff_r.drive_lock", "1", SHARE, |p| &mut p.differentials[1].drive),
    key("diff_r.preload", "N.m", FROM_ZERO, |p| &mut p.differentials[1].preload),
    key("diff_r.sensitivity", "s/rad", FROM_ZERO, |p| &mut p.differentials[1].sensitivity),
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

/// Names of the texts that a car of a lap has: tires of the front and the rear axle, and tables.
pub const TEXT_KEYS: [&str; 5] = ["tire_f.tir", "tire_r.tir", AERO_MAP, BRAKE_MAP, DRIVE_MAP];
const AERO_MAP: &str = "aero.map";
const BRAKE_MAP: &str = "brake.map";
const DRIVE_MAP: &str = "drive.map";

/// Whether a parameter matters to a body that swings alone.
fn is_of_swinging_body(name: &str) -> bool {
    let beginnings = ["body.I_xx", "body.I_yy", "ride.damping_", "roll.damping_", "roll.centre_"];
    beginnings.iter().any(|beginning| name.starts_with(beginning))
}

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
        let has_springs = parameters.has_springs();
        let has_platform = !parameters.aero_map.is_empty();
        let moves = has_platform || parameters.transients;
        match self.name {
            _ if simple => !parameters.has_tire_files(),
            _ if of_file => parameters.has_tire_files(),
            "aero.C_d" | "aero.C_lf" | "aero.C_lr" => !parameters.aero_map_replaces(self.name),
            "aero.ride_height_f" | "aero.ride_height_r" => has_platform,
            "pitch.centre" => moves,
            "ride.stiffness_f" | "ride.stiffness_r" => moves && !has_springs,
            name if is_of_swinging_body(name) => parameters.transients,
            "drive.ratio" => !parameters.drive_map.is_empty(),
            name if name.starts_with("diff_f.") => parameters.has_lock(0),
            name if name.starts_with("diff_r.") => parameters.has_lock(1),
            "brake.front_share" => parameters.brake_map.is_empty(),
            name if name.starts_with("spring.") || name.starts_with("bar.") => has_springs,
            name if name.starts_with("roll.") => !has_springs,
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
        let has_springs = car.has_springs();
        let factor = matches!(name.rsplit('.').next(), Some("LMUX" | "LMUY" | "LKX" | "LKY"));
        let why = match name.split_once('.') {
            Some(("tire_f" | "tire_r", _)) if factor => "no .tir file is told for its tires",
            Some(("tire_f" | "tire_r", _)) => {
                "its tires are those of a .tir file; lap a car without tire_f.tir and tire_r.tir"
            }
            _ if is_of_swinging_body(name) => "its body swings only with transients",
            Some(("roll", _)) => "its springs and bars say how stiff it is in roll",
            Some(("aero" | "brake", name)) if name.starts_with("C_") || name == "front_share" => {
                "a table takes its place"
            }
            Some(("aero", _)) => "it has no aero.map",
            Some(("pitch", _)) => "it has no aero.map, and its body swings only with transients",
            Some(("ride", _)) if has_springs => "springs say how stiff it is in heave",
            Some(("ride", _)) => "it has no aero.map, and its body swings only with transients",
            Some(("drive", _)) => "it has no drive.map",
            Some(("diff_f" | "diff_r", _)) => {
                "a differential that locks needs track widths, a sensitivity, a driven axle, and tires of a .tir file"
            }
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

    /// Sets the text of a file of a tire or of a table, one of [`TEXT_KEYS`]; whether there is such a text.
    pub fn set_text(&mut self, name: &str, text: &str) -> bool {
        let field = match name {
            "tire_f.tir" => Arc::make_mut(&mut self.tires[0].tir),
            "tire_r.tir" => Arc::make_mut(&mut self.tires[1].tir),
            AERO_MAP => &mut self.aero_map,
            BRAKE_MAP => &mut self.brake_map,
            DRIVE_MAP => &mut self.drive_map,
            _ => return false,
        };
        text.trim_end().clone_into(field);
        true
    }

    /// Whether the aero map has a column of this coefficient.
    fn aero_map_replaces(&self, name: &str) -> bool {
        let column = ["aero.C_d", "aero.C_lf", "aero.C_lr"].iter().position(|it| *it == name);
        let first = |constant: f64| {
            let map = car_file::read_aerodynamic_map(&self.aero_map, [constant; 3]).ok()?;
            map.values().next()?.get(column?).copied()
        };
        !self.aero_map.is_empty() && first(0.0) == first(1.0)
    }

    fn has_tire_files(&self) -> bool {
        self.tires.iter().any(|tire| !tire.tir.trim().is_empty())
    }

    /// Chooses whether the body swings on springs and dampers, or load moves without delay.
    pub fn set_transients(&mut self, transients: bool) {
        self.transients = transients;
    }

    /// Names of parameters that have to be told and were not.
    pub fn missing_names(&self) -> Vec<&'static str> {
        let is_missing = |key: &&ParameterKey| {
            let value = key.value(self);
            let carries_body = ["body.track_", "roll.stiffness_", "ride.stiffness_"]
                .iter()
                .any(|it| key.name.starts_with(it));
            match key.name {
                "drive.power_max" => value.is_nan() && self.drive_map.is_empty(),
                _ if carries_body && self.transients => {
                    key.is_used(self) && !(value > 0.0 && value.is_finite())
                }
                _ => value.is_nan() && key.is_used(self),
            }
        };
        PARAMETER_KEYS.iter().filter(is_missing).map(|key| key.name).collect()
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
    /// In words, when a number is missing or the file of a tire or a table is none.
    pub fn car(&self) -> Result<(LapCar, Vec<TireFileMessage>), String> {
        let missing = self.missing_names();
        if !missing.is_empty() {
            return Err(format!("the car has no {}", missing.join(", ")));
        }
        let mut messages = Vec::new();
        let mut wheels = [None; 2];
        let mut tires = self.simple_tires.map(LapTire::from);
        if self.has_tire_files() {
            let loads = self.body.static_loads();
            for (axle, name) in TEXT_KEYS.into_iter().take(2).enumerate() {
                let (tire, told) = self.tires[axle].load_tire(name)?;
                messages.extend(told);
                wheels[axle] = Wheel::of_tire(&tire, 0.5 * loads[axle]);
                tires[axle] = LapTire::from(tire);
            }
        }
        let mut limits = self.limits(wheels);
        let brake_balance = match self.brake_map.is_empty() {
            true => BrakeBalance::FrontShare(self.brake_front_share),
            false => {
                let (curve, most) = self.front_brake_force(radii_for_table(wheels, BRAKE_MAP)?)?;
                limits.brake_force = limits.brake_force.min(most);
                BrakeBalance::FrontForce(curve)
            }
        };
        let mut engine_power = None;
        if !self.drive_map.is_empty() {
            let engine = self.engine_power(radii_for_table(wheels, DRIVE_MAP)?)?;
            limits.power = engine.curve.maximum();
            engine_power = Some(engine);
        }
        let axles = self.axle_stiffness(wheels);
        let car = LapCar {
            body: self.body,
            aero: self.lap_aero(axles)?,
            track_widths: self.track_widths,
            roll_stiffness: axles.map(|axle| axle.roll),
            suspension: if self.transients { Some(self.suspension(axles)?) } else { None },
            brake_balance,
            drive_front_share: self.drive_front_share,
            differentials: [0, 1].map(|axle| self.locking_differential(axle, wheels[axle])),
            tires,
            engine_power,
            limits,
        };
        Ok((car, messages))
    }

    /// Drag and downforce, of the map where there is one.
    fn lap_aero(&self, axles: [AxleStiffness; 2]) -> Result<LapAero, String> {
        let mut aero = LapAero::from(self.aero);
        if self.aero_map.is_empty() {
            return Ok(aero);
        }
        let Aerodynamics { C_d, C_lf, C_lr, .. } = self.aero;
        let map = car_file::read_aerodynamic_map(&self.aero_map, [C_d, C_lf, C_lr])
            .map_err(|error| format!("{AERO_MAP}:{error}"))?;
        if let Some([C_d, ..]) =
            map.values().filter_map(|it| it.first_chunk::<3>()).find(|[C_d, ..]| *C_d < 0.0)
        {
            return Err(format!("{AERO_MAP}: expected C_d of at least 0, found {C_d}"));
        }
        let names = ["aero.ride_height_f", "aero.ride_height_r"];
        for ((name, height), range) in names.iter().zip(self.ride_height).zip(map.argument_ranges()) {
            if let Some([low, high]) = range.filter(|[low, high]| !(*low..=*high).contains(&height)) {
                return Err(format!(
                    "{name}: expected a height that {AERO_MAP} has, {low} to {high} m, found {height} m"
                ));
            }
        }
        let stiffness = axles.map(|axle| 2.0 * axle.ride);
        aero.platform = Some(AeroPlatform::new(&map, self.ride_height, stiffness, self.pitch_centre));
        Ok(aero)
    }

    /// Power of the engine at the wheels [W] over the speed of the car [m/s], with the pedal down and wheels of these radii [m].
    fn engine_power(&self, radii: [f64; 2]) -> Result<EnginePower, String> {
        let engine =
            car_file::read_engine_torque(&self.drive_map).map_err(|error| format!("{DRIVE_MAP}:{error}"))?;
        let most = if self.drive_power.is_nan() { f64::INFINITY } else { self.drive_power };
        let share = self.drive_front_share;
        let gear = self.drive_ratio * (share / radii[0] + (1.0 - share) / radii[1]);
        let power = |v_x: f64| {
            let speed = gear * v_x;
            (engine.full_load_torque(speed) * speed).clamp(0.0, most)
        };
        let curve = BSplineCurve::near(ENGINE_SPEEDS, ENGINE_INTERVALS, power);
        if curve.maximum() <= 0.0 {
            return Err(format!(
                "{DRIVE_MAP}: expected an engine that drives the car, found no power at any speed"
            ));
        }
        Ok(EnginePower { curve, gear, table_end: engine.speed_range().map(|[_, end]| end) })
    }

    /// Force of the front brakes [N] over that of all brakes, and the largest of these, on wheels of these radii [m].
    fn front_brake_force(&self, radii: [f64; 2]) -> Result<(BSplineCurve, f64), String> {
        let torques =
            car_file::read_brake_curves(&self.brake_map).map_err(|error| format!("{BRAKE_MAP}:{error}"))?;
        if let Some(torque) = torques.iter().flat_map(|axle| axle.values()).find(|torque| **torque < 0.0) {
            return Err(format!("{BRAKE_MAP}: expected torques of at least 0, found {torque}"));
        }
        let forces = |step: usize| {
            let pedal = step as f64 / PEDAL_INTERVALS as f64;
            [0, 1].map(|axle| torques[axle].interpolate(pedal) / radii[axle])
        };
        let mut by_pedal: Vec<[f64; 2]> = Vec::with_capacity(PEDAL_INTERVALS + 1);
        for [front, rear] in (0..=PEDAL_INTERVALS).map(forces) {
            if by_pedal.last().is_none_or(|[_, total]| front + rear > *total) {
                by_pedal.push([front, front + rear]);
            }
        }
        let [front_most, most] = by_pedal.last().copied().unwrap_or_default();
        if most <= 0.0 {
            return Err(format!("{BRAKE_MAP}: expected brakes that slow the car, found no torque"));
        }
        let front = |total: f64| {
            let behind = by_pedal.partition_point(|[_, it]| *it < total);
            let Some([high_front, high]) = by_pedal.get(behind) else { return front_most };
            let [low_front, low] = if behind == 0 { [0.0, 0.0] } else { by_pedal[behind - 1] };
            if *high > low {
                low_front + (high_front - low_front) * (total - low) / (high - low)
            } else {
                low_front
            }
        };
        // As an odd function: without a force nothing brakes.
        let curve = BSplineCurve::near([-most, most], BRAKE_INTERVALS, |it| front(it.abs()) * it.signum());
        Ok((curve, most))
    }

    /// Whether the differential of an axle can lock.
    fn has_lock(&self, axle: usize) -> bool {
        let share = if axle == 0 { self.drive_front_share } else { 1.0 - self.drive_front_share };
        share > 0.0
            && self.differentials[axle].sensitivity > 0.0
            && self.track_widths[axle] > 0.0
            && self.has_tire_files()
    }

    /// The lock of an axle on wheels of this size, by forces and speeds at the road.
    fn locking_differential(&self, axle: usize, wheel: Option<Wheel>) -> Option<LapDifferential> {
        let radius = wheel.filter(|_| self.has_lock(axle))?.radius;
        let DifferentialLock { drive, preload, sensitivity, .. } = self.differentials[axle];
        Some(LapDifferential {
            drive_lock: drive,
            preload: preload / radius,
            sensitivity: sensitivity / radius,
        })
    }

    fn has_springs(&self) -> bool {
        self.springs.iter().all(|axle| axle.rate > 0.0)
    }

    /// Stiffness of both axles: by their springs and bars, with the tires where these know theirs, or as it is told.
    fn axle_stiffness(&self, wheels: [Option<Wheel>; 2]) -> [AxleStiffness; 2] {
        let of = |axle: usize| {
            let tire = wheels[axle].map_or(f64::INFINITY, |wheel| wheel.stiffness);
            self.springs[axle].axle_stiffness(self.track_widths[axle], tire)
        };
        let told =
            |axle: usize| AxleStiffness { ride: self.ride_stiffness[axle], roll: self.roll_stiffness[axle] };
        match [of(0), of(1)] {
            [Some(front), Some(rear)] => [front, rear],
            _ => [told(0), told(1)],
        }
    }

    /// What carries a body that swings.
    fn suspension(&self, axles: [AxleStiffness; 2]) -> Result<Suspension, String> {
        let suspension = Suspension {
            track: self.track_widths,
            I_xx: self.I_xx,
            I_yy: self.I_yy,
            ride_stiffness: axles.map(|axle| axle.ride),
            ride_damping: self.ride_damping,
            roll_stiffness: axles.map(|axle| axle.roll),
            roll_damping: self.roll_damping,
            roll_centre: self.roll_centre,
            pitch_centre: self.pitch_centre,
            ..Suspension::default()
        };
        check_static_stability(&self.body, &suspension).map_err(|bad| bad.to_string())?;
        Ok(suspension)
    }

    /// Limits of the actuators; torques become forces on these wheels, and none where the tires know no radius.
    fn limits(&self, wheels: [Option<Wheel>; 2]) -> ActuatorLimits {
        let weight = self.body.m * G;
        let radii = wheels.map(|wheel| wheel.map(|wheel| wheel.radius));
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

/// A wheel on a tire that knows its size.
#[derive(Clone, Copy, Debug)]
struct Wheel {
    /// Effective radius under the load at rest [m].
    radius: f64,
    /// Vertical stiffness of the tire [N/m]; infinite where its file does not tell it.
    stiffness: f64,
}

impl Wheel {
    /// The wheel under a load [N]; none where the load crushes it.
    fn of_tire(tire: &MfTire, F_z: f64) -> Option<Self> {
        let point = TireOperatingPoint { F_z, v_x: 20.0, ..TireOperatingPoint::default() };
        let radius = tire.effective_radius(&point).filter(|radius| *radius > 0.0)?;
        let stiffness = Some(tire.coefficients().VERTICAL_STIFFNESS).filter(|it| *it > 0.0);
        Some(Wheel { radius, stiffness: stiffness.unwrap_or(f64::INFINITY) })
    }
}

fn radii_for_table(wheels: [Option<Wheel>; 2], table: &str) -> Result<[f64; 2], String> {
    let [Some(front), Some(rear)] = wheels else {
        return Err(format!(
            "{table}: expected tires of a .tir file, which know the radius of a wheel; found none"
        ));
    };
    Ok([front.radius, rear.radius])
}
