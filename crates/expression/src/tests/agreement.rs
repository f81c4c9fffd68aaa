//! Checks conditions on how whole signals agree: ratings and corridors, with their units and places.

use super::*;

/// Judges a condition over samples of `a.x`, `a.y`, `b.x` and `plant.tyre.f[1,2]`, 0.1 s apart.
fn judged(text: &str, units: &[(&str, &str)], row: fn(f64) -> [f64; 4], samples: u32) -> ConditionOutcome {
    let expression = parse_in(text, units).unwrap_or_else(|error| panic!("{text}: {error:?}"));
    let mut monitor = ConditionMonitor::new(expression, 0.0);
    for k in 0..samples {
        let time = 0.1 * f64::from(k);
        assert_eq!(monitor.push_sample(time, &TestedRow(&row(time), &[])), None);
    }
    assert_eq!(
        monitor.comparison_trace().points().len(),
        0,
        "a deviation has no place in a picture of a signal"
    );
    monitor.outcome()
}

/// The value that a condition on it finds.
fn found(text: &str, row: fn(f64) -> [f64; 4]) -> f64 {
    judged(&format!("{text} > 0.5"), &[], row, 200).value.expect("a value")
}

/// A sine, one that is late and larger, and two other units of the first one.
fn sines(time: f64) -> [f64; 4] {
    let sine = time.sin();
    [1.1 * (time - 0.3).sin(), sine, 3.6 * sine, 0.0]
}

#[test]
fn ratings_are_those_of_the_standard() {
    let series = |place: usize| (0..200).map(|k| sines(0.1 * f64::from(k))[place]).collect::<Vec<_>>();
    let expected = rating::rate_signal(&series(1), &series(0), 0.1).expect("a rating");
    for (part, score) in [
        ("rating", expected.overall),
        ("rating_corridor", expected.corridor),
        ("rating_phase", expected.phase),
        ("rating_magnitude", expected.magnitude),
        ("rating_slope", expected.slope),
    ] {
        assert_eq!(found(&format!("{part}(a.x, a.y)"), sines), score, "{part}");
        assert!(score > 0.0 && score < 1.0, "{part}: {score}");
    }
    // 3 of at most 40 samples.
    assert!((expected.phase - 37.0 / 40.0).abs() < 1e-12);
    assert_eq!(found("rating(a.x - a.x, a.y - a.y)", sines), 1.0);
    assert!(found("rating(a.y, a.x)", sines) != expected.overall, "the reference is the second one");
}

#[test]
fn a_rating_compares_in_one_unit_and_has_none() {
    let units = [("a.y", "m/s"), ("b.x", "km/h")];
    let outcome = judged("rating(b.x, a.y) > 0.94", &units, sines, 200);
    assert!(outcome.passed && outcome.value > Some(0.999_999), "{outcome:?}");
    assert_eq!(outcome.at, None);
    let of = |text: &str| parse_in(text, &[("a.x", "m"), ("a.y", "degC"), ("b.x", "m/s")]);
    assert_eq!(of("rating(a.x, a.x) > 0.8").expect("a condition").compared_unit(), None);
    for text in ["rating(a.x, b.x) > 0", "rating(a.y, a.y) > 0", "rating(a.x, a.x) > 1 m"] {
        assert!(of(text).is_err(), "{text}");
    }
}

#[test]
fn what_cannot_be_rated_fails_and_is_not_a_number() {
    for (row, samples) in [
        (sines as fn(f64) -> [f64; 4], 10),
        (|_| [f64::INFINITY, 1.0, 0.0, 0.0], 50),
        (|time| [1.0, if time > 1.05 { f64::NAN } else { 1.0 }, 0.0, 0.0], 50),
    ] {
        for text in ["rating(a.x, a.y) > 0", "rating(a.x, a.y) < 2"] {
            let outcome = judged(text, &[], row, samples);
            assert!(!outcome.passed && outcome.nan, "{text} {outcome:?}");
        }
    }
    let missing = judged(
        "rating(a.x, a.y) < 2",
        &[],
        |time| [1.0, if time > 1.05 { f64::NAN } else { 1.0 }, 0.0, 0.0],
        50,
    );
    assert!((missing.at.expect("a time") - 1.1).abs() < 1e-9);
}

/// Along y = 2 x the curve leaves its reference by 0.4 from 2 s on, at 3 s by 1.2. The reference is 0.03 s ahead on the line.
fn curves(time: f64) -> [f64; 4] {
    let leaves = if (time - 3.0).abs() < 1e-9 { 1.2 } else { 0.4 };
    [time, 2.0 * time + if time > 1.95 { leaves } else { 0.0 }, time + 0.03, 2.0 * (time + 0.03)]
}

const CORRIDOR: &str = "(a.x, a.y, b.x, plant.tyre.f[1,2], 0.05, 0.1) ";

#[test]
fn a_corridor_tells_the_worst_place_and_the_share() {
    // The edge of the line is at dy + 2 dx = 0.2. A lead along the curve is no deviation, but before its begin.
    let outcome = judged(&format!("corridor{CORRIDOR} <= 1"), &[], curves, 40);
    assert!(!outcome.passed && (outcome.value.expect("a value") - 6.0).abs() < 1e-9, "{outcome:?}");
    assert!((outcome.at.expect("a time") - 3.0).abs() < 1e-9 && outcome.limit == Some(1.0));
    let outcome = judged(&format!("corridor{CORRIDOR} <= 1"), &[], curves, 20);
    assert!(outcome.passed && (outcome.value.expect("a value") - 0.6).abs() < 1e-9, "{outcome:?}");
    assert_eq!(outcome.at, Some(0.0));
    let share = judged(&format!("corridor_share{CORRIDOR} > 0.9"), &[], curves, 40);
    assert_eq!((share.passed, share.value), (false, Some(0.5)));
    assert!((share.at.expect("the first place outside") - 2.0).abs() < 1e-9);
}

#[test]
fn tolerances_of_a_corridor_have_units_and_grow_with_the_reference() {
    let units = [("a.x", "m/s2"), ("a.y", "rad"), ("b.x", "g0"), ("plant.tyre.f[1,2]", "deg")];
    // A level curve at 60 degrees, 7.5 below which the corridor ends: 5 deg + 3 % are 6.8, and the simulation is at 1 rad.
    let row = |time: f64| [time, 1.0, time / 9.806_65, 60.0];
    let dx = "0.1 m/s2 + 0.06 * abs(b.x)";
    let dy = "5 deg + 0.03 * abs(plant.tyre.f[1,2])";
    let text = format!("corridor(a.x, a.y,\n  b.x, plant.tyre.f[1,2], {dx}, {dy}) <= 1");
    let outcome = judged(&text, &units, row, 50);
    let expected = (60.0 - 1_f64.to_degrees()) / 6.8;
    assert!((outcome.value.expect("a value") - expected).abs() < 1e-9, "{outcome:?} {expected}");
    // A number takes the unit of the curve.
    let plain = "corridor(a.x, a.y, b.x, plant.tyre.f[1,2], 0.1, 0.01) <= 1";
    let value = judged(plain, &units, row, 50).value.expect("a value");
    assert!((value - (60_f64.to_radians() - 1.0) / 0.01).abs() < 1e-9, "{value}");
    let wrong = "corridor(a.x, a.y, b.x, plant.tyre.f[1,2], 5 deg, 5 deg) <= 1";
    let error = parse_in(wrong, &units).expect_err(wrong);
    assert!(error.message.contains("they cannot be x of one curve"), "{error:?}");
}

/// At 8 m/s2 the log is at 84 deg and the simulation at 80 deg, whose tolerance is 5 deg + 3 %.
#[test]
fn a_log_is_judged_by_the_band_of_a_simulation_at_other_times() {
    let units = [("a.x", "m/s2"), ("a.y", "deg"), ("b.x", "g0"), ("plant.tyre.f[1,2]", "rad")];
    let row = |time: f64| {
        let simulated = (2.0 * time).min(4.0);
        [2.0 * time, 21.0 * time, 2.0 * simulated / 9.806_65, (20.0 * simulated).to_radians()]
    };
    let text = "corridor(a.x, a.y, b.x, plant.tyre.f[1,2], 0.1 m/s2 + 0.06 * abs(b.x), 5 deg + 0.03 * abs(plant.tyre.f[1,2])) <= 1";
    let outcome = judged(text, &units, row, 41);
    assert!(outcome.passed && (outcome.value.expect("a value") - 4.0 / 7.4).abs() < 1e-9, "{outcome:?}");
    assert_eq!(outcome.at, Some(4.0));
}

#[test]
fn a_corridor_without_a_width_is_one_and_a_negative_one_is_not() {
    let same = |text: &str| judged(text, &[], |time| [time, time * time, 0.0, 0.0], 30);
    assert!(same("corridor(a.x, a.y, a.x, a.y, 0, 0) == 0").passed);
    let outcome = same("corridor(a.x, a.y, a.x, a.y, 1, -1) < 9");
    assert!(!outcome.passed && outcome.nan, "{outcome:?}");
}
