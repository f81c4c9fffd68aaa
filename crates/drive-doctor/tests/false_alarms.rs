//! Asserts that relaxation, downforce and inertia are no errors of a log, and that of one late channel not all others are early.

use drive_doctor::examine_log;

use crate::clean_drive::{CARS, Manner, clean};
use crate::mistake;

/// The car of that name, and a seed of its own.
fn recording(name: &str, seed: u64) -> (preparation::Drive, drive_doctor::CarData) {
    let car = CARS.iter().find(|car| car.name == name).expect("a car of the list");
    let (log, known) = clean(car, Manner::USUAL, seed);
    (log, drive_doctor::CarData { aero: None, ..known })
}

/// Before tires competed, each of these logs had a scale or a delay of the steering.
#[test]
fn what_tires_do_is_no_error_of_steering() {
    for name in ["formula", "saloon", "van", "ice"] {
        let (log, known) = recording(name, 77);
        let found = examine_log(&mistake::log(&log), &known);
        assert!(!found.has_serious_finding(), "{name}: {:#?}", found.findings);
    }
}

#[test]
fn the_late_channel_is_named_and_not_the_others() {
    let late = mistake::MISTAKES.iter().find(|it| it.name == "a_y 20 ms late").expect("a mistake");
    let (mut log, known) = recording("formula", 78);
    (late.make)(&mut log);
    let found = examine_log(&mistake::log(&log), &known);
    assert!(late.is_named(&found), "{:#?}", found.findings);
}
