//! Lists mistakes that are made on purpose in a simulated log, and the names under which the doctor must find them.
#![allow(non_snake_case, dead_code, reason = "symbols as in vehicle dynamics; each user needs a part")]

use std::f64::consts::PI;

use drive_doctor::{CarData, LogExamination, LogFinding};
use drive_inference::{Drive, Tires};
use preparation::DriveLog;
use tire_inference::parameters::TireParameters;
use vehicle::{SingleTrackCar, VehicleBody};

use crate::drive;

/// A mistake in a log.
pub struct Mistake {
    /// What is wrong.
    pub name: &'static str,
    /// Checks of which one must be among the certain and likely findings; none for a clean log.
    pub checks: &'static [&'static str],
    /// Makes the mistake.
    pub make: fn(&mut Drive),
}

impl Mistake {
    /// Whether something certain or likely is said of a channel that has no mistake.
    pub fn is_of_wrong_channel(&self, found: &LogExamination) -> bool {
        let right = |it: &LogFinding| {
            self.checks.contains(&it.check.as_str())
                || it
                    .channels
                    .iter()
                    .any(|channel| self.checks.iter().any(|check| check.starts_with(channel)))
        };
        found.serious_findings().any(|it| !right(it))
    }

    /// Whether the first finding is the mistake, and nothing else is certain; for a clean log, whether there is none.
    pub fn is_named(&self, found: &LogExamination) -> bool {
        let serious: Vec<_> = found.serious_findings().collect();
        let right = |check: &String| self.checks.contains(&check.as_str());
        match self.checks.is_empty() {
            true => serious.is_empty(),
            false => serious.iter().any(|it| right(&it.check)) && serious.iter().all(|it| right(&it.check)),
        }
    }
}

/// The cars: masses of 780, 300, 780 and 2100 kg, with tires inside and outside of usual boxes.
pub const CARS: [(VehicleBody, Tires); 4] = [
    (VehicleBody { m: 780.0, I_zz: 1000.0, l_f: 1.4, l_r: 1.6, h: 0.35 }, UNEQUAL),
    (VehicleBody { m: 300.0, I_zz: 150.0, l_f: 0.8, l_r: 0.75, h: 0.3 }, STIFF),
    (VehicleBody { m: 780.0, I_zz: 1000.0, l_f: 1.4, l_r: 1.6, h: 0.35 }, SOFT),
    (VehicleBody { m: 2100.0, I_zz: 3600.0, l_f: 1.3, l_r: 1.6, h: 0.6 }, SOFT),
];
const UNEQUAL: Tires = Tires {
    front: TireParameters { B: 12.0, C: 1.4, D: 1.2, E: -0.3 },
    rear: TireParameters { B: 16.0, C: 1.5, D: 1.35, E: 0.2 },
};
const STIFF: Tires = Tires {
    front: TireParameters { B: 18.0, C: 1.6, D: 1.5, E: 0.5 },
    rear: TireParameters { B: 25.0, C: 1.9, D: 1.7, E: 0.9 },
};
const SOFT: Tires = Tires {
    front: TireParameters { B: 9.0, C: 1.6, D: 1.1, E: -1.2 },
    rear: TireParameters { B: 11.0, C: 1.6, D: 1.15, E: -1.0 },
};

/// A drive at the limit without a mistake, and what is known of its car.
pub fn clean(car: usize, seed: u64) -> (Drive, CarData) {
    driven(car, &drive::limit(&[15.0, 25.0, 40.0], 8.0), &drive::USUAL, seed)
}

/// A drive without a mistake.
pub fn driven(car: usize, reference: &drive::Reference, noise: &[f64; 4], seed: u64) -> (Drive, CarData) {
    let (body, tires) = CARS[car];
    let vehicle = drive::on_tires(&SingleTrackCar { body, ..SingleTrackCar::default() }, &tires);
    let recording = drive::drive(&vehicle, reference, noise, seed);
    (recording, CarData { axles: Some([body.l_f, body.l_r]), m: Some(body.m), ..CarData::default() })
}

/// A drive as the doctor takes it.
pub fn log(recording: &Drive) -> DriveLog<'static> {
    let mut log = DriveLog::default();
    for (name, column) in recording.named_columns().into_iter().skip(1) {
        log.insert(name, recording.t.clone(), column.to_vec());
    }
    log
}

fn scale(column: &mut [f64], factor: f64) {
    column.iter_mut().for_each(|value| *value *= factor);
}

/// Brings a column `rows` later.
fn late(column: &mut [f64], rows: usize) {
    column.rotate_right(rows);
    let first = column[rows];
    column[..rows].fill(first);
}

fn hold(column: &mut [f64], rows: usize) {
    column.chunks_mut(rows).for_each(|chunk| chunk.fill(chunk[0]));
}

/// v_y of a sensor 0.5 m ahead.
fn arm(recording: &mut Drive) {
    recording.v_y.iter_mut().zip(&recording.r).for_each(|(v_y, r)| *v_y += 0.5 * r);
}

fn gap(recording: &mut Drive) {
    recording.t.iter_mut().skip(4000).for_each(|t| *t += 5.0);
}

fn clip(column: &mut [f64], end: f64) {
    column.iter_mut().for_each(|value| *value = value.clamp(-end, end));
}

const fn mistake(name: &'static str, checks: &'static [&'static str], make: fn(&mut Drive)) -> Mistake {
    Mistake { name, checks, make }
}

/// All mistakes; the first is none.
pub const MISTAKES: [Mistake; 38] = [
    mistake("nothing", &[], |_| ()),
    mistake("v_x in km/h", &["v_x_unit"], |log| scale(&mut log.v_x, 3.6)),
    mistake("v_y in km/h", &["v_y_unit"], |log| scale(&mut log.v_y, 3.6)),
    mistake("v_x and v_y in km/h", &["v_x_unit", "v_y_unit"], |log| {
        scale(&mut log.v_x, 3.6);
        scale(&mut log.v_y, 3.6);
    }),
    mistake("r in deg/s", &["r_unit"], |log| scale(&mut log.r, 180.0 / PI)),
    mistake("delta in deg", &["delta_unit"], |log| scale(&mut log.delta, 180.0 / PI)),
    mistake("r in deg/s, delta in deg", &["r_unit", "delta_unit"], |log| {
        scale(&mut log.r, 180.0 / PI);
        scale(&mut log.delta, 180.0 / PI);
    }),
    mistake("a_y in g", &["a_y_unit"], |log| scale(&mut log.a_y, 1.0 / 9.80665)),
    mistake("F_x in kN", &["F_x_unit"], |log| scale(&mut log.F_x, 1e-3)),
    mistake("v_x mirrored", &["v_x_sign"], |log| scale(&mut log.v_x, -1.0)),
    mistake("v_y mirrored", &["v_y_sign"], |log| scale(&mut log.v_y, -1.0)),
    mistake("r mirrored", &["r_sign"], |log| scale(&mut log.r, -1.0)),
    mistake("a_y mirrored", &["a_y_sign"], |log| scale(&mut log.a_y, -1.0)),
    mistake("delta mirrored", &["delta_sign"], |log| scale(&mut log.delta, -1.0)),
    mistake("F_x mirrored", &["F_x_sign"], |log| scale(&mut log.F_x, -1.0)),
    mistake("steering wheel, ratio 15", &["delta_steering_wheel"], |log| scale(&mut log.delta, 15.0)),
    mistake("steering wheel in deg", &["delta_steering_wheel"], |log| {
        scale(&mut log.delta, 15.0 * 180.0 / PI)
    }),
    mistake("delta +0.3 deg", &["delta_offset"], |log| {
        log.delta.iter_mut().for_each(|value| *value += 0.3 * PI / 180.0);
    }),
    mistake("delta +5 %", &["delta_scale"], |log| scale(&mut log.delta, 1.05)),
    mistake("a_y +5 %", &["a_y_scale"], |log| scale(&mut log.a_y, 1.05)),
    mistake("r +5 %", &["r_scale"], |log| scale(&mut log.r, 1.05)),
    mistake("a_y 20 ms late", &["a_y_delay"], |log| late(&mut log.a_y, 2)),
    mistake("v_y 20 ms late", &["v_y_delay"], |log| late(&mut log.v_y, 2)),
    mistake("r 20 ms late", &["r_delay"], |log| late(&mut log.r, 2)),
    mistake("delta 30 ms late", &["delta_delay"], |log| late(&mut log.delta, 3)),
    mistake("all sensors 30 ms late", &["delta_delay"], |log| {
        for column in [&mut log.v_x, &mut log.v_y, &mut log.r, &mut log.a_y] {
            late(column, 3);
        }
    }),
    mistake("v_y sensor 0.5 m ahead", &["v_y_arm"], arm),
    mistake("F_x is 0", &["F_x_dead"], |log| log.F_x.fill(0.0)),
    mistake("v_y is 0", &["v_y_dead"], |log| log.v_y.fill(0.0)),
    mistake("v_x is 25", &["v_x_dead"], |log| log.v_x.fill(25.0)),
    mistake("gap of 5 s", &["gap"], gap),
    mistake("r held for 5 rows", &["r_held"], |log| hold(&mut log.r, 5)),
    mistake("v_y held for 5 rows", &["v_y_held"], |log| hold(&mut log.v_y, 5)),
    mistake("a_y clipped at 6 m/s2", &["a_y_saturated"], |log| clip(&mut log.a_y, 6.0)),
    mistake("r clipped at 0.2 rad/s", &["r_saturated"], |log| clip(&mut log.r, 0.2)),
    mistake("r frozen for 3 s", &["r_frozen"], |log| {
        let value = log.r[3000];
        log.r[3000..3300].fill(value);
    }),
    mistake("time in ms", &["time_unit"], |log| scale(&mut log.t, 1e3)),
    mistake("a spike in v_x", &["v_x_spikes"], |log| log.v_x[2500] = 1e4),
];
