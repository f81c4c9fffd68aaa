//! Asserts that errors of sensors that were made on purpose are recovered, in logs with the noise of a real one.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "support/drive.rs"]
mod drive;
#[path = "support/injected.rs"]
mod injected;
#[path = "../../drive-doctor/tests/support/real_log.rs"]
mod real_log;

use drive_inference::calibration::calibrate;
use drive_inference::{Drive, Error};
use injected::{Injected, TIRES, car, clean, tolerance};

#[test]
fn a_lever_a_delay_and_an_offset_are_recovered_at_once() {
    let clean = clean(&TIRES);
    for seed in 0..4 {
        let made = Injected::new(seed);
        let found = calibrate(&car(), &[made.log(&clean, seed)], &made.causes()).expect("a drive");
        for (it, truth) in found.errors.iter().zip(made.values()) {
            let off = it.value - truth;
            // The delay of an accelerometer with 1 m/s2 of noise is known to 5 ms.
            let most = tolerance(it.cause).max(2.0 * it.std);
            assert!(off.abs() < most && off.abs() < 3.0 * it.std, "seed {seed}: {it:?}, {truth}");
        }
    }
}

#[test]
fn what_is_no_drive_is_told() {
    assert!(matches!(calibrate(&car(), &[], &[]), Err(Error::NoRecording)));
    assert!(matches!(calibrate(&car(), &[Drive::default()], &[]), Err(Error::TooShort { .. })));
}
