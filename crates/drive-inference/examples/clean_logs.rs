//! Prints how many values are true and identified on clean logs of eight cars, by inputs, driving and rate of the log.
//!
//! `clean_logs [--seeds N] [--car CAR] [--only ROW] [--details]`: rows of inputs that are held or move between rows, hard or gentle driving, 100 or
//! 20 Hz, over cars and seeds.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../tests/support/drive.rs"]
mod drive;
#[path = "../tests/support/processor.rs"]
mod processor;

use drive::{CarEffects, Reference, USUAL};
use drive_inference::{DriveIdentification, DriveOptions, Tires, identify_tires};
use processor::processor;
use tire_inference::axles::Axle;
use tire_inference::model::ModelFit;
use tire_inference::parameters::TireParameters;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;
use vehicle::{SingleTrackCar, VehicleBody};

/// Error of a value from which on it is wrong by too much.
const TOO_MUCH: f64 = 0.02;

const fn tire(B: f64, C: f64, D: f64, E: f64) -> TireParameters {
    TireParameters { B, C, D, E }
}

const fn body(m: f64, I_zz: f64, l_f: f64, l_r: f64, h: f64) -> VehicleBody {
    VehicleBody { m, I_zz, l_f, l_r, h }
}

const CARS: [(&str, VehicleBody, [TireParameters; 2]); 8] = [
    (
        "kart 160 kg",
        body(160.0, 22.0, 0.6, 0.45, 0.2),
        [tire(14.0, 1.5, 1.6, 0.1), tire(15.0, 1.55, 1.65, 0.2)],
    ),
    (
        "formula 310 kg",
        body(310.0, 130.0, 0.85, 0.72, 0.28),
        [tire(13.0, 1.45, 1.5, -0.3), tire(15.0, 1.5, 1.55, 0.0)],
    ),
    (
        "prototype 520 kg",
        body(520.0, 480.0, 1.3, 1.1, 0.27),
        [tire(17.0, 1.6, 1.7, 0.4), tire(20.0, 1.65, 1.75, 0.5)],
    ),
    (
        "roadster 950 kg",
        body(950.0, 1250.0, 1.15, 1.2, 0.46),
        [tire(11.0, 1.45, 1.05, -0.4), tire(12.5, 1.5, 1.1, -0.2)],
    ),
    (
        "hatch 1100 kg on snow",
        body(1100.0, 1700.0, 1.0, 1.5, 0.52),
        [tire(10.0, 1.5, 0.35, -0.3), tire(11.0, 1.55, 0.38, 0.0)],
    ),
    (
        "touring 1250 kg",
        body(1250.0, 2100.0, 1.2, 1.45, 0.44),
        [tire(15.0, 1.55, 1.4, 0.2), tire(18.0, 1.6, 1.45, 0.4)],
    ),
    (
        "saloon 1650 kg",
        body(1650.0, 2900.0, 1.35, 1.5, 0.55),
        [tire(9.0, 1.4, 0.95, -0.8), tire(11.0, 1.45, 1.0, -0.5)],
    ),
    (
        "van 2400 kg",
        body(2400.0, 5200.0, 1.6, 1.7, 0.8),
        [tire(7.5, 1.4, 0.85, -1.0), tire(9.0, 1.45, 0.9, -0.6)],
    ),
];

struct Row {
    name: &'static str,
    /// Time constant of steering and force [s].
    actuator: f64,
    gentle: bool,
    /// Rows of the loop per row of the log.
    every: usize,
}

const ROWS: [Row; 8] = [
    Row { name: "held, hard, 100 Hz", actuator: 0.0, gentle: false, every: 1 },
    Row { name: "held, gentle, 100 Hz", actuator: 0.0, gentle: true, every: 1 },
    Row { name: "continuous, hard, 100 Hz", actuator: 0.04, gentle: false, every: 1 },
    Row { name: "continuous, gentle, 100 Hz", actuator: 0.04, gentle: true, every: 1 },
    Row { name: "continuous, hard, 50 Hz", actuator: 0.04, gentle: false, every: 2 },
    Row { name: "continuous, gentle, 50 Hz", actuator: 0.04, gentle: true, every: 2 },
    Row { name: "continuous, hard, 20 Hz", actuator: 0.04, gentle: false, every: 5 },
    Row { name: "continuous, gentle, 20 Hz", actuator: 0.04, gentle: true, every: 5 },
];

/// References that a car of this friction can follow.
fn reference(gentle: bool, friction: f64) -> Reference {
    let fastest = 35.0 * friction.min(1.0).sqrt();
    let speeds = [0.35 * fastest, 0.6 * fastest, fastest];
    let share = if gentle { 0.35 } else { 1.0 } * friction / 1.5;
    drive::limit_share(&speeds, 8.0, share)
}

#[derive(Default)]
struct Totals {
    runs: usize,
    refused: usize,
    values: usize,
    identified: usize,
    wrong: usize,
    by_too_much: usize,
    worst: f64,
    seconds: f64,
}

impl Totals {
    fn add(&mut self, found: &DriveIdentification, truth: &Tires) {
        self.refused += usize::from(found.model.verdict == ModelFit::DoesNotFit);
        for axle in Axle::ALL {
            let TireParameters { B, C, D, E } = truth[axle];
            let K = truth[axle].stiffness();
            let truths =
                [(Quantity::B, B), (Quantity::C, C), (Quantity::D, D), (Quantity::E, E), (Quantity::K, K)];
            let estimate = &found.estimates[axle];
            for (name, value) in truths {
                self.values += 1;
                if estimate.identified[&name] != Identifiability::Identified {
                    continue;
                }
                self.identified += 1;
                let [low, high] = estimate.interval[&name];
                if !(low..=high).contains(&value) {
                    // E is compared with what matters of it.
                    let error = (estimate.mean[&name] - value).abs() / value.abs().max(1.0);
                    self.wrong += 1;
                    self.worst = self.worst.max(error);
                    self.by_too_much += usize::from(error > TOO_MUCH);
                }
            }
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let after = |flag: &str| arguments.iter().position(|a| a == flag).and_then(|i| arguments.get(i + 1));
    let seeds: u64 = after("--seeds").map_or(Ok(1), |n| n.parse())?;
    let only = after("--only").cloned().unwrap_or_default();
    let car_only = after("--car").cloned().unwrap_or_default();
    let details = arguments.iter().any(|a| a == "--details");
    for row in ROWS.iter().filter(|row| row.name.contains(&only)) {
        let mut totals = Totals::default();
        for (car_name, body, [front, rear]) in CARS.iter().filter(|it| it.0.contains(&car_only)) {
            for seed in 1..=seeds {
                let car = SingleTrackCar { body: *body, ..SingleTrackCar::default() };
                let tires = Tires { front: *front, rear: *rear };
                let reference = reference(row.gentle, front.D);
                let effects = CarEffects { actuator: row.actuator, ..CarEffects::default() };
                let on_tires = drive::on_tires(&car, &tires);
                let log = drive::drive_with_effects(&on_tires, &reference, &USUAL, seed, effects);
                let begin = processor();
                let options = DriveOptions { car, ..DriveOptions::default() };
                let log = log.map_columns(|column| column.iter().copied().step_by(row.every).collect());
                let found = identify_tires(&[log], &options, &mut |_, _| true);
                totals.seconds += processor() - begin;
                totals.runs += 1;
                match found {
                    Ok(found) => {
                        totals.add(&found, &tires);
                        if details {
                            println!("  {}, {car_name}, {seed}: {}", row.name, found.model.sentence);
                        }
                    }
                    Err(error) => {
                        totals.refused += 1;
                        println!("  {}, {car_name}, {seed}: {error}", row.name);
                    }
                }
            }
        }
        println!(
            "{:27} {:3} runs, {} refused; identified {:3} of {:3} values, {} of them outside their interval, {} by more than 2 % (worst {:.1} %); {:.1} s",
            row.name,
            totals.runs,
            totals.refused,
            totals.identified,
            totals.values,
            totals.wrong,
            totals.by_too_much,
            100.0 * totals.worst,
            totals.seconds / totals.runs.max(1) as f64
        );
    }
    Ok(())
}
