//! Makes drives with something wrong in the log or in the car, and knows by what name it should be found.
#![allow(non_snake_case, dead_code, reason = "symbols as in vehicle dynamics; each user needs a part")]

use drive_inference::{Drive, DriveIdentification, Tires};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tire_inference::parameters::TireParameters;
use vehicle::{SingleTrackCar, VehicleBody};

use crate::drive::{self, Lags, Reference, STEP, USUAL, on_tires};

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
    /// Length of the true tires' relaxation [m].
    relaxation: f64,
    /// Names of causes of which any is right.
    causes: &'static [&'static str],
}

const NOTHING: Mistake =
    Mistake { name: "nothing", car: |_| {}, log: |_, _| {}, relaxation: 0.0, causes: &[] };

/// The rows of the table.
pub const MISTAKES: [Mistake; 14] = [
    NOTHING,
    Mistake {
        name: "a_y and r with AR(1) noise, 0.9",
        log: |drive, seed| coloured(drive, seed),
        causes: &["colour_r", "colour_a_y"],
        ..NOTHING
    },
    Mistake {
        name: "relaxation length 0.4 m",
        relaxation: 0.4,
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
];

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
        let lags = Lags { relaxation: self.relaxation, actuator };
        let mut recording = drive::drive_lagging(&on_tires, reference, &USUAL, seed, lags);
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
