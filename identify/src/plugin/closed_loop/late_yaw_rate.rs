//! Asserts that the task refuses the recording of a real car whose yaw rate is late, if it is at hand.

#[path = "../../../../crates/drive-doctor/tests/support/real_log.rs"]
mod real_log;

use plugin::{Analysis, AnalysisRequest, NullAnalysisServices, Signal};
use real_log::RealLog;
use serde_json::Value;

use crate::plugin::Identify;

/// A Dallara AV-21. Mass and places of the axles are the team's, the rest is unknown.
const CAR: &str = "aero = \"none\"
brake_front_share = 0.55
[car.body]
m = 790.0
I_zz = { value = 1000.0, std = 200.0 }
l_f = 1.248
l_r = 1.7328
h = { value = 0.3, std = 0.1 }";
const MASS: f64 = 790.0;
/// Rows to both sides that a rate is taken over: 0.2 s.
const REACH: usize = 5;
/// m/s of a wheel with a radius of 0.3 m, in rad/s, of 1 km/h.
const WHEEL: f64 = 1.0 / 3.6 / 0.3;

/// Time from the first row on [s], and columns with the names of signals.
type RecordedColumns = (Vec<f64>, Vec<(&'static str, Vec<f64>)>);

/// The recording. Nobody recorded the lateral acceleration, so it is that of the motion over ground; the force is that of the
/// forward acceleration.
fn read_recording() -> Option<RecordedColumns> {
    let recording = RealLog::read("av21_putnam_park.csv")?;
    let column = |title: &str, factor: f64| recording.column(title, factor);
    let stamps = column("time(s)", 1.0);
    let time: Vec<f64> = stamps.iter().map(|stamp| stamp - stamps[0]).collect();
    let [v_x, v_y, r] = ["vx(m/s)", "vy(m/s)", "omega(rad/s)"].map(|title| column(title, 1.0));
    let a_y = |k: usize| {
        let (from, until) = (k.saturating_sub(REACH), (k + REACH).min(time.len() - 1));
        (v_y[until] - v_y[from]) / (time[until] - time[from]) + v_x[k] * r[k]
    };
    let columns = vec![
        ("a_y", (0..time.len()).map(a_y).collect()),
        ("F_x", column("ax(m/s^2)", MASS)),
        ("delta", column("delta(rad)", 1.0)),
        ("omega_fl", column("wheel_fl(kmph)", WHEEL)),
        ("omega_fr", column("wheel_fr(kmph)", WHEEL)),
        ("omega_rl", column("wheel_rl(kmph)", WHEEL)),
        ("omega_rr", column("wheel_rr(kmph)", WHEEL)),
        ("v_x", v_x),
        ("v_y", v_y),
        ("r", r),
    ];
    Some((time, columns))
}

/// The result of the task from a window [s].
fn identify_window((time, columns): &RecordedColumns, window: [f64; 2]) -> Value {
    let config = format!("task = \"closed_loop\"\nwindows = [{window:?}]\n[car]\n{CAR}");
    let signals = columns.iter().map(|(name, values)| Signal { name, unit: "", time, values }).collect();
    let request = AnalysisRequest { config: &config, signals };
    Identify::check_request(&request).unwrap_or_else(|error| panic!("{error}"));
    let text = Identify::run(&request, &mut NullAnalysisServices).unwrap_or_else(|error| panic!("{error}"));
    serde_json::from_str(&text).expect("JSON")
}

fn is_refused(found: &Value) {
    let first = found["summary"][0].as_str().unwrap_or_default();
    assert!(first.contains("`r` is late"), "{first}");
    assert_eq!(found["model"]["verdict"], "does_not_fit", "{first}");
    assert_eq!(found["sound"], false, "{first}");
    for axle in ["front", "rear"] {
        let verdicts = found["pem"][axle]["identified"].as_object().expect("verdicts");
        assert!(verdicts.values().all(|it| it != "identified"), "{axle}: {verdicts:?}");
    }
    let causes = found["causes"].as_array().expect("causes");
    assert!(causes.iter().all(|cause| cause["verdict"] != "identified"), "{causes:#?}");
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_late_yaw_rate_is_named_first_and_nothing_is_identified() {
    let columns = read_recording().expect("a log of TRACKSIDE_DATA");
    for window in [[60.0, 160.0], [260.0, 360.0]] {
        is_refused(&identify_window(&columns, window));
    }
}
