//! The car that follows a log: what it finds on simulated logs whose truth is known, laws of its equations, and logs of real cars.

use crate::support;

use std::f64::consts::TAU;
use std::slice;

use approx::assert_relative_eq;
use drive_prediction::car::motion::{DriveWithRates, Dual, MotionInputs, lateral_axle_forces};
use drive_prediction::car::parameters::{COUNT, CarParameters, ParameterPrior, ParameterVector};
use drive_prediction::car::{AdaptivePredictor, CarPredictor, CarSpecification, fit_car};
use drive_prediction::score::{open_loop, score_lateral_acceleration};
use drive_prediction::{EvenDrive, MotionPredictor};
use preparation::Drive;

/// θ of the simulated logs, in the order of `ParameterVector`: not the prior's mean.
fn truth(car: &CarSpecification) -> ParameterVector {
    let mut x = ParameterPrior::new(car).mean;
    x[0] = 7.0_f64.ln();
    x[1] = 9.0_f64.ln();
    x[2] = 0.8_f64.ln();
    x[3] = 0.9_f64.ln();
    x
}

/// A log that a car with these parameters drives: both ways, speed and steering of several frequencies.
fn simulated(car: &CarSpecification, x: &ParameterVector, seconds: f64, phase: f64) -> EvenDrive {
    let rows = (seconds / 0.01) as usize;
    let time: Vec<f64> = (0..rows).map(|i| i as f64 * 0.01).collect();
    let wave = |t: f64, hz: f64| (TAU * (hz * t + phase)).sin();
    let mut drive = EvenDrive {
        name: "simulated".to_owned(),
        step: 0.01,
        r_dot: vec![0.0; rows],
        counts: vec![true; rows],
        motion: Drive {
            v_x: time.iter().map(|t| 2.2 + 0.8 * wave(*t, 0.11)).collect(),
            delta: time
                .iter()
                .map(|t| 0.25 * wave(*t, 0.31) * (1.0 + 0.5 * wave(*t, 0.05)) + 0.05 * wave(*t, 1.3))
                .collect(),
            v_y: vec![0.0; rows],
            r: vec![0.0; rows],
            a_y: vec![0.0; rows],
            t: time,
            ..Drive::default()
        },
        ..EvenDrive::default()
    };
    let driven = DriveWithRates::new(&drive);
    for (row, [v_y, r]) in driven.simulate_states::<f64>(car, x, 0, rows - 1).into_iter().enumerate() {
        drive.motion.v_y[row] = v_y;
        drive.motion.r[row] = r;
    }
    drive.r_dot = drive_prediction::zero_phase::derivative(&drive.motion.r, 0.01);
    let v_y_dot = drive_prediction::zero_phase::derivative(&drive.motion.v_y, 0.01);
    drive.motion.a_y = (0..rows).map(|i| v_y_dot[i] + drive.motion.v_x[i] * drive.motion.r[i]).collect();
    drive
}

#[test]
fn parameters_of_simulated_logs_are_found() {
    let car = support::dart_car();
    let x = truth(&car);
    let logs: Vec<EvenDrive> =
        [0.0, 0.3, 0.7].into_iter().map(|phase| simulated(&car, &x, 60.0, phase)).collect();
    let found = fit_car(&logs, &car).expect("it can be fitted");
    for (i, truth) in x.iter().enumerate().take(4) {
        let error = (found.parameters[i] - truth).abs();
        // Logs may differ by 10 to 20 % each: three of them tell the mean to 5 % or so.
        assert!(error < 0.06 && error < 2.5 * found.parameter_std[i], "{i}: {error}");
    }
    for own in &found.section_parameters {
        assert!((own[7] - x[7]).abs() < 5e-3, "lag {}", own[7]);
        assert!((own[5] - x[5]).abs() < 3e-3, "offset {}", own[5]);
    }
}

#[test]
fn a_log_is_followed_but_its_future_is_not_known() {
    let car = support::dart_car();
    let x = truth(&car);
    let fitted = fit_car(&[simulated(&car, &x, 60.0, 0.0), simulated(&car, &x, 60.0, 0.4)], &car)
        .expect("it can be fitted");
    // Another day: trim, lag and floor.
    let mut other = x;
    other[5] += 0.03;
    other[7] += 0.03;
    other[2] -= 0.1;
    other[3] -= 0.1;
    let log = simulated(&car, &other, 60.0, 0.2);
    let course = AdaptivePredictor::new(&fitted, None, &log);
    let last = course.parameter_track().estimate_at(5990);
    assert!((last.x[5] - other[5]).abs() < 5e-3, "offset {}", last.x[5]);
    assert!((last.x[7] - other[7]).abs() < 8e-3, "lag {}", last.x[7]);
    let without = CarPredictor { fitted: fitted.clone(), bands: None };
    let start = 4000;
    let error = |states: Vec<[f64; 2]>| {
        let squares = states.iter().enumerate().map(|(k, it)| (it[1] - log.motion.r[start + k]).powi(2));
        (squares.sum::<f64>() / states.len() as f64).sqrt()
    };
    let [before, followed] = [&without as &dyn MotionPredictor, &course]
        .map(|model| error(model.simulate_states(&log, &model.road_wheel_angles(&log), start, 300)));
    assert!(followed < 0.3 * before, "{followed} {before}");
    // What comes after the start changes nothing of what was known there.
    let mut changed = log.clone();
    for row in 3001..changed.row_count() {
        changed.motion.r[row] *= 1.5;
        changed.motion.v_y[row] += 0.2;
    }
    let again = AdaptivePredictor::new(&fitted, None, &changed);
    assert_eq!(course.parameter_track().estimate_at(3000).x, again.parameter_track().estimate_at(3000).x);
    assert_ne!(course.parameter_track().estimate_at(4000).x, again.parameter_track().estimate_at(4000).x);
}

#[test]
fn derivatives_are_those_of_the_rollout() {
    let car = support::dart_car();
    let x = truth(&car);
    let log = simulated(&car, &x, 20.0, 0.1);
    let driven = DriveWithRates::new(&log);
    let ends = driven.simulate_states::<Dual>(&car, &x, 300, 60)[60];
    for i in 0..COUNT {
        let step = 1e-5;
        let at = |sign: f64| {
            let mut x = x;
            x[i] += sign * step;
            driven.simulate_states::<f64>(&car, &x, 300, 60)[60]
        };
        let (up, down) = (at(1.0), at(-1.0));
        for (state, end) in ends.iter().enumerate() {
            let exact = end.eps.0.expect("it depends on parameters")[i];
            let numeric = (up[state] - down[state]) / (2.0 * step);
            assert_relative_eq!(exact, numeric, max_relative = 1e-4, epsilon = 1e-6);
        }
    }
}

#[test]
fn forces_are_those_of_the_equations() {
    let car = support::dart_car();
    let mut p = CarParameters::new(&truth(&car));
    p.h = 0.0;
    let at = |p: &CarParameters<f64>, rate: f64, delta: f64| {
        lateral_axle_forces(&car, p, &MotionInputs { v_x: 2.0, rate, delta }, [0.0, 0.0])
    };
    // A small angle without longitudinal force: cornering stiffness times load.
    let [front, rear] = at(&p, 0.0, 1e-4);
    assert_relative_eq!(front, 7.0 * car.body.static_loads()[0] * 1e-4, max_relative = 1e-3);
    assert_relative_eq!(rear, 0.0, epsilon = 1e-12);
    // A car that is its own mirror image has mirrored forces.
    let [left, right] = [0.2, -0.2].map(|delta| at(&p, 1.0, delta)[0]);
    assert_relative_eq!(left, -right, max_relative = 1e-12);
    // Longitudinal force weakens, and never turns a force around.
    let free = at(&p, 0.0, 0.2)[0];
    let weak = at(&p, 6.0, 0.2)[0];
    let none = at(&p, 60.0, 0.2)[0];
    assert!(free > weak && weak > none && none > 0.0, "{free} {weak} {none}");
    // The load that the front loses the rear gains.
    p.h = 0.03;
    p.e = 0.0;
    assert!(at(&p, 5.0, 0.2)[0] < free && at(&p, -5.0, 0.2)[0] > free);
}

#[test]
fn what_cannot_be_fitted_is_told() {
    let car = support::dart_car();
    let mut log = simulated(&car, &truth(&car), 30.0, 0.0);
    log.motion.v_y.fill(f64::NAN);
    let error = fit_car(&[log.clone()], &car).expect_err("v_y is not known");
    assert!(error.to_string().starts_with("expected a stretch of 1.5 s"), "{error}");
    log.motion.v_y.fill(0.0);
    log.motion.r.fill(0.0);
    let error = fit_car(&[log], &car).expect_err("nothing moves");
    assert!(error.to_string().contains("the same values everywhere"), "{error}");
    assert!(fit_car(&[], &car).is_err());
}

/// The best of the baselines in each column: v_y, r, position over 3 s, the same over 0.6 s, a_y.
struct Best([f64; 3], [f64; 3], f64);

fn beats(fitted: &[EvenDrive], judged: &EvenDrive, car: &CarSpecification, best: &Best, inside: [f64; 2]) {
    let found = CarPredictor::fit(fitted, car).expect("it can be fitted");
    let judged = slice::from_ref(judged);
    let a_y = score_lateral_acceleration(&found, judged).expect("rows count");
    assert!(a_y.rmse <= best.2, "a_y {}", a_y.rmse);
    let share = a_y.coverage.expect("there are bands");
    assert!((inside[0]..=inside[1]).contains(&share), "a_y inside {share}");
    for (horizon, [v_y, r, position]) in [(3.0, best.0), (0.6, best.1)] {
        let score = open_loop(&found, judged, horizon).expect("it is long enough");
        assert!(score.v_y < v_y, "{horizon} s: v_y {}", score.v_y);
        assert!(score.r < r, "{horizon} s: r {}", score.r);
        assert!(score.position < position, "{horizon} s: position {}", score.position);
        assert_eq!(score.spun, 0.0, "{horizon} s");
        for share in score.coverage.expect("there are bands") {
            assert!((0.9..=0.98).contains(&share), "{horizon} s: inside {share}");
        }
    }
}

fn dart() -> Option<Vec<EvenDrive>> {
    let names = ["circles_rubber_left", "circles_rubber_right", "ramp_rubber_left", "ramp_rubber_right"];
    names.into_iter().chain(["free_moderate", "free_fast"]).map(support::dart).collect()
}

fn without(mut all: Vec<EvenDrive>, name: &str) -> (Vec<EvenDrive>, EvenDrive) {
    let place = all.iter().position(|drive| drive.name == name).expect("it is there");
    let one = all.remove(place);
    (all, one)
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_small_car_that_drives_fast_is_predicted() {
    let all = dart().expect("a log of TRACKSIDE_DATA");
    let (fitted, judged) = without(all, "free_fast");
    let best = Best([0.060, 0.28, 0.81], [0.068, 0.33, 0.087], 0.70);
    beats(&fitted, &judged, &support::dart_car(), &best, [0.9, 0.98]);
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_small_car_that_drives_moderately_is_predicted() {
    let all = dart().expect("a log of TRACKSIDE_DATA");
    let (fitted, judged) = without(all, "free_moderate");
    let best = Best([0.018, 0.20, 0.85], [0.0179, 0.224, 0.063], 0.72);
    beats(&fitted, &judged, &support::dart_car(), &best, [0.9, 0.98]);
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_race_car_of_1964_is_predicted() {
    let drive = support::lm().expect("a log of TRACKSIDE_DATA");
    let first = drive.motion.t[0];
    let fitted = [drive.restricted_to_interval(first, first + 220.0)];
    let judged = drive.restricted_to_interval(first + 220.0, f64::INFINITY);
    let best = Best([0.19, 0.045, 2.2], [0.127, 0.025, 0.053], 0.40);
    beats(&fitted, &judged, &support::lm_car(), &best, [0.93, 0.97]);
}
