//! Prints the processor time that the identification of a drive of 100 s at 100 Hz takes, in all and by stage.
//!
//! `processor_time [--only CASE]`: clean logs, steering that moves between rows, and a kart whose log has a wrong delay.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../tests/support/drive.rs"]
mod drive;
#[path = "../tests/support/processor.rs"]
mod processor;

use drive::CarEffects;
use drive_inference::{Drive, DriveOptions, Tires, identify_tires};
use processor::processor;
use tire_inference::axles::Axle;
use tire_inference::parameters::TireParameters;
use tire_inference::verdict::Identifiability;
use vehicle::{SingleTrackCar, VehicleBody};

const ROWS: usize = 10_000;
const SALOON: VehicleBody = VehicleBody { m: 1450.0, I_zz: 2400.0, l_f: 1.2, l_r: 1.5, h: 0.5 };
const KART: VehicleBody = VehicleBody { m: 160.0, I_zz: 28.0, l_f: 0.6, l_r: 0.44, h: 0.2 };
const ROAD: Tires = Tires {
    front: TireParameters { B: 11.0, C: 1.5, D: 1.0, E: -0.8 },
    rear: TireParameters { B: 14.0, C: 1.45, D: 1.05, E: -0.4 },
};

struct Case {
    name: &'static str,
    body: VehicleBody,
    /// Speeds of the drive [m/s].
    speeds: &'static [f64],
    /// Time constant of steering and force [s]; they are held over a row where it is 0.
    lag: f64,
    mistake: fn(&mut Drive),
}

const FAST: &[f64] = &[15.0, 25.0, 40.0, 60.0, 80.0];
const CASES: [Case; 4] = [
    Case { name: "held", body: SALOON, speeds: FAST, lag: 0.0, mistake: |_| {} },
    Case { name: "moving", body: SALOON, speeds: FAST, lag: 0.03, mistake: |_| {} },
    Case {
        name: "kart, delta 40 ms early",
        body: KART,
        speeds: &[8.0, 10.0, 12.0, 14.0],
        lag: 0.03,
        mistake: |drive| {
            drive.delta.rotate_left(4);
            drive.delta.iter_mut().for_each(|delta| *delta *= 0.88);
        },
    },
    Case {
        name: "saloon, a_y 60 ms late",
        body: SALOON,
        speeds: FAST,
        lag: 0.03,
        mistake: |drive| drive.a_y.rotate_right(6),
    },
];

/// Processor time of each stage in the order in which they come [s].
#[derive(Default)]
struct StageTimes {
    stages: Vec<(String, f64)>,
    since: f64,
}

impl StageTimes {
    fn enter(&mut self, stage: &str) {
        if self.stages.last().is_some_and(|(last, _)| last == stage) {
            return;
        }
        self.close();
        self.stages.push((stage.to_owned(), 0.0));
    }

    fn close(&mut self) {
        let now = processor();
        if let Some((_, seconds)) = self.stages.last_mut() {
            *seconds = now - self.since;
        }
        self.since = now;
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let only = arguments.iter().position(|it| it == "--only").and_then(|i| arguments.get(i + 1));
    for Case { name, body, speeds, lag, mistake } in CASES {
        if only.is_some_and(|only| !name.contains(only.as_str())) {
            continue;
        }
        let car = SingleTrackCar { body, ..SingleTrackCar::default() };
        let mut reference = drive::limit(speeds, 6.0);
        reference.truncate(ROWS);
        let lags = CarEffects { actuator: lag, ..CarEffects::default() };
        let on_tires = drive::on_tires(&car, &ROAD);
        let mut recording = drive::drive_with_effects(&on_tires, &reference, &drive::USUAL, 1, lags);
        mistake(&mut recording);
        let options = DriveOptions { car, ..DriveOptions::default() };
        let mut times = StageTimes { since: processor(), ..StageTimes::default() };
        let begin = times.since;
        let found = identify_tires(&[recording], &options, &mut |_, stage| {
            times.enter(stage);
            true
        });
        times.close();
        let stages: Vec<String> =
            times.stages.iter().map(|(stage, seconds)| format!("{stage} {seconds:.2}")).collect();
        println!("{name:26} {} rows, {:6.2} s: {}", reference.len(), processor() - begin, stages.join(", "));
        match found {
            Ok(found) => {
                let verdicts = Axle::ALL.map(|axle| {
                    let estimate = &found.estimates[axle];
                    let of = |verdict: Identifiability| {
                        estimate.identified.values().filter(|it| **it == verdict).count()
                    };
                    format!("{axle:?} {} of {}", of(Identifiability::Identified), estimate.identified.len())
                });
                println!("  identified: {}; {}", verdicts.join(", "), found.model.sentence);
            }
            Err(error) => println!("  {error}"),
        }
    }
}
