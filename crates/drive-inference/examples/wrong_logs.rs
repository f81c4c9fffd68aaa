//! Prints how often intervals miss the truth, and what is said, when something is wrong in the log or in the car.
//!
//! `wrong_logs [--seeds N] [--only MISTAKE] [--car CAR] [--tires TIRES] [--lag SECONDS] [--details] [--widths]`: rows of mistakes over cars, tires and seeds.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../tests/support/drive.rs"]
mod drive;
#[path = "../tests/support/mistakes.rs"]
mod mistakes;
#[path = "../tests/support/processor.rs"]
mod processor;

use drive_inference::{DriveIdentification, DriveOptions, Tires, identify_tires};
use mistakes::{CARS, MISTAKES, Mistake, TIRES};
use processor::processor;
use tire_inference::axles::Axle;
use tire_inference::parameters::TireParameters;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;
use vehicle::SingleTrackCar;

/// What one row adds up to.
#[derive(Default)]
struct Row {
    outside: usize,
    outside_identified: usize,
    identified: usize,
    all: usize,
    worst: f64,
    named: usize,
    runs: usize,
    seconds: f64,
    widths: Vec<f64>,
}

fn truths(tire: &TireParameters) -> [(Quantity, f64); 5] {
    let TireParameters { B, C, D, E } = *tire;
    [(Quantity::B, B), (Quantity::C, C), (Quantity::D, D), (Quantity::E, E), (Quantity::K, tire.stiffness())]
}

impl Row {
    fn add(&mut self, found: &DriveIdentification, truth: &Tires, mistake: &Mistake) {
        self.runs += 1;
        self.named += usize::from(mistake.is_named(found));
        for axle in Axle::ALL {
            let estimate = &found.estimates[axle];
            for (name, value) in truths(&truth[axle]) {
                let [low, high] = estimate.interval[&name];
                let inside = (low..=high).contains(&value);
                let identified = estimate.identified[&name] == Identifiability::Identified;
                self.all += 1;
                self.outside += usize::from(!inside);
                self.identified += usize::from(identified);
                self.outside_identified += usize::from(!inside && identified);
                let error = (estimate.mean[&name] / value - 1.0).abs();
                self.worst = self.worst.max(error);
                self.widths.push((high - low) / value.abs());
            }
        }
    }

    fn print(&self, name: &str) {
        println!(
            "{name:34} {:3} of {:3} outside, {:3} of them identified; identified {:3}; worst {:6.1} %; cause named {} of {}; {:.1} s",
            self.outside,
            self.all,
            self.outside_identified,
            self.identified,
            100.0 * self.worst,
            self.named,
            self.runs,
            self.seconds / self.runs.max(1) as f64
        );
    }
}

fn details(found: &DriveIdentification) {
    println!("    model {:?}: {}", found.model.verdict, found.model.sentence);
    println!("    inputs {:?}", found.interpolation);
    for test in found.model.tests.iter().filter(|test| !test.has_passed()) {
        println!("      {}: {:.3} over {:.3}: {}", test.name, test.statistic, test.limit, test.sentence);
    }
    for cause in &found.causes {
        let gain = cause.gain.map_or(String::new(), |gain| format!("gain {gain:.1}"));
        println!("    {} {gain}", cause.sentence);
    }
    println!(
        "    autocorrelation {:.2?}, cost {:.3}",
        found.innovations.autocorrelation,
        found.innovations.cost / found.innovations.expected_cost
    );
    for axle in Axle::ALL {
        let estimate = &found.estimates[axle];
        let of = |name: Quantity| {
            format!(
                "{name} {:.4} ± {:.4} {:?}",
                estimate.mean[&name], estimate.std[&name], estimate.identified[&name]
            )
        };
        println!(
            "    {axle:?}: {}",
            [Quantity::B, Quantity::C, Quantity::D, Quantity::E, Quantity::K].map(of).join(", ")
        );
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|a| a == flag);
    let after = |flag: &str| arguments.iter().position(|a| a == flag).and_then(|i| arguments.get(i + 1));
    let seeds: u64 = after("--seeds").map_or(Ok(1), |n| n.parse())?;
    // Time constant of steering and force; without it they are held over a row.
    let lag: f64 = after("--lag").map_or(Ok(0.0), |n| n.parse())?;
    let only = after("--only").cloned().unwrap_or_default();
    let car_only = after("--car").cloned().unwrap_or_default();
    let tires_only = after("--tires").cloned().unwrap_or_default();
    let reference = drive::limit(&[15.0, 25.0, 40.0, 60.0, 80.0], 6.0);
    for mistake in &MISTAKES {
        if !mistake.name.contains(&only) {
            continue;
        }
        let mut row = Row::default();
        for (car_name, body) in CARS {
            if !car_name.contains(&car_only) {
                continue;
            }
            for (tires_name, tires) in TIRES {
                if !tires_name.contains(&tires_only) {
                    continue;
                }
                for seed in 1..=seeds {
                    let assumed = SingleTrackCar { body, ..SingleTrackCar::default() };
                    let recording = mistake.drive(&assumed, &tires, &reference, lag, seed);
                    let options = DriveOptions { car: assumed, ..DriveOptions::default() };
                    let begin = processor();
                    let found = identify_tires(&[recording], &options, &mut |_, _| true);
                    row.seconds += processor() - begin;
                    let name = format!("{} {car_name} {tires_name} {seed}", mistake.name);
                    match found {
                        Ok(found) => {
                            row.add(&found, &tires, mistake);
                            if has("--details") {
                                let fits = found.formulations.iter().map(|fitted| fitted.seconds);
                                println!("  {name}, {:.2} s", fits.sum::<f64>());
                                details(&found);
                            }
                        }
                        Err(error) => println!("  {name}: {error}"),
                    }
                }
            }
        }
        row.print(mistake.name);
        if has("--widths") {
            let widths: Vec<_> = row.widths.iter().map(|width| format!("{width:.5}")).collect();
            println!("    widths {}", widths.join(" "));
        }
    }
    Ok(())
}
