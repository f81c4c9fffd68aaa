//! Prints what the doctor says of logs of real cars, if they are at hand: `real_logs [part of a file's name]`.

#[path = "../tests/support/cars.rs"]
mod cars;
#[path = "../tests/support/real_log.rs"]
mod real_log;

use cars::LOGS;
use drive_doctor::{LogFinding, examine_log};

fn main() {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    for it in LOGS.iter().filter(|it| it.name.contains(&wanted)) {
        let Some((log, car)) = it.read() else { continue };
        let start = std::time::Instant::now();
        let found = examine_log(&log, &car);
        println!("{} ({:.2} s)", it.name, start.elapsed().as_secs_f64());
        let place = |it: &LogFinding| it.correction.place.map_or(String::new(), |at| format!("{at:?}: "));
        for it in &found.findings {
            println!("  {:8} {:16} {}", it.sure.word(), it.check, it.sentence);
            println!("           {}{}", place(it), it.correction.text);
        }
        if let Some(it) = &found.understeer {
            println!("  {}", it.sentence);
        }
        for it in &found.rolling {
            println!("  {}", it.sentence);
        }
        for it in &found.not_told {
            println!("  not told {}: {}. {}", it.check, it.reason, it.advice);
        }
    }
}
