//! Asserts that columns that stand for each other are told, that wheels are looked at, and that banked laps are recognised.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use crate::mistake;

use drive_doctor::{CarData, Certainty, CorrectionTarget, LogExamination, examine_log};
use preparation::DriveLog;

/// The log with two channels in each other's column.
fn swapped(log: &DriveLog<'static>, [a, b]: [&str; 2]) -> DriveLog<'static> {
    let mut swapped = log.clone();
    for (name, other) in [(a, b), (b, a)] {
        let signal = log.get(other).expect("a channel");
        swapped.insert(name, signal.time.to_vec(), signal.value.to_vec());
    }
    swapped
}

fn names(found: &LogExamination) -> Vec<&str> {
    found.serious_findings().map(|it| it.check.as_str()).collect()
}

#[test]
fn swapped_columns_are_named_with_those_to_write() {
    for car in [0, 3] {
        let (log, known) = mistake::clean(car, 31);
        let log = mistake::log(&log);
        for pair in [["v_y", "r"], ["v_x", "a_y"], ["v_x", "v_y"], ["r", "delta"], ["r", "a_y"]] {
            let found = examine_log(&swapped(&log, pair), &known);
            let first = &found.findings[0];
            let mut channels = first.channels.clone();
            channels.sort_unstable();
            let mut expected = pair.to_vec();
            expected.sort_unstable();
            assert_eq!(
                (first.check.as_str(), channels),
                ("swapped", expected),
                "car {car}, {pair:?}: {found:#?}"
            );
            assert_eq!(
                (first.sure, first.refuses, first.correction.place),
                (Certainty::Certain, true, Some(CorrectionTarget::Both))
            );
            assert_eq!(names(&found), ["swapped"], "car {car}, {pair:?}: {found:#?}");
        }
    }
}

/// The log with four wheels of a radius, on a track of 1.5 m.
fn with_wheels(recording: &drive_inference::Drive, per_speed: f64) -> DriveLog<'static> {
    let mut log = mistake::log(recording);
    for (name, side) in [("omega_fl", -0.75), ("omega_fr", 0.75), ("omega_rl", -0.75), ("omega_rr", 0.75)] {
        let speed = recording.v_x.iter().zip(&recording.r);
        let omega = speed.map(|(v_x, r)| per_speed * (v_x + side * r)).collect();
        log.insert(name, recording.t.clone(), omega);
    }
    log
}

#[test]
fn wheels_of_the_wrong_side_and_unit_are_named() {
    let (recording, known) = mistake::clean(0, 32);
    let right = with_wheels(&recording, 1.0 / 0.31);
    let found = examine_log(&right, &known);
    assert!(!found.has_serious_finding(), "{found:#?}");
    let found = examine_log(&swapped(&right, ["omega_rl", "omega_rr"]), &known);
    assert_eq!(names(&found), ["swapped"], "{found:#?}");
    assert_eq!(found.findings[0].channels, ["omega_rl", "omega_rr"]);
    let rpm = with_wheels(&recording, 30.0 / std::f64::consts::PI / 0.31);
    let found = examine_log(&rpm, &known);
    assert_eq!(names(&found), ["omega_unit"], "{found:#?}");
    assert_eq!(found.findings[0].channels, ["omega_fl", "omega_fr", "omega_rl", "omega_rr"]);
    assert_eq!(found.findings[0].sure, Certainty::Certain);
    let mut one = right.clone();
    let wheel = right.get("omega_rl").expect("a wheel");
    one.insert("omega_rl", wheel.time.to_vec(), wheel.value.iter().map(|it| -it).collect());
    let found = examine_log(&one, &known);
    assert_eq!(names(&found), ["omega_rl_sign"], "{found:#?}");
    // In km/h they read as on tires of 0.278 m, which a car may have.
    let found = examine_log(&with_wheels(&recording, 3.6), &known);
    assert!(!found.has_serious_finding(), "{found:#?}");
    let possible = found.findings.iter().find(|it| it.check == "omega_fl_unit").expect("a finding");
    assert!(possible.sentence.contains("may be in km/h"), "{possible:#?}");
}

#[test]
fn a_bank_that_comes_again_each_lap_is_told_without_a_roll_angle() {
    let (recording, known) = mistake::clean(0, 33);
    let found = examine_log(&mistake::log(&recording), &known);
    assert!(found.findings.iter().all(|it| it.check != "bank"), "{found:#?}");
    // Something that wanders, without laps.
    let mut wanders = recording.clone();
    wanders.a_y.iter_mut().enumerate().for_each(|(k, a_y)| *a_y += 0.5 * (0.004 * k as f64).sin());
    let found = examine_log(&mistake::log(&wanders), &known);
    let bank = found.findings.iter().find(|it| it.check == "bank").expect("a finding");
    assert_eq!(bank.sure, Certainty::Possible, "{bank:#?}");
    assert!(bank.sentence.contains("something slow"), "{bank:#?}");
}

/// A linear single track at 20 m/s that is steered by a sine, at 100 Hz: v_y, r, a_x, a_y, delta.
fn at_constant_speed() -> DriveLog<'static> {
    let (v_x, m, I_zz, l_f, l_r, C) = (20.0, 1200.0, 1800.0, 1.2, 1.4, 8e4);
    let step = 0.01;
    let (mut v_y, mut r) = (0.0, 0.0);
    let mut columns = vec![Vec::new(); 6];
    for k in 0..3000 {
        let delta = 0.05 * (0.013 * f64::from(k)).sin();
        let front = -C * ((v_y + l_f * r) / v_x - delta);
        let rear = -C * ((v_y - l_r * r) / v_x);
        let a_y = (front + rear) / m;
        let row = [v_x, v_y, r, -v_y * r, a_y, delta];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        v_y += step * (a_y - v_x * r);
        r += step * (l_f * front - l_r * rear) / I_zz;
    }
    let time: Vec<f64> = (0..3000).map(|k| step * f64::from(k)).collect();
    let mut log = DriveLog::default();
    for (name, column) in ["v_x", "v_y", "r", "a_x", "a_y", "delta"].into_iter().zip(columns) {
        log.insert(name, time.clone(), column);
    }
    log
}

#[test]
fn a_speed_that_is_held_is_no_dead_channel() {
    let found = examine_log(&at_constant_speed(), &CarData::default());
    assert!(!found.has_serious_finding(), "{found:#?}");
    let held = found.findings.iter().find(|it| it.check == "v_x_constant").expect("a finding");
    assert_eq!((held.sure, held.refuses), (Certainty::Possible, false));
    // Without the channels that agree nobody knows.
    let mut bare = at_constant_speed();
    bare.remove("a_y");
    let found = examine_log(&bare, &CarData::default());
    assert_eq!(found.findings[0].check, "v_x_dead", "{found:#?}");
}

/// What is not known of the car must not be made up for by an error of the steering.
#[test]
fn a_clean_log_is_not_accused_where_less_is_known_of_the_car() {
    for car in 0..mistake::CARS.len() {
        let (log, known) = mistake::clean(car, 34);
        for wheelbase in [None, known.wheelbase()] {
            let found = examine_log(&mistake::log(&log), &CarData { wheelbase, ..CarData::default() });
            assert!(!found.has_serious_finding(), "car {car}, {wheelbase:?}: {found:#?}");
        }
    }
}
