//! Prints how often random windows of real logs tell the curves of their axles, and how many of the claims hold:
//! `TRACKSIDE_DATA=FOLDER cargo run --release -p identify --example windows [-- --count N] [--length SECONDS]`.

#[path = "../../crates/drive-doctor/tests/support/real_log.rs"]
mod real_log;
#[path = "../tests/support/windows.rs"]
mod windows;

use numerics::statistics::quantile;
use tire_inference::axles::Axle;
use windows::{Log, Tally};

fn number(args: &[String], name: &str, usual: f64) -> f64 {
    let place = args.iter().position(|it| it == name);
    place.and_then(|it| args.get(it + 1)?.parse().ok()).unwrap_or(usual)
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let (count, length) = (number(&args, "--count", 1000.0), number(&args, "--length", 10.0));
    let dart = ["dart_free_moderate.csv", "dart_free_fast.csv"].map(Log::of_dart);
    for log in std::iter::once(Log::of_250lm()).chain(dart).flatten() {
        let mut tally = Tally::of(&log, count as usize, length, 1);
        tally.seconds.sort_by(f64::total_cmp);
        let [median, most] = [0.5, 0.99].map(|share| 1e3 * quantile(&tally.seconds, share));
        println!(
            "{}: {} windows of {length} s, {median:.1} ms, 99 % within {most:.1} ms",
            log.name, tally.windows
        );
        for axle in Axle::ALL {
            let [claims, right] = tally.claims(axle, 0.05);
            let errors = &tally.errors[axle];
            let within = errors.iter().filter(|(error, _)| *error <= 0.05).count();
            let claimed = errors.iter().filter(|(_, claimed)| *claimed);
            let worst = claimed.map(|(error, _)| 100.0 * error).fold(0.0, f64::max);
            println!(
                "  {:5} {claims} claims, {right} of them within 5 %, the worst {worst:.1} %; of all {} curves {within} are",
                format!("{axle:?}"),
                errors.len()
            );
        }
    }
}
