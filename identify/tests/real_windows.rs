//! Asserts what is said of parts of the logs of real cars, if the recordings are at hand.

use crate::windows::{Log, Tally};
use identify::config::stretches::DriftConfig;
use identify::stretches;
use tire_inference::axles::Axle;
use tire_inference::drift::DriftVerdict;

#[test]
#[ignore = "needs logs of real cars"]
fn ten_seconds_seldom_tell_the_curve_and_say_so() {
    for (log, least) in [(Log::of_250lm(), 0), (Log::of_dart("dart_free_fast.csv"), 10)] {
        let log = log.expect("a log of TRACKSIDE_DATA");
        let tally = Tally::of(&log, 100, 10.0, 1);
        assert_eq!(tally.windows, 100);
        let claims = Axle::ALL.map(|axle| tally.claims(axle, 0.05));
        let [made, hold] = [0, 1].map(|it| claims[0][it] + claims[1][it]);
        assert!(made >= least && made - hold <= 1, "{}: {hold} of {made} claims hold", log.name);
        assert!(made < 150, "{}: {made} of 200 curves cannot be known", log.name);
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn the_stiffness_of_the_250lm_drifts_as_its_halves_say() {
    let log = Log::of_250lm().expect("a log of TRACKSIDE_DATA");
    let prepared = log.pipeline.prepare(&log.recording).expect("points");
    let told = |length: f64| {
        let config = DriftConfig { length, ..DriftConfig::default() };
        stretches::estimate_drift(&config, |_| None, &prepared, &log.pipeline)
    };
    for length in [10.0, 15.0, 20.0, 30.0] {
        for it in told(length) {
            println!("{length} s, ratio {:.1}: {}", it.drift.likelihood_ratio, it.sentence);
        }
    }
    let told = told(20.0);
    let of = |axle: &str, quantity: &str| {
        let mut found = told.iter().filter(|it| it.axle == axle && it.quantity == quantity);
        found.next().expect("four quantities")
    };
    // It is told with stretches of 20 s only, just above the limit: docs/methods/stretches.md.
    let rear = of("rear", "K");
    assert_eq!(rear.drift.verdict, DriftVerdict::Drifts, "{}", rear.sentence);
    // Halves of the log, fitted apart by shooting, have 125 and 107 kN/rad.
    let [_, low, high] = rear.drift.change.expect("a change");
    assert!((low..=high).contains(&(107.0 / 125.0 - 1.0)), "{}", rear.sentence);
    assert!(rear.sentence.contains("No constant describes it"), "{}", rear.sentence);
}

#[test]
#[ignore = "needs logs of real cars"]
fn laps_are_stretches() {
    let log = Log::of_250lm().expect("a log of TRACKSIDE_DATA");
    let prepared = log.pipeline.prepare(&log.recording).expect("points");
    let series = &prepared.rear.lateral.series;
    let begin = series.time[0];
    // Laps of 20 s, so that they are the stretches of that length.
    let number = |time: &f64| ((time - begin) / 20.0).floor();
    let lap: Vec<f64> = series.time.iter().map(number).collect();
    let signal = |name: &str| (name == "lap").then_some([&series.time[..], &lap[..]]);
    let told = |laps: bool| {
        let config = DriftConfig { length: 20.0, laps };
        let told = stretches::estimate_drift(&config, signal, &prepared, &log.pipeline);
        let rear = told.into_iter().find(|it| it.axle == "rear" && it.quantity == "K");
        rear.expect("a drift").drift
    };
    let [by_time, by_lap] = [false, true].map(told);
    assert_eq!(by_lap.stretches[3].lap, Some(3.0));
    // What is left at the end is a lap, but not a stretch.
    assert!((by_time.stretches.len()..=by_time.stretches.len() + 1).contains(&by_lap.stretches.len()));
    let [alone, other] = [&by_time, &by_lap].map(|it| it.stretches[3].alone);
    assert!((alone / other - 1.0).abs() < 1e-3, "{alone} and {other}");
    println!("by time {:.1}, by lap {:.1}", by_time.likelihood_ratio, by_lap.likelihood_ratio);
}
