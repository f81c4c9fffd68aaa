//! Asserts what is found in logs of real cars, if they are at hand; `TRACKSIDE_DATA` names another folder to look in.

use crate::cars::LOGS;
use crate::real_log::RealLog;
use drive_doctor::{Certainty, CorrectionTarget, LogExamination, examine_log, steering_map};

/// The examination of a log of the list; `None` where its file is not at hand.
fn of(name: &str) -> Option<LogExamination> {
    let log = LOGS.iter().find(|it| it.name == name).expect("a log of the list");
    let (log, car) = log.read()?;
    Some(examine_log(&log, &car))
}

#[test]
#[ignore = "needs logs of real cars"]
fn no_unit_of_the_250_lm_is_doubted() {
    let found = of("250 LM").expect("a log of TRACKSIDE_DATA");
    assert!(found.refusing_finding().is_none(), "{found:#?}");
    let names: Vec<&str> = found.findings.iter().map(|it| it.check.as_str()).collect();
    assert!(!names.iter().any(|name| name.ends_with("_unit") || name.ends_with("_sign")), "{names:?}");
    assert!(names.contains(&"a_y_held") && names.contains(&"r_held"), "{names:?}");
}

#[test]
#[ignore = "needs logs of real cars"]
fn the_bank_of_the_track_comes_again_lap_by_lap() {
    let found = of("250 LM").expect("a log of TRACKSIDE_DATA");
    let bank = found.findings.iter().find(|it| it.check == "bank").expect("a bank");
    assert_eq!(bank.sure, Certainty::Likely, "{bank:#?}");
    // In the mean over three laps it is up to 0.34 m/s2.
    let most = bank.value.unwrap_or_default();
    assert!((0.25..0.45).contains(&most), "{bank:#?}");
    assert!(bank.sentence.contains("each lap of 31"), "{bank:#?}");
}

#[test]
#[ignore = "needs logs of real cars"]
fn the_late_yaw_rate_of_the_av_21_is_named_by_independent_clocks() {
    let found = of("AV-21").expect("a log of TRACKSIDE_DATA");
    let first = &found.findings[0];
    assert_eq!((first.check.as_str(), first.sure, first.refuses), ("r_delay", Certainty::Certain, true));
    let late = first.value.unwrap_or_default();
    assert!((0.3..0.4).contains(&late), "{first:#?}");
    for clock in ["front wheel speeds", "the course", "steering", "The halves of the log say"] {
        assert!(first.sentence.contains(clock), "{}", first.sentence);
    }
    let found = of("AV-21 without wheels").expect("a log of TRACKSIDE_DATA");
    assert!(
        found.findings.iter().any(|it| it.check == "r_delay" && it.sure == Certainty::Certain),
        "{found:#?}"
    );
}

#[test]
#[ignore = "needs logs of real cars"]
fn the_understeer_gradient_of_the_av_21_is_told_with_the_yaw_rate_in_its_place() {
    let found = of("AV-21").expect("a log of TRACKSIDE_DATA");
    let it = found.understeer.expect("a gradient");
    // 0.00105 rad s2/m by other filters; 2.9 mrad as given, 1.0 mrad with the yaw rate 0.34 s earlier.
    assert!((0.0008..0.0013).contains(&it.gradient), "{it:#?}");
    assert!((it.interval[0]..it.interval[1]).contains(&0.00105) && it.interval[0] > 0.0, "{it:#?}");
    assert!(it.rms < 1.0e-3 && it.rms_as_recorded > 2.5e-3, "{it:#?}");
    assert!((0.3..0.4).contains(&it.r_earlier_by), "{it:#?}");
}

#[test]
#[ignore = "needs logs of real cars"]
fn nothing_is_corrected_where_a_tape_measure_says_that_nothing_is_wrong() {
    for log in LOGS.iter().filter(|it| it.is_dart()) {
        let (recording, car) = log.read().expect("a log of TRACKSIDE_DATA");
        let found = examine_log(&recording, &car);
        let of_v_y = |name: &str| name.starts_with("v_y") && !name.ends_with("angle");
        let wrong: Vec<_> = found.serious_findings().filter(|it| of_v_y(&it.check)).collect();
        assert!(wrong.is_empty(), "{}: {wrong:#?}", log.name);
        assert!(!found.not_told.is_empty(), "{}: {found:#?}", log.name);
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn no_constant_corrects_the_sideslip_of_the_250_lm() {
    let found = of("250 LM").expect("a log of TRACKSIDE_DATA");
    for it in found.findings.iter().filter(|it| it.channels.contains(&"v_y")) {
        assert_eq!((it.sure, it.correction.place), (Certainty::Possible, None), "{it:#?}");
    }
    let late = found.findings.iter().find(|it| it.check == "a_y_delay").expect("a delay");
    assert!(late.value.is_some_and(|late| (0.01..0.025).contains(&late)), "{late:#?}");
    assert_eq!(late.correction.place, Some(CorrectionTarget::Column));
}

#[test]
#[ignore = "needs logs of real cars"]
fn the_gyro_of_dart_reads_too_much() {
    let found = of("free_moderate imu").expect("a log of TRACKSIDE_DATA");
    let scale = found.findings.iter().find(|it| it.check == "r_scale").expect("a scale");
    // Against motion capture it is 1.028 (1.023 to 1.033).
    let value = scale.value.unwrap_or_default();
    assert!((0.015..0.035).contains(&value), "{scale:#?}");
}

/// Against the places of the camera system: 1.028 (1.023 to 1.033) by other filters.
#[test]
#[ignore = "needs logs of real cars"]
fn the_gain_of_a_gyro_is_told_by_the_course() {
    for name in ["free_moderate gains", "free_fast gains"] {
        let found = of(name).expect("a log of TRACKSIDE_DATA");
        let scale = found.findings.iter().find(|it| it.check == "r_scale").expect("a scale");
        let [low, high] = scale.interval.unwrap_or_default();
        assert!(low < 0.028 && high > 0.023 && high - low < 0.01, "{scale:#?}");
        assert_eq!(
            (scale.sure, scale.correction.place),
            (Certainty::Certain, Some(CorrectionTarget::Column))
        );
        // Straight on and without force the encoder reads what the car does; only slip makes it read more.
        let radius = found.rolling[0].radius;
        assert!((0.0493..0.0503).contains(&radius), "{:#?}", found.rolling);
    }
}

/// A misalignment that only the rear axle tells is nobody's: the frame was turned to the car before.
#[test]
#[ignore = "needs logs of real cars"]
fn no_angle_of_dart_is_certain() {
    for log in LOGS.iter().filter(|it| it.is_dart()) {
        let (recording, car) = log.read().expect("a log of TRACKSIDE_DATA");
        let found = examine_log(&recording, &car);
        let angle = found.serious_findings().find(|it| it.check == "v_y_angle");
        assert!(angle.is_none(), "{}: {angle:#?}", log.name);
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn circles_tell_neither_clocks_nor_offsets() {
    let found = of("circles_rubber_left").expect("a log of TRACKSIDE_DATA");
    assert!(found.not_told.iter().any(|it| it.check.starts_with("clocks")), "{found:#?}");
    let curvature = "cannot be told apart from curvature";
    assert!(found.not_told.iter().any(|it| it.reason.contains(curvature)), "{found:#?}");
    assert!(
        !found.findings.iter().any(|it| it.check.ends_with("_delay") || it.check.ends_with("_offset")),
        "{found:#?}"
    );
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_staircase_tells_the_map_of_the_steering_and_circles_do_not() {
    let map = |file| {
        let log = RealLog::read(file)?;
        let [time, command, v_x, r] =
            ["time_s", "steering_cmd", "v_x", "yaw_rate"].map(|title| log.column(title, 1.0));
        Some(steering_map(&time, &command, &v_x, &r, 0.1735))
    };
    // The angles of both staircases together, by the source's table of points.
    let known = [
        ("dart_steering_staircase_left.csv", [(0.5, 0.2231), (0.85, 0.3019)]),
        ("dart_steering_staircase_right.csv", [(-0.5, -0.2348), (-0.85, -0.3938)]),
    ];
    for (file, points) in known {
        let found = map(file).expect("a log of TRACKSIDE_DATA");
        let found = found.expect("a map");
        for (command, angle) in points {
            let point = found.points.iter().find(|it| (it.command - command).abs() < 0.01);
            let off = point.expect("a command").angle - angle;
            assert!(off.abs() < 0.015, "{file}, {command}: {point:?}");
        }
        assert!(found.play.is_none() && found.advice.is_some(), "{file}: {found:#?}");
    }
    for file in ["dart_circles_rubber_left.csv", "dart_ramp_rubber_left.csv"] {
        let found = map(file).expect("a log of TRACKSIDE_DATA");
        let error = found.expect_err("circles");
        assert!(error.contains("not identifiable"), "{error}");
    }
}

/// However late a channel is: an estimate to first order alone would find less than half of it.
#[test]
#[ignore = "needs logs of real cars"]
fn a_channel_of_the_250_lm_that_is_moved_is_named_with_its_delay() {
    let log = LOGS.iter().find(|it| it.name == "250 LM").expect("a log of the list");
    let (log, car) = log.read().expect("a log of TRACKSIDE_DATA");
    for (channel, delay) in [
        ("delta", -0.1),
        ("delta", 0.05),
        ("delta", 0.2),
        ("delta", 0.4),
        ("a_y", -0.1),
        ("a_y", 0.2),
        ("a_y", 0.4),
        ("v_y", -0.1),
        ("v_y", 0.2),
        ("v_y", 0.4),
        ("r", 0.2),
        ("r", 0.4),
    ] {
        let mut moved = log.clone();
        let Some(signal) = log.get(channel) else { panic!("no {channel}") };
        let time = signal.time.iter().map(|t| t + delay).collect();
        moved.insert(channel, time, signal.value.to_vec());
        let found = examine_log(&moved, &car);
        let name = format!("{channel}_delay");
        let told: Vec<_> = found.findings.iter().filter(|it| it.check == name).collect();
        let [told] = told[..] else { panic!("{channel} {delay}: {:#?}", found.findings) };
        let value = told.value.unwrap_or_default();
        // The recording has 14 ms of its own between a_y and the others.
        assert!((value - delay).abs() < 0.025, "{channel} {delay}: {}", told.sentence);
        assert_eq!(told.sure, Certainty::Certain, "{channel} {delay}: {}", told.sentence);
        assert_eq!(told.refuses, value.abs() > 0.1, "{}", told.sentence);
    }
}
