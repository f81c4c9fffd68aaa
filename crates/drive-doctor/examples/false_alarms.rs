//! Prints what the doctor says of logs of twelve cars without a mistake, and which mistakes it finds in them:
//! `false_alarms [logs of each car] [first seed] [part of a mistake's name; - for none]`.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../tests/support/clean_drive.rs"]
mod clean_drive;
#[path = "../../drive-inference/tests/support/drive.rs"]
mod drive;
#[path = "../tests/support/mistake.rs"]
mod mistake;

use std::time::Instant;

use clean_drive::{CARS, Manner, clean};
use drive_doctor::{Certainty, LogExamination, examine_log};

/// Very gentle to the limit; held, moved slowly, moved quickly; four rates; good to poor sensors; other tires; a vehicle bus.
/// The lists have lengths without a common divisor, so all of them meet.
fn manner(k: usize) -> Manner {
    let (effort, noise) = ([0.2, 0.35, 0.5, 0.7, 1.0][k % 5], [1.0, 2.5, 0.5][k % 3]);
    let (steering_lag, row) =
        [(0.05, 0.01), (0.0, 0.01), (0.1, 0.02), (0.1, 0.01), (0.05, 0.05), (0.0, 0.02), (0.03, 0.01)][k % 7];
    Manner { effort, steering_lag, row, noise, is_rounded: k % 4 == 3, has_other_tires: k % 2 == 1 }
}

fn names(found: &LogExamination) -> String {
    let name = |it: &drive_doctor::LogFinding| {
        format!("{} ({} {:.3})", it.check, it.sure.word(), it.value.unwrap_or_default())
    };
    found.serious_findings().map(name).collect::<Vec<_>>().join(", ")
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |usual: u64| arguments.next().and_then(|it| it.parse().ok()).unwrap_or(usual);
    let (each, first) = (number(12) as usize, number(1));
    let wanted = arguments.next().unwrap_or_default();
    let (mut levels, mut alarms, mut logs, mut milliseconds) = ([0; 3], 0, 0, 0.0);
    let mut named = vec![[0; 4]; mistake::MISTAKES.len()];
    for (place, car) in CARS.iter().enumerate() {
        for k in 0..each {
            let seed = first + (100 * place + k) as u64;
            let manner = manner(each * place + k);
            let (log, mut known) = clean(car, manner, seed);
            // Half of the cars have been in a wind tunnel.
            known.aero = known.aero.filter(|_| k % 2 == 0);
            let start = Instant::now();
            let found = examine_log(&mistake::log(&log), &known);
            milliseconds += 1e3 * start.elapsed().as_secs_f64();
            logs += 1;
            for it in &found.findings {
                levels[it.sure as usize] += 1;
            }
            let Manner { effort, steering_lag, row, noise, is_rounded, .. } = manner;
            if found.has_serious_finding() {
                alarms += 1;
                let name = car.name;
                println!(
                    "ALARM {name:12} effort {effort:4} lag {steering_lag:4} row {row:4} noise {noise:3} rounded {is_rounded:5} seed {seed}: {}",
                    names(&found)
                );
            }
            // Rows of mistakes are of 10 ms. One log in three has them.
            if row > 0.01 || k % 3 != 1 {
                continue;
            }
            let table = mistake::MISTAKES.iter().zip(&mut named).skip(1);
            for (mistake, counts) in table.filter(|(it, _)| it.name.contains(&wanted)) {
                let mut wrong = log.clone();
                (mistake.make)(&mut wrong);
                let found = examine_log(&mistake::log(&wrong), &known);
                let is_found = found.serious_findings().any(|it| mistake.checks.contains(&&*it.check));
                counts[0] += 1;
                counts[1] += usize::from(is_found);
                counts[2] += usize::from(mistake.is_named(&found));
                counts[3] += usize::from(mistake.is_of_wrong_channel(&found));
                if !wanted.is_empty() {
                    println!("  {:12} effort {effort:4} {:24} {}", car.name, mistake.name, names(&found));
                }
            }
        }
    }
    let of = |sure: Certainty| levels[sure as usize];
    println!(
        "{alarms} of {logs} clean logs with an alarm; findings: {} certain, {} likely, {} possible; {:.0} ms each",
        of(Certainty::Certain),
        of(Certainty::Likely),
        of(Certainty::Possible),
        milliseconds / logs as f64
    );
    println!("{:28} {:>5} {:>6} {:>6} {:>14}", "mistake", "logs", "found", "alone", "wrong channel");
    let made = mistake::MISTAKES.iter().zip(&named).filter(|(_, counts)| counts[0] > 0);
    for (mistake, [logs, found, alone, wrong]) in made {
        println!("{:28} {logs:5} {found:6} {alone:6} {wrong:14}", mistake.name);
    }
    let total = |place: usize| named.iter().skip(1).map(|it| it[place]).sum::<usize>();
    println!("{:28} {:5} {:6} {:6} {:14}", "all", total(0), total(1), total(2), total(3));
}
