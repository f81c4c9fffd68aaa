//! Makes mistakes in simulated logs on purpose and prints what the doctor finds: `mistakes [part of a name]`.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../../drive-inference/tests/support/drive.rs"]
mod drive;
#[path = "../tests/support/mistake.rs"]
mod mistake;

use drive_doctor::{LogFinding, examine_log};

fn main() {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let chosen = || mistake::MISTAKES.iter().filter(|it| it.name.contains(&wanted));
    let (mut right, mut all, mut seconds) = (0, 0, 0.0);
    for car in 0..mistake::CARS.len() {
        let (log, known) = mistake::clean(car, 1 + car as u64);
        println!("{} kg", known.m.unwrap_or_default());
        for mistake in chosen() {
            let mut wrong = log.clone();
            (mistake.make)(&mut wrong);
            let wrong = mistake::log(&wrong);
            let start = std::time::Instant::now();
            let found = examine_log(&wrong, &known);
            seconds += start.elapsed().as_secs_f64();
            let name = |it: &LogFinding| format!("{} ({})", it.check, it.sure.word());
            let serious = found.serious_findings();
            let named = mistake.is_named(&found);
            (right, all) = (right + u32::from(named), all + 1);
            let names = serious.map(name).collect::<Vec<_>>().join(", ");
            println!("  {:28} {:6} {names}", mistake.name, if named { "right" } else { "WRONG" });
            if !wanted.is_empty() {
                found
                    .findings
                    .iter()
                    .for_each(|it| println!("    {}\n      {}", it.sentence, it.correction.text));
                found.not_told.iter().for_each(|it| println!("    not told: {}: {}", it.check, it.reason));
            }
        }
    }
    let each = 1e3 * seconds / f64::from(all);
    println!("{right} of {all} named right; {each:.0} ms each");
}
