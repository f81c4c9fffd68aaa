//! Makes drives with something wrong in the log or in the car, and knows by what name it should be found.
#![allow(non_snake_case, dead_code, reason = "symbols as in vehicle dynamics; each user needs a part")]

use std::f64::consts::TAU;

use drive_inference::{Drive, DriveIdentification, Tires};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tire_inference::parameters::TireParameters;
use vehicle::{SingleTrackCar, VehicleBody};

use crate::drive::{self, CarEffects, Reference, STEP, USUAL, on_tires};

/// A cart, the demo car, and a heavy car.
pub const CARS: [(&str, VehicleBody); 3] = [
    ("780 kg", VehicleBody { m: 780.0, I_zz: 1000.0, l_f: 1.4, l_r: 1.6, h: 0.35 }),
    ("300 kg", VehicleBody { m: 300.0, I_zz: 200.0, l_f: 0.85, l_r: 0.75, h: 0.3 }),
    ("2100 kg", VehicleBody { m: 2100.0, I_zz: 3600.0, l_f: 1.45, l_r: 1.55, h: 0.6 }),
];

/// Tires that no scenario has.
pub const TIRES: [(&str, Tires); 2] = [
    (
        "soft",
        Tires {
            front: TireParameters { B: 9.0, C: 1.6, D: 1.1, E: -1.2 },
            rear: TireParameters { B: 12.0, C: 1.5, D: 1.2, E: -0.5 },
        },
    ),
    (
        "race",
        Tires {
            front: TireParameters { B: 18.0, C: 1.6, D: 1.5, E: 0.5 },
            rear: TireParameters { B: 25.0, C: 1.9, D: 1.7, E: 0.9 },
        },
    ),
];

/// What is done to the true car, given what the configuration says, before it drives.
type CarModification = fn(&mut VehicleBody);
/// What is done to a clean log.
type DriveModification = fn(&mut Drive, u64);

/// Something wrong.
pub struct Mistake {
    /// Name of the row.
    pub name: &'static str,
    car: CarModification,
    log: DriveModification,
    effects: fn(&mut CarEffects),
    /// Names of causes of which any is right.
    causes: &'static [&'static str],
}

const NOTHING: Mistake =
    Mistake { name: "nothing", car: |_| {}, log: |_, _| {}, effects: |_| {}, causes: &[] };

/// The rows of the table.
pub const MISTAKES: [Mistake; 26] = [
    NOTHING,
    Mistake {
        name: "a_y and r with AR(1) noise, 0.9",
        log: |drive, seed| coloured(drive, seed),
        causes: &["colour_r", "colour_a_y"],
        ..NOTHING
    },
    Mistake {
        name: "relaxation length 0.4 m",
        effects: |it| it.relaxation = 0.4,
        causes: &["relaxation_front", "relaxation_rear"],
        ..NOTHING
    },
    Mistake {
        name: "a_y 20 ms late",
        log: |drive, _| late(&mut drive.a_y, 2),
        causes: &["a_y_delay"],
        ..NOTHING
    },
    Mistake {
        name: "all sensors 30 ms late",
        log: |drive, _| {
            for column in [&mut drive.v_x, &mut drive.v_y, &mut drive.r, &mut drive.a_y] {
                late(column, 3);
            }
        },
        causes: &["steering_delay"],
        ..NOTHING
    },
    Mistake {
        name: "steering +0.3 deg",
        log: |drive, _| drive.delta.iter_mut().for_each(|delta| *delta += 0.3_f64.to_radians()),
        causes: &["steering_offset"],
        ..NOTHING
    },
    Mistake {
        name: "steering scale +5 %",
        log: |drive, _| drive.delta.iter_mut().for_each(|delta| *delta *= 1.05),
        causes: &["steering_gain"],
        ..NOTHING
    },
    Mistake {
        name: "v_y sensor 0.5 m ahead",
        log: |drive, _| {
            for (v_y, r) in drive.v_y.iter_mut().zip(&drive.r) {
                *v_y += 0.5 * r;
            }
        },
        causes: &["v_y_lever"],
        ..NOTHING
    },
    Mistake {
        name: "a_y sensor 0.2 m ahead",
        log: |drive, _| {
            let r = drive.r.clone();
            for k in 1..r.len() - 1 {
                drive.a_y[k] += 0.2 * (r[k + 1] - r[k - 1]) / (2.0 * STEP);
            }
        },
        causes: &["a_y_lever"],
        ..NOTHING
    },
    Mistake {
        name: "cg 2 cm",
        car: |body| {
            body.l_f -= 0.02;
            body.l_r += 0.02;
        },
        causes: &["cg"],
        ..NOTHING
    },
    Mistake { name: "I_zz +10 %", car: |body| body.I_zz /= 1.1, causes: &["inertia"], ..NOTHING },
    Mistake { name: "mass +3 %", car: |body| body.m /= 1.03, causes: &["mass"], ..NOTHING },
    Mistake {
        name: "F_x = 0",
        log: |drive, _| drive.F_x.iter_mut().for_each(|F_x| *F_x = 0.0),
        causes: &["longitudinal force"],
        ..NOTHING
    },
    Mistake {
        name: "gyro +3 %, 0.5 deg/s",
        log: |drive, _| drive.r.iter_mut().for_each(|r| *r = 1.03 * *r + 0.5_f64.to_radians()),
        causes: &["r_gain", "r_offset"],
        ..NOTHING
    },
    Mistake {
        name: "v_x scale +2 %",
        log: |drive, _| drive.v_x.iter_mut().for_each(|v_x| *v_x *= 1.02),
        causes: &["v_x_gain"],
        ..NOTHING
    },
    Mistake {
        name: "steering in steps of 0.5 deg",
        log: |drive, _| {
            let step = 0.5_f64.to_radians();
            drive.delta.iter_mut().for_each(|delta| *delta = (*delta / step).round() * step);
        },
        causes: &["steering_steps"],
        ..NOTHING
    },
    Mistake {
        name: "friction / 1.3 from 21 s on",
        effects: |it| it.friction_change = (21.0, 1.0 / 1.3),
        causes: &["friction_change"],
        ..NOTHING
    },
    Mistake {
        name: "load sensitivity 15 %",
        effects: |it| it.load_sensitivity = 0.15,
        causes: &["load_sensitivity"],
        ..NOTHING
    },
    Mistake {
        name: "bank 3 deg in left turns",
        effects: |it| it.bank_left = 3_f64.to_radians(),
        causes: &["bank_left"],
        ..NOTHING
    },
    Mistake {
        name: "v_y sensor 0.4 m above roll axis",
        log: |drive, _| {
            // A body that rolls 3 deg per g, as a system of second order of 1.5 Hz.
            let (gain, omega, damping) = (3_f64.to_radians() / 9.81, TAU * 1.5, 0.4);
            let [mut roll, mut rate] = [0.0; 2];
            for (v_y, a_y) in drive.v_y.iter_mut().zip(&drive.a_y) {
                for _ in 0..10 {
                    let h = 0.1 * STEP;
                    rate += h * (omega * omega * (gain * a_y - roll) - 2.0 * damping * omega * rate);
                    roll += h * rate;
                }
                *v_y += 0.4 * rate;
            }
        },
        causes: &["v_y_roll", "v_y_roll_acceleration"],
        ..NOTHING
    },
    Mistake {
        name: "clock of v_y 0.5 % slow",
        log: |drive, _| stretch(&mut drive.v_y, 0.005),
        causes: &["v_y_clock"],
        ..NOTHING
    },
    Mistake {
        name: "clock of r and a_y 0.05 % slow",
        log: |drive, _| {
            stretch(&mut drive.r, 0.0005);
            stretch(&mut drive.a_y, 0.0005);
        },
        causes: &["inertial_clock"],
        ..NOTHING
    },
    Mistake {
        name: "outliers 1 %",
        log: |drive, seed| outliers(drive, seed),
        causes: &["outliers"],
        ..NOTHING
    },
    Mistake {
        name: "yaw rate behind 5 Hz",
        log: |drive, _| low_pass(&mut drive.r, 5.0),
        causes: &["r_low_pass"],
        ..NOTHING
    },
    Mistake {
        name: "a_y behind 5 Hz",
        log: |drive, _| low_pass(&mut drive.a_y, 5.0),
        causes: &["a_y_low_pass"],
        ..NOTHING
    },
    Mistake {
        name: "relaxation 0.4 m, steering +0.3 deg",
        effects: |it| it.relaxation = 0.4,
        log: |drive, _| drive.delta.iter_mut().for_each(|delta| *delta += 0.3_f64.to_radians()),
        causes: &["relaxation_front", "relaxation_rear", "steering_offset"],
        ..NOTHING
    },
];

/// A record by a clock that is slow, read in between by lines.
fn stretch(column: &mut [f64], drift: f64) {
    let before = column.to_vec();
    let middle = 0.5 * (column.len() - 1) as f64;
    for (k, value) in column.iter_mut().enumerate() {
        let at = (k as f64 - drift * (k as f64 - middle)).clamp(0.0, (before.len() - 1) as f64);
        let row = (at as usize).min(before.len() - 2);
        let share = at - row as f64;
        *value = before[row] + share * (before[row + 1] - before[row]);
    }
}

fn low_pass(column: &mut [f64], frequency: f64) {
    let share = 1.0 - (-TAU * frequency * STEP).exp();
    let mut slow = column[0];
    for value in column {
        slow += share * (*value - slow);
        *value = slow;
    }
}

/// One of a hundred values is far off.
fn outliers(drive: &mut Drive, seed: u64) {
    let mut rng = Pcg64Mcg::seed_from_u64(2000 + seed);
    for (column, std) in [(&mut drive.v_y, USUAL[1]), (&mut drive.r, USUAL[2]), (&mut drive.a_y, USUAL[3])] {
        for value in column.iter_mut() {
            if rng.random_range(0.0..1.0) < 0.01 {
                *value += std * if rng.random_range(0.0..1.0) < 0.5 { 20.0 } else { -20.0 };
            }
        }
    }
}

fn late(column: &mut [f64], rows: usize) {
    let before = column.to_vec();
    for k in 0..column.len() {
        column[k] = before[k.saturating_sub(rows)];
    }
}

/// Adds noise as large as the sensors', of which 0.9 stays from row to row.
fn coloured(drive: &mut Drive, seed: u64) {
    let mut rng = Pcg64Mcg::seed_from_u64(1000 + seed);
    let share = 0.9_f64;
    for (column, std) in [(&mut drive.r, USUAL[2]), (&mut drive.a_y, USUAL[3])] {
        let mut noise = 0.0;
        for value in column.iter_mut() {
            let e: f64 = StandardNormal.sample(&mut rng);
            noise = share * noise + (1.0 - share * share).sqrt() * std * e;
            *value += noise;
        }
    }
}

impl Mistake {
    /// A drive of a car that the configuration has as `assumed`.
    /// Steering and force follow its commands with a time constant [s].
    pub fn drive(
        &self,
        assumed: &SingleTrackCar,
        tires: &Tires,
        reference: &Reference,
        actuator: f64,
        seed: u64,
    ) -> Drive {
        let mut car = *assumed;
        (self.car)(&mut car.body);
        let on_tires = on_tires(&car, tires);
        let mut effects = CarEffects { actuator, ..CarEffects::default() };
        (self.effects)(&mut effects);
        let mut recording = drive::drive_with_effects(&on_tires, reference, &USUAL, seed, effects);
        (self.log)(&mut recording, seed);
        recording
    }

    /// Whether the first sentence names it.
    pub fn is_named(&self, found: &DriveIdentification) -> bool {
        let first = found.causes.iter().find(|cause| cause.gain.is_some());
        let failed = found.model.tests.iter().filter(|test| !test.has_passed());
        let mut names =
            first.map(|it| it.name.as_str()).into_iter().chain(failed.map(|test| test.name.as_str()));
        self.causes.is_empty() || names.any(|name| self.causes.contains(&name))
    }
}
