//! Identifies tires without v_y and estimates it, and judges the estimate where v_y was measured and hidden.

use drive_doctor::{COURSE_CLOCK, LogExamination};
use drive_prediction::EvenDrive;
use drive_prediction::car::{CarSpecification, SteeringSignalKind};
use drive_prediction::hidden::{
    BankMap, EstimatorSetup, IntervalEstimate, NAMES, SensorChannel, SensorSignals, SideslipEstimate,
    SideslipFit, filter_sideslip, fit_sideslip_model,
};
use drive_prediction::score::BAND;
use numerics::text::format_significant;
use plugin::{AnalysisServices, ResultSummary, ResultTable};
use serde::Serialize;
use serde_json::{Map, Value, json};
use tire_inference::verdict::Identifiability;

use super::{doctor, report_progress};
use crate::assessment::{ParameterInterval, SideslipScore, SideslipTrace};
use crate::conclusion::{Conclusion, EngineeringValue, Reservation, axle_values};
use crate::config::PredictionConfig;
use crate::page;

/// Cars with a shorter wheelbase [m] are models, whose sensors are noisier.
const MODEL: f64 = 0.8;
/// Time constant of a commanded steering [s].
const LAG: f64 = 0.06;

/// Does the task where v_y is not measured, or is hidden.
///
/// # Errors
/// When the drives cannot be fitted, or the program asked to give up.
pub(super) fn run_sideslip_estimation(
    car: &CarSpecification,
    log: &LogExamination,
    config: &PredictionConfig,
    [fitted, held]: [&[EvenDrive]; 2],
    host: &mut dyn AnalysisServices,
) -> Result<Value, String> {
    check_held_out_after_fitted(fitted, held)?;
    let setup = estimator_setup(car, config.least_speed);
    // A course with another clock or sign would make the car slide that does not.
    let is_doubted = log.serious_findings().any(|it| it.channels.contains(&"course"))
        || log.not_told.iter().any(|it| it.check == COURSE_CLOCK);
    let signals = |drive: &EvenDrive| sensor_signals(drive, !is_doubted);
    let training: Vec<SensorSignals> =
        fitted.iter().map(|drive| signals(drive).first_rows(end_of_counted_rows(drive))).collect();
    let mut progress = |share| host.report_progress(0.1 + 0.6 * share, "fitting tires without v_y");
    let found =
        fit_sideslip_model(&setup, &training, None, &mut progress).map_err(|error| error.to_string())?;
    report_progress(host, 0.7, "estimating v_y")?;
    let judged_on = if held.is_empty() { fitted } else { held };
    let mut parts = Vec::new();
    for drive in judged_on {
        // Only a drive that was fitted too tells the bank of its road.
        let seen = fitted.iter().position(|it| it.log == drive.log);
        let map = seen.and_then(|place| BankMap::learn(&setup, &found, &training[place]));
        let estimate = filter_sideslip(&setup, &found, &signals(drive), map.as_ref());
        parts.push((drive, estimate, map.map(|map| map.lap)));
    }
    let score = score_sideslip(&parts);
    let mut told = parameter_intervals(&found);
    let refused = log.refusing_finding().is_some();
    if refused {
        told.iter_mut().for_each(|it| it.verdict = Identifiability::NotIdentifiable);
    }
    let mut summary = sideslip_summary(&found, score, &parts, !held.is_empty());
    let has_course = |drive: &EvenDrive| drive.sensors.as_ref().is_some_and(|it| it.course.is_some());
    if is_doubted && fitted.iter().chain(held).any(has_course) {
        summary.push(
            "The course is not used: something is wrong with it, or nothing tells whether it is late."
                .to_owned(),
        );
    }
    let reservation = match doctor::warn_about_findings(log, &mut summary) {
        Reservation::None if !found.converged => Reservation::Refusal {
            cause: "The search for the tires did not come to an end.".to_owned(),
            remedy: Some("more of both turns".to_owned()),
        },
        reservation => reservation,
    };
    let value = |name: &str| {
        let it = told.iter().find(|it| it.name == name)?;
        let ParameterInterval { value, interval, verdict, .. } = *it;
        Some(EngineeringValue { title: String::new(), unit: "", value, interval, verdict })
    };
    let both = |front, rear| Some([value(front)?, value(rear)?]);
    let axles = both("front.K", "rear.K").zip(both("D_f", "D_r"));
    let values = axles.map_or_else(Vec::new, |(stiffness, peaks)| axle_values(stiffness, peaks, &car.body));
    let conclusion = Conclusion { values, reservation, ..Conclusion::default() };
    let shown: Vec<(String, SideslipTrace)> = parts
        .iter()
        .map(|(drive, estimate, _)| (drive.name.clone(), sideslip_trace(drive, estimate)))
        .collect();
    host.write_file(
        "prediction.html",
        &page::sideslip::render_sideslip_page(&told, score, &shown, &summary, &conclusion),
    );
    let numbers: Map<String, Value> = told.iter().map(|it| (it.name.replace('.', "_"), json!(it))).collect();
    summary.splice(1..1, conclusion.sentences());
    let parameters = ResultTable::new(
        ["parameter", "value", "95 % interval", "verdict"],
        told.iter().map(|it| {
            let ends = it.interval.map(|end| format_significant(end, 4));
            let interval = format!("{} to {}", ends[0], ends[1]);
            [
                it.name.clone(),
                format_significant(it.value, 4),
                interval,
                it.verdict.to_display_text().to_owned(),
            ]
        }),
    );
    let tables = conclusion.table().into_iter().chain([parameters]).collect();
    let words = ResultSummary { sound: found.converged && !refused, tables, summary };
    Ok(json!(SideslipResult {
        words,
        held_out: !held.is_empty(),
        converged: found.converged,
        sideslip: score,
        car: numbers
    }))
}

/// The result.
#[derive(Serialize)]
struct SideslipResult {
    #[serde(flatten)]
    words: ResultSummary,
    held_out: bool,
    converged: bool,
    /// Where v_y was measured.
    sideslip: Option<SideslipScore>,
    car: Map<String, Value>,
}

/// Whether each held-out part stands behind what is fitted of its log: a filter goes through all rows before the last one.
///
/// # Errors
/// With the log in which one does not.
fn check_held_out_after_fitted(fitted: &[EvenDrive], held: &[EvenDrive]) -> Result<(), String> {
    let before = |held: &&EvenDrive| {
        let first = held.counts.iter().position(|counts| *counts);
        let last = fitted.iter().find(|it| it.log == held.log).map(end_of_counted_rows);
        first.zip(last).is_some_and(|(first, last)| first < last)
    };
    match held.iter().find(before) {
        None => Ok(()),
        Some(drive) => Err(format!(
            "expected `hold_out` at the end of each log where v_y is hidden, or a log of its own; found rows of {} before others that are \
             fitted",
            drive.name
        )),
    }
}

fn estimator_setup(car: &CarSpecification, least_speed: f64) -> EstimatorSetup {
    let setup = match car.body.wheelbase() < MODEL {
        true => EstimatorSetup::small_car(car.body),
        false => EstimatorSetup::road_car(car.body),
    };
    let steering_lag = match car.steering {
        SteeringSignalKind::Measured => 0.0,
        SteeringSignalKind::Commanded => LAG,
    };
    EstimatorSetup {
        front_drive_share: car.front_drive,
        front_brake_share: car.front_brake,
        steering_lag,
        least_speed: least_speed.min(setup.least_speed),
        ..setup
    }
}

/// The row behind the last one that counts: what is held out behind it is not seen by the fit.
fn end_of_counted_rows(drive: &EvenDrive) -> usize {
    drive.counts.iter().rposition(|counts| *counts).map_or(0, |row| row + 1)
}

/// What sensors gave; v_y is no part of it, and the course only where nothing is wrong with it.
fn sensor_signals(drive: &EvenDrive, with_course: bool) -> SensorSignals {
    let sensors = drive.sensors.clone().unwrap_or_default();
    let signals = SensorSignals::new(drive.step, &drive.motion.delta)
        .with_channel(SensorChannel::Speed, &sensors.v)
        .with_channel(SensorChannel::YawRate, &sensors.r);
    let signals = match &sensors.a_y {
        Some(a_y) => signals.with_channel(SensorChannel::LateralAcceleration, a_y),
        None => signals,
    };
    let signals = match &sensors.a_x {
        Some(a_x) => signals.with_a_x(a_x),
        None => signals,
    };
    let course = sensors.course.filter(|_| with_course);
    let of_gnss = [(SensorChannel::Course, course), (SensorChannel::GroundSpeed, sensors.ground_speed)];
    let signals = of_gnss.into_iter().fold(signals, |signals, (channel, values)| match values {
        Some(values) => signals.with_channel(channel, &values),
        None => signals,
    });
    signals.without_repeats()
}

fn score_sideslip(parts: &[(&EvenDrive, SideslipEstimate, Option<f64>)]) -> Option<SideslipScore> {
    let (mut squares, mut angles, mut inside, mut rows) = (0.0, 0.0, 0_usize, 0_usize);
    for (drive, estimate, _) in parts {
        for row in (0..drive.row_count()).filter(|row| drive.counts[*row]) {
            let (v_x, v_y) = (drive.motion.v_x[row], drive.motion.v_y[row]);
            if !v_y.is_finite() {
                continue;
            }
            let error = estimate.v_y[row] - v_y;
            squares += error * error;
            angles += (estimate.v_y[row].atan2(v_x) - v_y.atan2(v_x)).powi(2);
            inside += usize::from(error.abs() < BAND[0] * estimate.v_y_std[row]);
            rows += 1;
        }
    }
    let n = rows as f64;
    let root = |sum: f64| (sum / n).sqrt();
    (rows > 0).then(|| SideslipScore {
        v_y: root(squares),
        sideslip: root(angles),
        coverage: inside as f64 / n,
        rows,
    })
}

fn parameter_intervals(found: &SideslipFit) -> Vec<ParameterInterval> {
    let of = |name: &str, interval: &IntervalEstimate, learned: f64| ParameterInterval {
        name: name.to_owned(),
        value: interval.value,
        interval: interval.ends,
        verdict: Identifiability::from_width(1.0 - learned),
    };
    let width = |it: &IntervalEstimate| (it.ends[1] - it.ends[0]) / (4.0 * it.value.abs());
    let axles = ["front.K", "rear.K"].into_iter().zip(&found.stiffness);
    // A stiffness is known to a tenth or it is not much.
    let mut all: Vec<ParameterInterval> =
        axles.map(|(name, it)| of(name, it, 1.0 - 3.0 * width(it))).collect();
    let rest = NAMES.iter().zip(&found.intervals).zip(found.learned);
    all.extend(rest.map(|((name, interval), learned)| of(name, interval, learned)));
    all
}

fn sideslip_summary(
    found: &SideslipFit,
    score: Option<SideslipScore>,
    parts: &[(&EvenDrive, SideslipEstimate, Option<f64>)],
    held_out: bool,
) -> Vec<String> {
    let mut summary = Vec::new();
    if !found.converged {
        summary.push(
            "The search for the tires did not come to an end: do not use them. Give more of both turns, or a better `car.body`.".to_owned(),
        );
    }
    if let Some(score) = score {
        summary.push(format!(
            "v_y, which neither the fit nor the estimator saw, is estimated to {:.3} m/s, the sideslip angle to {:.2} deg (root mean \
             squares{}); {:.1} % of it lies in the 95 % band.",
            score.v_y,
            score.sideslip.to_degrees(),
            if held_out { ", on parts that were not fitted" } else { "" },
            100.0 * score.coverage
        ));
    } else {
        summary.push("v_y is estimated; nobody measured it, so nobody can judge it here.".to_owned());
    }
    if let Some(lap) = parts.iter().find_map(|(_, _, lap)| *lap) {
        summary.push(format!("The bank of the road is learnt over laps of {lap:.0} m from what was fitted."));
    }
    summary
}

/// Ten rows a second are enough for a picture of a minute.
fn sideslip_trace(drive: &EvenDrive, estimate: &SideslipEstimate) -> SideslipTrace {
    let stride = ((0.1 / drive.step).round() as usize).max(1);
    let first = drive.counts.iter().position(|counts| *counts).unwrap_or(0);
    let rows =
        (first..drive.row_count()).take_while(|row| drive.motion.t[*row] < drive.motion.t[first] + 110.0);
    rows.step_by(stride)
        .filter(|row| drive.counts[*row])
        .map(|row| (drive.motion.t[row], estimate.v_y[row], estimate.v_y_std[row], drive.motion.v_y[row]))
        .collect()
}
