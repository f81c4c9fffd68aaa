//! Replays logs of real cars: rubber, tape, and a race track.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use crate::support;

use support::fit::{self, a_y, axles, scaled};
use support::log::{Log, dart, ferrari};
use support::replay::Fmu;
use vehicle::MagicFormula;

const RUBBER: [&str; 6] = [
    "circles_rubber_left",
    "circles_rubber_right",
    "ramp_rubber_left",
    "ramp_rubber_right",
    "free_fast",
    "free_moderate",
];

/// The steering has a play of ±0.015 rad, the cameras know v_y to some mm/s.
const SMALL_CAR: [(&str, f64); 2] = [("model.alpha_f", 0.01), ("sensor.v_y", 0.01)];

/// Time after which a change has to be known [s].
const ENOUGH: f64 = 5.0;

/// The curves nearest to some logs.
fn curves(logs: &[Log]) -> [MagicFormula; 2] {
    let all: Vec<_> = logs.iter().map(axles).collect();
    [0, 1].map(|axle| fit::curve(&all.iter().flat_map(|both| both[axle].iter().copied()).collect::<Vec<_>>()))
}

/// The logs on rubber, and curves of all but the last one.
fn rubber() -> Option<(Vec<Log>, [MagicFormula; 2])> {
    let logs: Vec<Log> = RUBBER.iter().map(|name| dart(name)).collect::<Option<_>>()?;
    let curves = curves(&logs[..5]);
    Some((logs, curves))
}

/// Root mean square of the errors of a_y [m/s²] of curves at rows of a log.
fn error(log: &Log, rows: &[usize], curves: &[MagicFormula; 2]) -> f64 {
    let sum: f64 = rows.iter().map(|k| (a_y(log, *k, curves) - log.a_y[*k]).powi(2)).sum();
    (sum / rows.len() as f64).sqrt()
}

/// The one factor of similarity that fits a whole log best, and the error of a_y that it leaves [m/s²].
fn similarity(log: &Log, curves: &[MagicFormula; 2]) -> (f64, f64) {
    let rows: Vec<_> = (0..log.v_x.len()).filter(|k| log.ok[*k]).collect();
    let factors = (20..131).map(|percent| f64::from(percent) * 0.01);
    let errors = factors.map(|it| (it, error(log, &rows, &curves.map(|c| scaled(&c, it, 1.0)))));
    errors.min_by(|a, b| a.1.total_cmp(&b.1)).expect("factors")
}

/// What a replay leaves.
#[derive(Default)]
struct Replay {
    /// Factor of friction, K_f and K_r over the nominal ones after five seconds that say something.
    after: [f64; 3],
    /// Least and largest factor after that.
    range: [f64; 2],
    /// Error of a_y after that [m/s²], each row with the curves of the row before.
    error: f64,
    alarms: usize,
    /// Means over the rows that say something, D_f D_r K_f K_r.
    means: [f64; 4],
}

fn replay(log: &Log, curves: &[MagicFormula; 2], settings: &[(&str, f64)]) -> Replay {
    let mut fmu = Fmu::of(log, curves, settings);
    let loads = log.car.body.static_loads();
    let peak = (loads[0] * curves[0].D + loads[1] * curves[1].D) / log.car.body.m;
    let mut replay = Replay { range: [1.0, 1.0], ..Replay::default() };
    let (mut said, mut square, mut counted, mut informative) = (0.0, 0.0, 0.0, 0.0);
    for k in 0..log.v_x.len() {
        let [D_f, D_r, K_f, K_r] = fmu.relative(curves);
        fmu.take(log, k);
        replay.alarms += usize::from(fmu.get("alarm") != 0.0);
        let factor = fmu.get("factor");
        if said >= ENOUGH {
            replay.range = [replay.range[0].min(factor), replay.range[1].max(factor)];
        }
        if fmu.get("informative_f") + fmu.get("informative_r") > 0.0 {
            informative += 1.0;
            let now = fmu.relative(curves);
            replay.means.iter_mut().zip(now).for_each(|(sum, it)| *sum += it);
        }
        if !log.ok[k] {
            continue;
        }
        let before = said;
        said += if a_y(log, k, curves).abs() > 0.5 * peak { log.period } else { 0.0 };
        if before < ENOUGH && said >= ENOUGH {
            let [_, _, K_f, K_r] = fmu.relative(curves);
            replay.after = [factor, K_f, K_r];
        }
        if said >= ENOUGH {
            let online = [scaled(&curves[0], D_f, K_f), scaled(&curves[1], D_r, K_r)];
            square += (a_y(log, k, &online) - log.a_y[k]).powi(2);
            counted += 1.0;
        }
    }
    replay.error = (square / f64::max(counted, 1.0)).sqrt();
    replay.means = replay.means.map(|sum| sum / f64::max(informative, 1.0));
    replay
}

#[test]
#[ignore = "needs logs of real cars"]
fn tape_is_told_as_less_friction_and_not_as_less_stiffness() {
    let (_, curves) = rubber().expect("a log of TRACKSIDE_DATA");
    for side in ["left", "right"] {
        let log = dart(&format!("circles_tape_{side}")).expect("a log of TRACKSIDE_DATA");
        let (offline, least) = similarity(&log, &curves);
        let Replay { after: [factor, K_f, K_r], error, alarms, .. } = replay(&log, &curves, &SMALL_CAR);
        println!(
            "tape {side}: {factor:.3} for {offline:.2}, K {K_f:.2} {K_r:.2}, a_y {error:.3} for {least:.3}"
        );
        assert!((factor / offline - 1.0).abs() < 0.1, "{factor} {offline}");
        assert!((K_f - 1.0).abs() < 0.1 && (K_r - 1.0).abs() < 0.1, "{K_f} {K_r}");
        assert!(error <= least, "{error} {least}");
        assert!(alarms > 0);
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn rubber_makes_no_alarm() {
    let (logs, curves) = rubber().expect("a log of TRACKSIDE_DATA");
    for (name, log) in RUBBER.iter().zip(&logs) {
        let Replay { range: [low, high], alarms, means, .. } = replay(log, &curves, &SMALL_CAR);
        println!("{name}: factor {low:.3} to {high:.3}, means {means:.2?}");
        assert_eq!(alarms, 0, "{name}");
        // Peaks of the three days of these logs differ by 15 % from their mean.
        assert!(low > 0.8 && high < 1.25, "{name}: {low} {high}");
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_race_car_keeps_the_friction_and_the_stiffness_of_the_offline_fit() {
    let log = ferrari().expect("a log of TRACKSIDE_DATA");
    let curves = curves(std::slice::from_ref(&log));
    // Its accelerometer has the engine in it.
    let Replay { alarms, means, range, .. } = replay(&log, &curves, &[("sensor.a_y", 1.0)]);
    println!("250 LM: means {means:.3?}, factor {range:.3?}");
    assert_eq!(alarms, 0);
    assert!(means.iter().all(|mean| (mean - 1.0).abs() < 0.06), "{means:?}");
}
