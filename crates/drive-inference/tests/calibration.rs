//! Asserts that errors of sensors that were made on purpose are recovered, in logs with the noise of a real one.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use drive_inference::calibration::{assess_sensor_errors, calibrate_sensors};
use drive_inference::{Drive, DriveError, Error};
use preparation::SystematicError;

use crate::injected::{Injected, TIRES, car, clean, tolerance};
use tire_inference::verdict::Identifiability;

#[test]
fn a_lever_a_delay_and_an_offset_are_recovered_at_once() {
    let clean = clean(&TIRES);
    for seed in 0..2 {
        let made = Injected::new(seed);
        let found = calibrate_sensors(&car(), &[made.log(&clean, seed)], &made.causes()).expect("a drive");
        for (it, truth) in found.errors.iter().zip(made.values()) {
            let off = it.value - truth;
            // The delay of an accelerometer with 1 m/s2 of noise is known to 5 ms.
            let most = tolerance(it.cause).max(2.0 * it.std);
            assert!(off.abs() < most && off.abs() < 3.0 * it.std, "seed {seed}: {it:?}, {truth}");
        }
    }
}

#[test]
fn verdicts_ask_for_both_sides_and_for_halves_that_agree() {
    let clean = clean(&TIRES);
    let made = Injected::new(1);
    let log = made.log(&clean, 1);
    let wanted = [SystematicError::SteeringOffset, SystematicError::SideslipLever];
    let said = |drive: &Drive| {
        let found = assess_sensor_errors(&car(), std::slice::from_ref(drive), &wanted).expect("a drive");
        found.into_iter().map(|it| (it.verdict, it.reason)).collect::<Vec<_>>()
    };
    let whole = said(&log);
    assert_eq!(whole[0].0, Identifiability::Identified, "{}", whole[0].1);
    // Nothing else measures where the sensor of v_y is.
    assert_eq!(whole[1].0, Identifiability::Weak, "{}", whole[1].1);
    assert!(whole[1].1.contains("with a tape"), "{}", whole[1].1);

    let mut moved = log.clone();
    let half = moved.len() / 2;
    for k in half..moved.len() {
        moved.v_y[k] -= 1.0 * moved.r[k];
        moved.delta[k] += 0.02;
    }
    for (verdict, reason) in said(&moved) {
        assert_eq!(verdict, Identifiability::NotIdentifiable, "{reason}");
        assert!(reason.contains("halves of the drive disagree"), "{reason}");
    }

    let left: Vec<usize> = (0..log.len()).filter(|k| log.a_y[*k] > 0.0).collect();
    let mut left = log.select_rows(&left);
    let time: Vec<f64> = (0..left.len()).map(|k| log.t[k]).collect();
    left.t = time;
    for (verdict, reason) in said(&left) {
        assert_eq!(verdict, Identifiability::NotIdentifiable, "{reason}");
        assert!(reason.contains("turns to one side"), "{reason}");
    }
}

#[test]
fn what_is_no_drive_is_told() {
    assert!(matches!(calibrate_sensors(&car(), &[], &[]), Err(Error::NoRecording)));
    assert!(matches!(
        calibrate_sensors(&car(), &[Drive::default()], &[]),
        Err(Error::Drive { source: DriveError::TooShort { .. }, .. })
    ));
}
