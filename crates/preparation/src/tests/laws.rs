//! What must hold for any recording.

use approx::assert_relative_eq;
use proptest::prelude::*;
use vehicle::LimitedSlipDifferential;

use crate::tests::drive::{Instant, car, pipeline, record, simulate, symmetric};
use crate::{
    BrakeShare, Car, CurvePoints, DriveLog, Error, OffsetSource, OutlierRejection, PreparationPipeline,
    PreparedRecording, SIGNALS, ShiftEstimation, SlipResampling,
};

fn drive() -> Vec<Instant> {
    simulate(&car(), 15.0, 1.0)
}

fn changed(
    recording: &DriveLog<'static>,
    name: &str,
    change: impl Fn(usize, f64, f64) -> Option<(f64, f64)>,
) -> DriveLog<'static> {
    let mut recording = recording.clone();
    let signal = recording.get(name).expect("it is there").clone();
    let rows = signal.time.iter().zip(&*signal.value).enumerate();
    let (time, value) = rows.filter_map(|(i, (t, v))| change(i, *t, *v)).unzip();
    recording.insert(name, time, value);
    recording
}

fn later(recording: &DriveLog<'static>, by: f64) -> DriveLog<'static> {
    let present: Vec<_> = SIGNALS.iter().map(|s| s.0).filter(|n| recording.get(n).is_some()).collect();
    present.iter().fold(recording.clone(), |r, name| changed(&r, name, |_, t, v| Some((t + by, v))))
}

fn run(pipeline: &PreparationPipeline, recording: &DriveLog) -> PreparedRecording {
    pipeline.prepare(recording).expect("the recording can be prepared")
}

fn all_points(prepared: &PreparedRecording) -> [&CurvePoints; 2] {
    [&prepared.front.lateral, &prepared.rear.lateral]
}

#[test]
fn a_slow_logger_has_no_gaps() {
    let pipeline = pipeline(&car());
    let all = record(&simulate(&car(), 15.0, 1.0));
    let present = SIGNALS.iter().map(|signal| signal.0).filter(|name| all.get(name).is_some());
    let slow = present.fold(all.clone(), |log, name| {
        // 10 Hz.
        let every = match name {
            "v_x" | "v_y" => 20,
            "delta" => 10,
            _ => 40,
        };
        changed(&log, name, |i, t, v| (i % every == 0).then_some((t, v)))
    });
    let prepared = run(&pipeline, &slow);
    // Signals begin and end apart by less than a step.
    assert!(prepared.report.lost.gap <= 2, "{:?}", prepared.report.lost);
    assert_eq!(prepared.report.stretches.len(), run(&pipeline, &all).report.stretches.len());
    // A second without rows is a gap at any rate.
    let torn = changed(&slow, "r", |_, t, v| (!(8.0..9.0).contains(&t)).then_some((t, v)));
    let torn = run(&pipeline, &torn).report;
    assert!(torn.lost.gap > 5 && torn.stretches.len() > prepared.report.stretches.len());
}

#[test]
fn mirrored_driving_gives_mirrored_points() {
    let vehicle = symmetric();
    let pipeline = PreparationPipeline {
        outliers: OutlierRejection::default(),
        slip_resampling: SlipResampling::default(),
        ..pipeline(&vehicle)
    };
    let [left, right] = [1.0, -1.0].map(|side| run(&pipeline, &record(&simulate(&vehicle, 15.0, side))));
    for (a, b) in all_points(&left).into_iter().zip(all_points(&right)) {
        assert!(a.samples.len() > 300);
        let mirrored = |values: &[f64]| values.iter().map(|v| -v).collect::<Vec<_>>();
        assert_eq!(a.samples.slip, mirrored(&b.samples.slip));
        assert_eq!(a.samples.force, mirrored(&b.samples.force));
    }
    for (a, b) in left.report.offsets.iter().zip(&right.report.offsets) {
        let sign = if a.name == "a_x" { 1.0 } else { -1.0 };
        assert_relative_eq!(a.value, sign * b.value, epsilon = 1e-12);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn when_it_was_does_not_matter(by in -1e4..1e4f64) {
        let (recording, pipeline) = (record(&drive()), pipeline(&car()));
        let (now, then) = (run(&pipeline, &recording), run(&pipeline, &later(&recording, by)));
        for (a, b) in all_points(&now).into_iter().zip(all_points(&then)) {
            prop_assert_eq!(a.samples.len(), b.samples.len());
            for (x, y) in a.samples.slip.iter().zip(&b.samples.slip) {
                prop_assert!((x - y).abs() < 1e-8);
            }
            for (x, y) in a.samples.force.iter().zip(&b.samples.force) {
                prop_assert!((x - y).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn what_happens_elsewhere_does_not_matter(at in 3.0..11.0f64, lasting in 0.3..1.5f64) {
        // Rows of one signal are lost: points away from the gap stay as they are, but for the rounding of stamps.
        let recording = record(&drive());
        let mut pipeline = pipeline(&car());
        let none = Some(0.0);
        pipeline.offsets = crate::OffsetSettings { r: none, a_x: none, a_y: none, sideslip: none, ..pipeline.offsets };
        let torn = changed(&recording, "a_y", |_, t, v| (t < at || t > at + lasting).then_some((t, v)));
        let (whole, torn) = (run(&pipeline, &recording), run(&pipeline, &torn));
        prop_assert_eq!(torn.report.stretches.len(), 2);
        prop_assert!(torn.report.lost.gap > 0);
        let forces = |p: &PreparedRecording| {
            let stage = p.stages.iter().find(|s| s.name == "axle forces and slips").expect("it was run").clone();
            let column = stage.outputs[4].clone();
            prop_assert_eq!(&column.name, "F_yf");
            Ok(column)
        };
        let (whole, torn) = (forces(&whole)?, forces(&torn)?);
        let mut compared = 0;
        for (t, F) in torn.time.iter().zip(&torn.values) {
            prop_assert!(*t <= at || *t >= at + lasting, "a value at {t} s, in the gap");
            // The widest filter reaches 0.155 s, the interpolation two rows more.
            if *t < at - 0.2 || *t > at + lasting + 0.2 {
                let i = whole.time.iter().position(|w| w == t).expect("the instants are the same");
                prop_assert!((whole.values[i] - F).abs() < 1e-8 * 4e3, "{} {F} at {t}", whole.values[i]);
                compared += 1;
            }
        }
        prop_assert!(compared > 1000);
    }
}

#[test]
fn rejecting_and_evening_out_only_take_points_away() {
    let recording = record(&drive());
    let all = run(&pipeline(&car()), &recording);
    let some = PreparationPipeline {
        outliers: OutlierRejection::default(),
        slip_resampling: SlipResampling::Nearest { count: 200 },
        ..pipeline(&car())
    };
    let some = run(&some, &recording);
    for (all, some) in all_points(&all).into_iter().zip(all_points(&some)) {
        assert!(some.samples.len() <= 200 && some.samples.len() > 50);
        let mut rows = all.samples.slip.iter().zip(&all.samples.force);
        for point in some.samples.slip.iter().zip(&some.samples.force) {
            assert!(rows.any(|row| row == point), "the point is not among all of them, in their order");
        }
        let c = &some.counts;
        assert_eq!((c.rows, c.used), (all.samples.len(), some.samples.len()));
        assert_eq!(c.slip_range, all.samples.slip_range(), "the ends stay");
    }
}

#[test]
fn gear_shifts_and_slow_driving_are_cut_before_smoothing() {
    let recording = record(&drive());
    let gear = |t: f64| if t < 6.0 { 3.0 } else { 4.0 };
    let mut shifting = recording.clone();
    let time: Vec<f64> = (0..150).map(|i| 0.1 * f64::from(i)).collect();
    shifting.insert("gear", time.clone(), time.iter().map(|t| gear(*t)).collect());
    let pipeline = pipeline(&car());
    let shifted = run(&pipeline, &shifting);
    // From 5.9 s, the last row of third gear, to 6.2 s: 61 rows of 200 Hz and no more.
    assert_eq!((shifted.report.gear_shifts, shifted.report.stretches.len()), (1, 2));
    let cut = shifted.report.lost.gear_shift;
    assert!((60..=61).contains(&cut), "{cut} rows");

    let slow = changed(&recording, "v_x", |_, t, v| Some((t, if (7.0..8.0).contains(&t) { 3.0 } else { v })));
    let report = run(&pipeline, &slow).report;
    assert_eq!(report.lost.slow, 200);
    assert!(report.stretches.iter().all(|s| s.end < 7.0 || s.start > 7.995));
    assert_eq!(run(&pipeline, &slow).front.lateral.samples.slip.iter().filter(|s| s.abs() > 0.3).count(), 0);

    let crawl = PreparationPipeline { min_speed: 90.0, ..pipeline };
    let error = crawl.prepare(&recording).expect_err("the car never was that fast").to_string();
    assert!(error.contains("3000 are slower than 90 m/s") && error.contains("lower `min_speed`"), "{error}");
}

#[test]
fn held_rows_are_dropped_and_counted() {
    let recording = record(&drive());
    let hold = |i: usize| if i % 8 == 3 { i - 1 } else { i };
    let held = ["a_x", "a_y", "r"].iter().fold(recording.clone(), |r, name| {
        let values = r.get(name).expect("it is there").value.clone();
        changed(&r, name, |i, t, _| Some((t, values[hold(i)])))
    });
    let clean = run(&pipeline(&car()), &recording);
    let dropped = run(&PreparationPipeline { drop_held: true, ..pipeline(&car()) }, &held);
    let kept = run(&pipeline(&car()), &held);
    assert_eq!(dropped.report.held["a_y"], 750);
    assert_eq!(dropped.report.held["v_x"], 0);
    let error = |p: &PreparedRecording| {
        let pairs = p.front.lateral.samples.force.iter().zip(&clean.front.lateral.samples.force);
        pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>()
    };
    assert!(error(&dropped) < 0.5 * error(&kept), "{} {}", error(&dropped), error(&kept));
}

#[test]
fn too_little_straight_driving_is_said() {
    let weave: Vec<Instant> = drive().into_iter().filter(|i| i.time > 8.0).collect();
    let report = run(&pipeline(&car()), &record(&weave)).report;
    for offset in report.offsets {
        assert_eq!((offset.source, offset.value), (OffsetSource::TooFewStraightSamples, 0.0));
    }
}

#[test]
fn two_step_shifts_are_told_and_not_applied() {
    let recording = record(&drive());
    let two_step = ShiftEstimation::TwoStep { limit: 0.015, horizontal_share: 0.5 };
    let joint = run(&pipeline(&car()), &recording);
    let separate = run(&PreparationPipeline { shifts: two_step, ..pipeline(&car()) }, &recording);
    assert_eq!(joint.front.lateral.samples, separate.front.lateral.samples);
    assert!(joint.front.lateral.shift.is_none());
    assert!(separate.front.lateral.shift.is_some_and(|s| s.K > 10.0));
}

#[test]
fn differential_needs_wheel_speeds_and_settings_must_make_sense() {
    let differential = LimitedSlipDifferential {
        drive_lock: 0.2,
        coast_lock: 0.5,
        preload: 100.0,
        engine_brake: 800.0,
        sensitivity: 0.5,
        track: 1.5,
    };
    let json = r#"{"smooth": {"yaw_rate": {"kind": "gaussian", "sigma": 0.05}},
        "slip_resampling": {"method": "weighted", "count": 300}}"#;
    let settings: PreparationPipeline = serde_json::from_str(json).expect("the settings are spelled right");
    let locking = Car { differential: Some(differential), ..Car::default() };
    let error = PreparationPipeline { car: locking, ..settings }.prepare(&record(&drive()));
    let error = error.expect_err("there are no wheel speeds");
    assert!(matches!(&error, Error::Missing { name, .. } if name == "omega_rl"), "{error}");

    let share = serde_json::from_str::<BrakeShare>("\"by_feel\"");
    assert!(share.expect_err("no such rule").to_string().contains("or \"by_load\""));

    let wrong =
        PreparationPipeline { rate: 0.0, ..PreparationPipeline::default() }.prepare(&record(&drive()));
    assert_eq!(wrong.expect_err("no rate").to_string(), "`rate` is 0, expected a positive number");
    assert_eq!(
        serde_json::from_str::<PreparationPipeline>("{}").expect("all has defaults"),
        PreparationPipeline::default()
    );
}
