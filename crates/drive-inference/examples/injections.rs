//! Prints how well errors of sensors are recovered that were made on purpose, in logs with the noise of a real one:
//! `injections [--count N] [--from SEED] [--details]`.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../tests/support/drive.rs"]
mod drive;
#[path = "../tests/support/injected.rs"]
mod injected;
#[path = "../tests/support/processor.rs"]
mod processor;
#[path = "../../drive-doctor/tests/support/real_log.rs"]
mod real_log;

use std::collections::BTreeMap;

use drive_inference::calibration::{CalibratedError, calibrate_sensors};
use injected::{Injected, TIRES, car, clean};
use processor::processor;

/// What the injections of one error add up to.
#[derive(Default)]
struct Row {
    count: usize,
    inside: usize,
    close: usize,
    squares: f64,
    worst: f64,
}

impl Row {
    fn add(&mut self, found: &CalibratedError, truth: f64) {
        let off = found.value - truth;
        let [low, high] = found.interval;
        self.count += 1;
        self.inside += usize::from((low..=high).contains(&truth));
        self.close += usize::from(off.abs() <= injected::tolerance(found.cause));
        self.squares += off * off;
        self.worst = self.worst.max(off.abs());
    }

    fn print(&self, found: &CalibratedError) {
        let (factor, unit) = found.cause.describe().display;
        let rms = factor * (self.squares / self.count as f64).sqrt();
        let percent = |part: usize| 100.0 * part as f64 / self.count as f64;
        println!(
            "{:16} {:4} times: off by {rms:.4} {unit} rms, {:.4} at most; {:.1} % within {:.3} {unit}; {:.1} % inside the 95 % interval",
            found.name,
            self.count,
            factor * self.worst,
            percent(self.close),
            factor * injected::tolerance(found.cause),
            percent(self.inside),
        );
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let after = |flag: &str, or: u64| {
        let place = arguments.iter().position(|it| it == flag);
        place.and_then(|place| arguments.get(place + 1)).map_or(Ok(or), |text| text.parse())
    };
    let (count, from) = (after("--count", 20)?, after("--from", 0)?);
    let details = arguments.iter().any(|it| it == "--details");
    let clean = clean(&TIRES);
    let mut rows: BTreeMap<&str, (Row, CalibratedError)> = BTreeMap::new();
    let begin = processor();
    for seed in from..from + count {
        let made = Injected::new(seed);
        let found = calibrate_sensors(&car(), &[made.log(&clean, seed)], &made.causes())?;
        for (it, truth) in found.errors.iter().zip(made.values()) {
            rows.entry(it.name).or_insert_with(|| (Row::default(), *it)).0.add(it, truth);
            if details {
                let off = it.value - truth;
                println!("{seed} {} {truth:.5} off {off:.5}, {:.2} std", it.name, off / it.std);
            }
        }
    }
    rows.values().for_each(|(row, found)| row.print(found));
    let inside: usize = rows.values().map(|(row, _)| row.inside).sum();
    let all: usize = rows.values().map(|(row, _)| row.count).sum();
    println!(
        "{inside} of {all} inside their intervals; {:.1} s of the processor each",
        (processor() - begin) / count.max(1) as f64
    );
    Ok(())
}
