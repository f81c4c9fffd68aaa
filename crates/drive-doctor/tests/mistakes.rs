//! Asserts that mistakes in simulated logs are found and named, and that logs without one are left alone.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../../drive-inference/tests/support/drive.rs"]
mod drive;
#[path = "support/mistake.rs"]
mod mistake;

use drive_doctor::{Sure, examine};

/// Mistakes that the limits of a car hide, with the car: what else is found is seen by `cargo run --example mistakes`.
const HIDDEN: [(usize, &str); 3] =
    [(1, "r 20 ms late"), (3, "delta +5 %"), (3, "delta 30 ms late")];

fn names_all_mistakes(car: usize) {
    let (log, known) = mistake::clean(car, 1 + car as u64);
    for mistake in &mistake::MISTAKES {
        let mut wrong = log.clone();
        (mistake.make)(&mut wrong);
        let found = examine(&mistake::log(&wrong), &known);
        let hidden = HIDDEN.contains(&(car, mistake.name));
        assert!(hidden || mistake.is_named(&found), "car {car}, {}: {found:#?}", mistake.name);
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
                let found = examine(&mistake::log(&log), &known);
                assert!(!found.is_ill(), "car {car}, seed {seed}: {found:#?}");
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
    let found = examine(&mistake::log(&wrong), &known);
    let first = &found.findings[0];
    assert_eq!((first.check.as_str(), first.sure), ("v_x_unit", Sure::Certain));
    assert_eq!(first.correction, "unit = \"km/h\"");
    assert!(first.sentence.contains("`v_x` is in km/h, not m/s"), "{}", first.sentence);
    assert!(found.findings.iter().any(|it| it.check == "a_y_delay"), "{found:#?}");
    assert_eq!(found.refusal(), Some(first));
    assert!(found.findings.is_sorted_by_key(|it| it.sure));
}

#[test]
fn no_log_makes_it_panic() {
    let (log, known) = mistake::clean(0, 6);
    for rows in [0, 1, 3, 20, 60] {
        let found = examine(&mistake::log(&log.slice(0..rows)), &known);
        assert!(found.refusal().is_none(), "{found:#?}");
    }
    let mut wrong = log.clone();
    wrong.t.iter_mut().for_each(|t| *t = f64::NAN);
    examine(&mistake::log(&wrong), &known);
    wrong.t.iter_mut().for_each(|t| *t = 1.0);
    examine(&mistake::log(&wrong), &known);
    let mut wrong = log.clone();
    wrong.v_x.iter_mut().step_by(2).for_each(|v_x| *v_x = f64::INFINITY);
    wrong.t.reverse();
    examine(&mistake::log(&wrong), &known);
    examine(&preparation::DriveLog::default(), &known);
}
