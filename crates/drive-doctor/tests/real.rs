//! Asserts what is found in logs of real cars, if they are at hand; `TRACKSIDE_DATA` names another folder to look in.

#[path = "support/real_log.rs"]
mod real_log;

use drive_doctor::{Examination, KnownCar, Sure, examine};
use preparation::DriveLog;
use real_log::RealLog;

/// The examination of a file: the column of the time, then names and columns.
fn of(
    file: &str,
    time: &str,
    columns: &[(&str, &str, f64)],
    axles: [f64; 2],
) -> Option<Examination> {
    let recording = RealLog::read(file)?;
    let mut log = DriveLog::default();
    for (name, title, factor) in columns {
        log.insert(name, recording.column(time, 1.0), recording.column(title, *factor));
    }
    Some(examine(&log, &KnownCar { axles: Some(axles), ..KnownCar::default() }))
}

const LM: [(&str, &str, f64); 6] = [
    ("v_x", "vx_mps", 1.0),
    ("v_y", "vy_mps", 1.0),
    ("r", "yaw_rate_radps", 1.0),
    ("a_x", "ax_mps2", 1.0),
    ("a_y", "ay_mps2", 1.0),
    ("delta", "delta_rad", 1.0),
];
/// Speeds of wheels in km/h over a radius of 0.3 m.
const WHEEL: f64 = 1.0 / 3.6 / 0.3;
const AV21: [(&str, &str, f64); 9] = [
    ("v_x", "vx(m/s)", 1.0),
    ("v_y", "vy(m/s)", 1.0),
    ("r", "omega(rad/s)", 1.0),
    ("a_x", "ax(m/s^2)", 1.0),
    ("delta", "delta(rad)", 1.0),
    ("omega_fl", "wheel_fl(kmph)", WHEEL),
    ("omega_fr", "wheel_fr(kmph)", WHEEL),
    ("omega_rl", "wheel_rl(kmph)", WHEEL),
    ("omega_rr", "wheel_rr(kmph)", WHEEL),
];
const DART: [(&str, &str, f64); 5] = [
    ("v_x", "v_x", 1.0),
    ("v_y", "v_y", 1.0),
    ("r", "yaw_rate_imu", 1.0),
    ("a_y", "a_y", 1.0),
    ("delta", "steering_angle_rad", 1.0),
];

#[test]
fn no_unit_of_the_250_lm_is_doubted() {
    let Some(found) = of("revs_250lm.csv", "t_s", &LM, [1.33, 1.07]) else { return };
    assert!(found.refusal().is_none(), "{found:#?}");
    let names: Vec<&str> = found.findings.iter().map(|it| it.check.as_str()).collect();
    assert!(
        !names.iter().any(|name| name.ends_with("_unit") || name.ends_with("_sign")),
        "{names:?}"
    );
    assert!(names.contains(&"a_y_held") && names.contains(&"r_held"), "{names:?}");
}

#[test]
fn the_bank_of_the_track_comes_again_lap_by_lap() {
    let Some(found) = of("revs_250lm.csv", "t_s", &LM, [1.33, 1.07]) else { return };
    let bank = found.findings.iter().find(|it| it.check == "bank").expect("a bank");
    assert_eq!(bank.sure, Sure::Likely, "{bank:#?}");
    // In the mean over three laps it is up to 0.34 m/s2.
    let most = bank.value.unwrap_or_default();
    assert!((0.25..0.45).contains(&most), "{bank:#?}");
    assert!(bank.sentence.contains("each lap of 31"), "{bank:#?}");
}

#[test]
fn the_late_yaw_rate_of_the_av_21_is_named_by_two_clocks() {
    let Some(found) = of("av21_putnam_park.csv", "time(s)", &AV21, [1.248, 1.7328]) else { return };
    let first = &found.findings[0];
    assert_eq!((first.check.as_str(), first.sure, first.refuses), ("r_delay", Sure::Certain, true));
    let late = first.value.unwrap_or_default();
    assert!((0.26..0.40).contains(&late), "{first:#?}");
    let without_wheels = of("av21_putnam_park.csv", "time(s)", &AV21[..5], [1.248, 1.7328]);
    let found = without_wheels.unwrap_or_default();
    assert!(
        found.findings.iter().any(|it| it.check == "r_delay" && it.sure == Sure::Certain),
        "{found:#?}"
    );
}

#[test]
fn the_gyro_of_dart_reads_too_much() {
    let Some(found) = of("dart_free_moderate.csv", "time_s", &DART, [0.0805, 0.093]) else {
        return;
    };
    let scale = found.findings.iter().find(|it| it.check == "r_scale").expect("a scale");
    // Against motion capture it is 1.028 (1.023 to 1.033).
    let value = scale.value.unwrap_or_default();
    assert!((0.015..0.035).contains(&value), "{scale:#?}");
}

#[test]
fn circles_tell_neither_clocks_nor_offsets() {
    let Some(found) = of("dart_circles_rubber_left.csv", "time_s", &DART, [0.0805, 0.093]) else {
        return;
    };
    assert!(found.not_told.iter().any(|it| it.check.starts_with("clocks")), "{found:#?}");
    assert!(
        !found
            .findings
            .iter()
            .any(|it| it.check.ends_with("_delay") || it.check.ends_with("_offset")),
        "{found:#?}"
    );
}
