//! Prints how far the tires of parts of one log scatter, over what their intervals say: `cargo run -p identify --example drift_250lm
//! [-- --parts N] [--seconds S] [--task tires|closed_loop] [--details]`.
//!
//! The recording is described in docs/identification_tasks.md. The car is taken as known exactly, since its errors are the same in all parts.

#[path = "../tests/support/log_250lm.rs"]
mod log_250lm;
#[path = "../../crates/drive-inference/tests/support/processor.rs"]
mod processor;
#[path = "../../crates/drive-doctor/tests/support/real_log.rs"]
mod real_log;

use log_250lm::{Log, by_drive, by_points, closed_loop, tires};
use processor::processor;
use tire_inference::axles::{Axle, Axles};
use tire_inference::estimate::TireEstimate;
use tire_inference::quantity::Quantity;

const EXACT: &str = "exact = true";

/// Root mean square of the distances from the weighted mean, over their standard deviations; degrees of freedom corrected.
fn scatter(found: &[(f64, f64)]) -> (f64, f64) {
    let weight = |(_, std): &(f64, f64)| std.powi(-2);
    let all: f64 = found.iter().map(weight).sum();
    let mean = found.iter().map(|it| weight(it) * it.0).sum::<f64>() / all;
    let squares: f64 = found.iter().map(|(value, std)| ((value - mean) / std).powi(2)).sum();
    (mean, (squares / (found.len() as f64 - 1.0)).sqrt())
}

fn number(args: &[String], name: &str, usual: f64) -> f64 {
    let place = args.iter().position(|it| it == name);
    place.and_then(|it| args.get(it + 1)?.parse().ok()).unwrap_or(usual)
}

fn main() {
    let Some(log) = Log::read() else { return };
    let args: Vec<String> = std::env::args().collect();
    let (parts, seconds) = (number(&args, "--parts", 9.0), number(&args, "--seconds", 36.0));
    let details = args.iter().any(|it| it == "--details");
    let driven = closed_loop("", &format!("{EXACT}\nF_x_gain_std = 0.0"));
    let logged = tires("", EXACT);
    for task in ["tires", "closed_loop"] {
        if args.iter().any(|it| it == "--task") && !args.iter().any(|it| it == task) {
            continue;
        }
        let mut all: Vec<Axles<TireEstimate>> = Vec::new();
        for part in 0..parts as usize {
            let window = [part as f64, part as f64 + 1.0].map(|it| it * seconds);
            let begin = processor();
            let estimates = match task {
                "tires" => by_points(&logged, &log.signals(window)),
                _ => {
                    let found = by_drive(&driven, &log.drive(window));
                    if details {
                        println!("{}", found.model.sentence);
                        found.causes.iter().for_each(|it| println!("    {}", it.sentence));
                    }
                    found.estimates
                }
            };
            let told = |axle: Axle, name: Quantity| {
                let estimate = &estimates[axle];
                let (value, std) = (estimate.mean[&name], estimate.std[&name]);
                format!("{value:8.3} ± {std:6.3} {:15}", format!("{:?}", estimate.identified[&name]))
            };
            println!(
                "{task:11} {:5.0} … {:5.0} s   front K {} D {}   rear K {} D {}   {:.0} s of processor",
                window[0],
                window[1],
                told(Axle::Front, Quantity::K),
                told(Axle::Front, Quantity::D),
                told(Axle::Rear, Quantity::K),
                told(Axle::Rear, Quantity::D),
                processor() - begin
            );
            all.push(estimates);
        }
        for (axle, side) in [(Axle::Front, "front"), (Axle::Rear, "rear")] {
            for name in [Quantity::K, Quantity::D] {
                let of = |it: &Axles<TireEstimate>| (it[axle].mean[&name], it[axle].std[&name]);
                let (mean, scatter) = scatter(&all.iter().map(of).collect::<Vec<_>>());
                println!("{task:11} {side:5} {name}: mean {mean:.3}, scatter over std {scatter:.2}");
            }
        }
    }
}
