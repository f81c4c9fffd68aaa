//! Asserts that mistakes in simulated logs are found and named, and that logs without one are left alone.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use crate::drive;
use crate::mistake;

use std::sync::LazyLock;

use drive_doctor::{Certainty, CorrectionTarget, LogExamination, examine_log};

/// Mistakes that the limits of a car hide, with the car: what else is found is seen by `cargo run --example mistakes`.
const HIDDEN: [(usize, &str); 1] = [(3, "delta +5 %")];

/// What is found in the log of each car with each mistake.
static EXAMINED: [LazyLock<Vec<LogExamination>>; 4] = [
    LazyLock::new(|| examined(0)),
    LazyLock::new(|| examined(1)),
    LazyLock::new(|| examined(2)),
    LazyLock::new(|| examined(3)),
];

fn examined(car: usize) -> Vec<LogExamination> {
    let (log, known) = mistake::clean(car, 1 + car as u64);
    let with = |mistake: &mistake::Mistake| {
        let mut wrong = log.clone();
        (mistake.make)(&mut wrong);
        examine_log(&mistake::log(&wrong), &known)
    };
    mistake::MISTAKES.iter().map(with).collect()
}

fn names_all_mistakes(car: usize) {
    for (mistake, found) in mistake::MISTAKES.iter().zip(EXAMINED[car].iter()) {
        let hidden = HIDDEN.contains(&(car, mistake.name));
        assert!(hidden || mistake.is_named(found), "car {car}, {}: {found:#?}", mistake.name);
    }
}

#[test]
fn mistakes_with_a_race_car_are_named() {
    names_all_mistakes(0);
}

#[test]
fn mistakes_with_a_light_car_are_named() {
    names_all_mistakes(1);
}

#[test]
fn mistakes_on_soft_tires_are_named() {
    names_all_mistakes(2);
}

#[test]
fn mistakes_with_a_heavy_car_are_named() {
    names_all_mistakes(3);
}

#[test]
fn logs_without_a_mistake_are_left_alone() {
    for car in 0..mistake::CARS.len() {
        for (seed, noise) in [(21, &drive::USUAL), (22, &drive::CLEAN), (23, &drive::HARSH)] {
            let limit = drive::limit(&[15.0, 25.0, 40.0], 8.0);
            for reference in [limit, drive::chirp(100.0)] {
                let (log, known) = mistake::driven(car, &reference, noise, seed);
                let found = examine_log(&mistake::log(&log), &known);
                assert!(!found.has_serious_finding(), "car {car}, seed {seed}: {found:#?}");
            }
        }
    }
}

#[test]
fn findings_say_what_to_do_and_the_worst_comes_first() {
    let (log, known) = mistake::clean(0, 5);
    let mut wrong = log.clone();
    wrong.v_x.iter_mut().for_each(|v_x| *v_x *= 3.6);
    wrong.a_y.rotate_right(3);
    let found = examine_log(&mistake::log(&wrong), &known);
    let first = &found.findings[0];
    assert_eq!((first.check.as_str(), first.sure), ("v_x_unit", Certainty::Certain));
    assert_eq!(first.correction.text, "unit = \"km/h\"");
    assert!(first.sentence.contains("`v_x` is in km/h, not m/s"), "{}", first.sentence);
    assert!(found.findings.iter().any(|it| it.check == "a_y_delay"), "{found:#?}");
    assert_eq!(found.refusing_finding(), Some(first));
    assert!(found.findings.is_sorted_by_key(|it| it.sure));
}

#[test]
fn no_log_makes_it_panic() {
    let (log, known) = mistake::clean(0, 6);
    for rows in [0, 1, 3, 20, 30, 60, 99, 300, 399, 450] {
        let found = examine_log(&mistake::log(&log.slice(2000..2000 + rows)), &known);
        assert!(!found.has_serious_finding(), "{rows} rows: {found:#?}");
        assert_eq!(found.too_short, rows < 100, "{rows} rows");
        assert!(!found.not_told.is_empty(), "{rows} rows: {found:#?}");
    }
    // At 10 and 20 Hz no relation has the rows that it needs.
    for (rate, rows) in [(5, 300), (10, 300), (10, 399)] {
        let mut slow = log.clone();
        for column in columns(&mut slow) {
            *column = column.iter().copied().step_by(rate).take(rows).collect();
        }
        let found = examine_log(&mistake::log(&slow), &known);
        assert!(
            !found.has_serious_finding() && !found.not_told.is_empty(),
            "{rate}, {rows} rows: {found:#?}"
        );
    }
    for place in 0..columns(&mut log.clone()).len() {
        for value in [f64::NAN, f64::INFINITY, 0.0, 1.0, -1e300] {
            let mut wrong = log.clone();
            columns(&mut wrong)[place].fill(value);
            examine_log(&mistake::log(&wrong), &known);
        }
    }
    for value in [f64::NAN, 0.0, 20.0] {
        let mut wrong = log.clone();
        columns(&mut wrong).into_iter().skip(1).for_each(|column| column.fill(value));
        examine_log(&mistake::log(&wrong), &known);
    }
    let mut wrong = log.clone();
    wrong.v_x.iter_mut().step_by(2).for_each(|v_x| *v_x = f64::INFINITY);
    wrong.t.reverse();
    examine_log(&mistake::log(&wrong), &known);
    examine_log(&preparation::DriveLog::default(), &known);
}

/// All columns, the time first.
fn columns(log: &mut drive_inference::Drive) -> [&mut Vec<f64>; 7] {
    let drive_inference::Drive { t, v_x, v_y, r, a_y, F_x, delta, .. } = log;
    [t, v_x, v_y, r, a_y, F_x, delta]
}

#[test]
fn three_rows_are_not_called_right() {
    let (log, known) = mistake::clean(0, 6);
    let found = examine_log(&mistake::log(&log.slice(0..3)), &known);
    let summary = found.summary().join(" ");
    assert!(summary.contains("too few rows to say that nothing is wrong"), "{summary}");
    assert!(!summary.contains("Nothing certain"), "{summary}");
}

#[test]
fn all_freezes_are_told_and_left_out() {
    let (mut log, known) = mistake::clean(0, 7);
    for from in [1000, 3000, 6000] {
        let value = log.r[from];
        log.r[from..from + 200].fill(value);
    }
    let found = examine_log(&mistake::log(&log), &known);
    let frozen = found.findings.iter().find(|it| it.check == "r_frozen").expect("a freeze");
    assert!(frozen.sentence.contains("the longest of 3 times"), "{}", frozen.sentence);
    assert_eq!(frozen.correction.text.matches("], [").count(), 3, "{frozen:#?}");
    assert_eq!(found.serious_findings().count(), 1, "{found:#?}");
}

#[test]
fn every_line_that_corrects_is_toml() {
    let mut lines = std::collections::BTreeSet::new();
    for found in [0, 3].iter().flat_map(|car: &usize| EXAMINED[*car].iter()) {
        let line = |it: &drive_doctor::LogFinding| Some((it.correction.place?, it.correction.text.clone()));
        lines.extend(found.findings.iter().filter_map(line));
    }
    for (place, line) in &lines {
        let text = match place {
            CorrectionTarget::Column => format!("it = {{ column = \"x\", {line} }}"),
            CorrectionTarget::Table => line.clone(),
            // Which title is the other's, only the file says.
            CorrectionTarget::Both => continue,
        };
        let parsed: Result<toml::Table, _> = toml::from_str(&text);
        assert!(parsed.is_ok(), "{line}: {parsed:?}");
    }
    assert!(lines.len() > 25, "{lines:#?}");
}

#[test]
fn stamps_in_ms_at_1_khz_are_told_from_a_slow_log() {
    let (log, known) = mistake::clean(0, 8);
    // 1 kHz: each row ten times, with a line between two of them.
    let fine = |column: &Vec<f64>| -> Vec<f64> {
        let between = |pair: &[f64]| {
            let (from, until) = (pair[0], pair[1]);
            (0..10).map(move |k| from + (until - from) * f64::from(k) / 10.0)
        };
        column.windows(2).flat_map(between).collect()
    };
    let mut quick = log.clone();
    columns(&mut quick).into_iter().for_each(|column| *column = fine(column));
    quick.t = (0..quick.v_x.len()).map(|k| k as f64).collect();
    let found = examine_log(&mistake::log(&quick), &known);
    assert!(found.findings.iter().any(|it| it.check == "time_unit"), "{found:#?}");
    // 1 Hz.
    let mut slow = log.clone();
    columns(&mut slow).into_iter().for_each(|column| *column = column.iter().copied().step_by(100).collect());
    let found = examine_log(&mistake::log(&slow), &known);
    assert!(found.findings.iter().all(|it| it.check != "time_unit"), "{found:#?}");
    assert!(found.findings.iter().any(|it| it.check == "slow_sampling"), "{found:#?}");
}

/// Integral of the yaw rate [rad].
fn heading(log: &drive_inference::Drive) -> Vec<f64> {
    let turn = |heading: &mut f64, r: &f64| {
        *heading += 0.01 * r;
        Some(*heading)
    };
    log.r.iter().scan(0.0, turn).collect()
}

#[test]
fn a_slope_is_told_by_a_roll_angle() {
    let (log, known) = mistake::clean(0, 9);
    let mut wrong = log.clone();
    let slope: Vec<f64> = heading(&log).iter().map(|psi| 0.06 * (psi - 0.7).cos()).collect();
    wrong.a_y.iter_mut().zip(&slope).for_each(|(a_y, slope)| *a_y += 9.80665 * slope);
    let mut with_roll = mistake::log(&wrong);
    with_roll.insert("roll", log.t.clone(), slope.iter().map(|slope| slope.asin()).collect());
    let found = examine_log(&with_roll, &known);
    let bank = found.findings.iter().find(|it| it.check == "bank").expect("a slope");
    assert!(bank.sentence.contains("by `roll`"), "{bank:#?}");
    let value = bank.value.unwrap_or_default();
    assert!((0.8..1.2).contains(&value), "{bank:#?}");
    let level = examine_log(&mistake::log(&log), &known);
    assert!(level.findings.iter().all(|it| it.check != "bank"), "{level:#?}");
    assert!(level.not_told.iter().any(|it| it.check == "bank of the road"), "{level:#?}");
}

#[test]
fn a_course_is_a_clock_for_the_yaw_rate() {
    let (log, known) = mistake::clean(0, 10);
    let slip = log.v_y.iter().zip(&log.v_x).map(|(v_y, v_x)| v_y / v_x);
    // As of GNSS: in degrees, clockwise, from 0 to 360.
    let course = heading(&log).into_iter().zip(slip).map(|(psi, slip)| -(psi + slip).to_degrees());
    let course: Vec<f64> = course.map(|course| course.rem_euclid(360.0)).collect();
    let mut right = mistake::log(&log);
    right.insert("course", log.t.clone(), course.clone());
    let found = examine_log(&right, &known);
    assert!(!found.has_serious_finding(), "{found:#?}");
    let mut wrong = log.clone();
    wrong.r.rotate_right(30);
    let mut late = mistake::log(&wrong);
    late.insert("course", log.t.clone(), course);
    let found = examine_log(&late, &known);
    let first = &found.findings[0];
    assert_eq!((first.check.as_str(), first.sure), ("r_delay", Certainty::Certain), "{found:#?}");
    let interval = first.interval.expect("an interval");
    assert!(interval[0] < 0.3 && 0.3 < interval[1], "{first:#?}");
    assert!(
        first.sentence.contains("against the lateral acceleration")
            && first.sentence.contains("against the course"),
        "{first:#?}"
    );
}
