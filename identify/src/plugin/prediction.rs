//! Identifies a car that predicts drives, and judges it, beside simple models, on parts that were not fitted.

use drive_prediction::agreement::rate_model;
use drive_prediction::baseline::fit_baseline_models;
use drive_prediction::car::fit::FittedCar;
use drive_prediction::car::parameters::{COUNT, LAG, ParameterPrior};
use drive_prediction::car::{CarPredictor, SteeringSignalKind};
use drive_prediction::predictor::LateralState;
use drive_prediction::resampling::resample_log;
use drive_prediction::rollout::simulate_rollouts;
use drive_prediction::score::{BAND, RolloutScore, open_loop, score_lateral_acceleration};
use drive_prediction::steering_map;
use drive_prediction::{EvenDrive, MotionPredictor};
use numerics::text::with_std;
use plugin::{AnalysisRequest, AnalysisServices, ResultSummary, ResultTable, ResultTableRow};
use preparation::{DriveLog, Signal};
use serde::Serialize;
use serde_json::{Map, Value, json};
use tire_inference::verdict::Identifiability;
use vehicle::VehicleBody;

use super::{doctor, drive_log, report_progress, sideslip};
use crate::assessment::{ModelAssessment, ParameterAssessment, PredictionTrace};
use crate::conclusion::{Conclusion, EngineeringValue, Reservation, axle_values};
use crate::config::PredictionConfig;
use crate::page;

/// Signals that nothing works without.
const NEEDED: [&str; 3] = ["v_x", "r", "delta"];

/// Does `task = "prediction"`.
///
/// # Errors
/// When the signals cannot be used, nothing is left to fit or to judge, or the program asked to give up.
pub(super) fn run_prediction(
    config: &PredictionConfig,
    request: &AnalysisRequest,
    host: &mut dyn AnalysisServices,
) -> Result<Value, String> {
    report_progress(host, 0.0, "reading the drives")?;
    let raw = with_wheel_angles(config, drive_log(request));
    let all = resample_log(&raw, &config.resampling_options()).map_err(|error| error.to_string())?;
    let [fitted, held] = config.split_fitted_and_held_out(&all);
    if fitted.is_empty() {
        return Err("expected rows to fit, found none: `hold_out` has all of them".to_owned());
    }
    if held.is_empty() && !config.hold_out.is_empty() {
        return Err("expected rows in `hold_out`, found none: look at its times, laps and logs".to_owned());
    }
    let car = config.car_specification().map_err(|error| error.to_string())?;
    let log = doctor::examine_car_log(&raw, &car.body, None);
    if config.hide_v_y || request.find_signal("v_y").is_none() {
        return sideslip::run_sideslip_estimation(&car, &log, config, [&fitted, &held], host);
    }
    report_progress(host, 0.1, "fitting the car")?;
    let identified = CarPredictor::fit(&fitted, &car).map_err(|error| error.to_string())?;
    report_progress(host, 0.6, "fitting the simple models")?;
    let lag = match car.steering {
        SteeringSignalKind::Measured => 0.0,
        SteeringSignalKind::Commanded => identified.fitted.parameters[LAG],
    };
    let simple = fit_baseline_models(&fitted, &car.body, lag);
    let mut found = assess_parameters(&identified.fitted);
    let refused = log.refusing_finding().map(|it| it.sentence.clone());
    if let Some(sentence) = &refused {
        found.iter_mut().for_each(|it| it.cap_verdict(sentence));
    }
    let mut models: Vec<&dyn MotionPredictor> = vec![&identified];
    models.extend(simple.iter().map(AsRef::as_ref));
    report_progress(host, 0.8, "letting the models go")?;
    let judged_on = if held.is_empty() { &fitted } else { &held };
    let judged: Vec<ModelAssessment> =
        models.iter().map(|model| assess_model(*model, judged_on, &config.horizons)).collect();
    let mut summary = prediction_summary(&judged, &found, !held.is_empty());
    let reservation = match doctor::warn_about_findings(&log, &mut summary) {
        Reservation::None if held.is_empty() => not_held_out(),
        reservation => reservation,
    };
    let conclusion =
        Conclusion { values: car_values(&found, &car.body), reservation, ..Conclusion::default() };
    let longest = config.horizons.iter().copied().fold(0.0, f64::max);
    let drawn = judged_on.iter().take(DRAWN_DRIVES);
    let traces: Vec<PredictionTrace> =
        drawn.filter_map(|drive| prediction_trace(models[0], drive, longest)).collect();
    let html = page::prediction::render_prediction_page(
        &judged,
        &found,
        &car.body,
        &traces,
        page::prediction::PredictionWords {
            summary: &summary,
            conclusion: &conclusion,
            parts: &describe_parts(&fitted, &held),
        },
    );
    summary.splice(1..1, conclusion.sentences());
    host.write_file("prediction.html", &html);
    let scores: Map<String, Value> = judged.iter().map(|it| (it.name.replace(' ', "_"), json!(it))).collect();
    let words = ResultSummary {
        sound: !held.is_empty() && refused.is_none(),
        tables: [model_table(&judged)]
            .into_iter()
            .chain(conclusion.table())
            .chain([parameter_table(&found)])
            .collect(),
        summary,
    };
    let car: Map<String, Value> = found.into_iter().map(|it| (it.name.clone(), json!(it))).collect();
    Ok(json!(PredictionResult { words, held_out: !held.is_empty(), scores, car }))
}

/// The result of the task.
#[derive(Serialize)]
struct PredictionResult {
    #[serde(flatten)]
    words: ResultSummary,
    /// Whether the scores are of parts that were not fitted.
    held_out: bool,
    /// By the name of the model.
    scores: Map<String, Value>,
    /// By the name of the parameter.
    car: Map<String, Value>,
}

/// Name, what it is, unit and whether it is estimated as a logarithm, in the order of the estimate.
const PARAMETERS: [(&str, &str, &str, bool); COUNT] = [
    ("front_K", "cornering stiffness over load, front", "1/rad", true),
    ("rear_K", "cornering stiffness over load, rear", "1/rad", true),
    ("front_D", "peak friction coefficient, front", "", true),
    ("rear_D", "peak friction coefficient, rear", "", true),
    ("I_zz", "yaw moment of inertia", "kg.m2", true),
    ("offset", "offset of the steering angle", "rad", false),
    ("rear_shift", "shift of the rear slip angle", "rad", false),
    ("lag", "time constant of the steering", "s", false),
    ("front_C", "shape factor, front", "", false),
    ("rear_C", "shape factor, rear", "", false),
    ("h", "height of the centre of gravity that moves forces", "m", false),
    ("combined", "share of the friction ellipse", "", false),
];

/// The parameters with their verdicts.
fn assess_parameters(fitted: &FittedCar) -> Vec<ParameterAssessment> {
    let prior = ParameterPrior::new(&fitted.car);
    let of = |(i, (name, what, unit, logarithm)): (usize, (&str, &'static str, &'static str, bool))| {
        let (mean, std) = (fitted.parameters[i], fitted.parameter_std[i]);
        let ends = [-BAND[0], BAND[0]].map(|it| mean + it * std);
        let [value, low, high] = [mean, ends[0], ends[1]].map(|it| if logarithm { it.exp() } else { it });
        let factor = if logarithm { value } else { 1.0 };
        let share = std / prior.std[i];
        let verdict = Identifiability::from_width(share);
        let reason = format!("The logs leave {:.0} % of the width that was plausible before.", 100.0 * share);
        let between = prior.between[i] * factor;
        let (name, std, interval) = (name.to_owned(), std * factor, [low, high]);
        ParameterAssessment { name, what, unit, value, std, interval, between, verdict, reason }
    };
    PARAMETERS.into_iter().enumerate().map(of).collect()
}

/// The axles as a test engineer knows them.
fn car_values(found: &[ParameterAssessment], body: &VehicleBody) -> Vec<EngineeringValue> {
    let value = |name: &str| {
        let it = found.iter().find(|it| it.name == name)?;
        let ParameterAssessment { value, interval, verdict, .. } = *it;
        Some(EngineeringValue { title: String::new(), unit: "", value, interval, verdict })
    };
    let both = |front, rear| Some([value(front)?, value(rear)?]);
    let stiffness = both("front_K", "rear_K").zip(both("front_D", "rear_D"));
    stiffness.map_or_else(Vec::new, |(stiffness, peaks)| axle_values(stiffness, peaks, body))
}

/// What speaks against scores of the data that were fitted.
fn not_held_out() -> Reservation {
    Reservation::Refusal {
        cause: "The scores are of the data that were fitted.".to_owned(),
        remedy: Some("another drive like it, or keep a part of this one by `hold_out`".to_owned()),
    }
}

/// A row for each parameter.
fn parameter_table(found: &[ParameterAssessment]) -> ResultTable {
    let row = |it: &ParameterAssessment| {
        let value = with_std(it.value, it.std);
        [
            it.name.clone(),
            value,
            it.unit.to_owned(),
            it.verdict.to_display_text().to_owned(),
            it.reason.clone(),
        ]
    };
    ResultTable::new(["parameter", "value", "unit", "verdict", "reason"], found.iter().map(row))
}

/// Whether the signals are here that nothing works without.
///
/// # Errors
/// With all that are missing.
pub(super) fn check_required_signals(
    config: &PredictionConfig,
    request: &AnalysisRequest,
) -> Result<(), String> {
    let needed = NEEDED.into_iter().chain(config.hide_v_y.then_some("v_y"));
    let missing: Vec<_> = needed.filter(|name| request.find_signal(name).is_none()).collect();
    match missing.is_empty() {
        true => Ok(()),
        false => Err(format!("expected the signals {}, which are missing", missing.join(", "))),
    }
}

/// The log with the angles of the wheels [rad], but for a lag and an offset, in place of the signal `delta`.
fn with_wheel_angles<'a>(config: &PredictionConfig, mut log: DriveLog<'a>) -> DriveLog<'a> {
    if let Some(Signal { time, value }) = log.get("delta") {
        let angles: Vec<f64> =
            value.iter().map(|it| steering_map::road_wheel_angle(&config.steering_map, *it)).collect();
        let angles = steering_map::apply_steering_play(&angles, config.steering_play);
        log.insert("delta", time.to_vec(), angles);
    }
    log
}

fn assess_model(model: &dyn MotionPredictor, drives: &[EvenDrive], horizons: &[f64]) -> ModelAssessment {
    let ahead = horizons.iter().filter_map(|horizon| open_loop(model, drives, *horizon));
    let open_loop: Vec<RolloutScore> = ahead.collect();
    let longest = open_loop.iter().map(|it| it.horizon).fold(0.0, f64::max);
    let iso_18571 = rate_model(model, drives, longest);
    let name = model.name().to_owned();
    ModelAssessment { name, a_y: score_lateral_acceleration(model, drives), open_loop, iso_18571 }
}

/// How much of a drive is drawn [s], and of how many drives.
const DRAWN: f64 = 60.0;
const DRAWN_DRIVES: usize = 3;

/// Predictions one after the other over `horizon` [s], of the first rows of each drive that count.
fn prediction_trace(model: &dyn MotionPredictor, drive: &EvenDrive, horizon: f64) -> Option<PredictionTrace> {
    let first = drive.counts.iter().position(|counts| *counts)?;
    let until = drive.motion.t[first] + DRAWN;
    let rows: Vec<usize> =
        (first..drive.row_count()).take_while(|row| drive.motion.t[*row] <= until).collect();
    let shown = |row: usize| {
        let state = [drive.motion.v_y[row], drive.motion.r[row]];
        (drive.motion.t[row], if drive.counts[row] { state } else { [f64::NAN; 2] })
    };
    let mut free = first;
    let mut predicted = Vec::new();
    for rollout in simulate_rollouts(model, drive, horizon) {
        let end = rollout.start + rollout.predicted.len() - 1;
        if rollout.start < free || drive.motion.t[end] > until {
            continue;
        }
        free = end;
        let spread = |k: usize| rollout.spread.as_ref().map(|it| it[k]);
        let moment =
            |(k, state): (usize, &LateralState)| (drive.motion.t[rollout.start + k], *state, spread(k));
        predicted.push(rollout.predicted.iter().enumerate().map(moment).collect());
    }
    let measured = rows.into_iter().map(shown).collect();
    Some(PredictionTrace { name: drive.name.clone(), measured, predicted })
}

/// What was fitted, and what the scores are of.
fn describe_parts(fitted: &[EvenDrive], held: &[EvenDrive]) -> String {
    let part = |drive: &EvenDrive| {
        let times = || drive.counted_values(&drive.motion.t);
        let rows = times().count();
        let ends = [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)];
        format!("{}, {:.1} to {:.1} s, {rows} rows", drive.name, ends[0], ends[1])
    };
    let list = |drives: &[EvenDrive]| drives.iter().map(part).collect::<Vec<_>>().join("; ");
    let judged = match held.is_empty() {
        true => "Errors are of the same parts.".to_owned(),
        false => format!("Errors are of parts that were not fitted: {}.", list(held)),
    };
    let fitted = list(fitted);
    format!("Fitted: {fitted}. {judged} Faint numbers are 95 % intervals, from blocks of time.")
}

fn prediction_summary(
    judged: &[ModelAssessment],
    found: &[ParameterAssessment],
    held_out: bool,
) -> Vec<String> {
    let mut summary = vec![verdict_sentence(judged)];
    let is_unknown = |it: &&ParameterAssessment| it.verdict == Identifiability::NotIdentifiable;
    let unknown: Vec<&str> = found.iter().filter(is_unknown).map(|it| it.name.as_str()).collect();
    if !unknown.is_empty() {
        summary.push(format!("The logs do not tell {}.", unknown.join(", ")));
    }
    if !held_out {
        let doubt = "The scores are of the data that were fitted: they say little of other drives. Name a part that is kept by `hold_out`.";
        summary.push(doubt.to_owned());
    }
    for score in judged.iter().flat_map(|it| it.open_loop.iter().map(move |score| (it, score))) {
        let (model, score) = score;
        if score.spun > 0.0 {
            summary.push(format!(
                "{}: {:.1} % of the predictions over {} s end in a spin that did not happen.",
                model.name,
                100.0 * score.spun,
                score.horizon
            ));
        }
    }
    summary
}

/// How the identified car does beside the best of the simple models.
fn verdict_sentence(judged: &[ModelAssessment]) -> String {
    let longest = |it: &ModelAssessment| it.open_loop.last().copied();
    let Some((car, score)) = judged.first().and_then(|it| Some((it, longest(it)?))) else {
        return "No stretch is long enough for a prediction.".to_owned();
    };
    let others = || judged[1..].iter().filter_map(longest);
    let best = |of: fn(&RolloutScore) -> f64| others().map(|it| of(&it)).fold(f64::INFINITY, f64::min);
    let a_y = car.a_y.map_or(String::new(), |it| format!(", a_y to {:.3} m/s2", it.rmse));
    format!(
        "Over {} s the car predicts v_y to {:.3} m/s, the yaw rate to {:.3} rad/s and the place to {:.2} m (least of any simple model: {:.3}, {:.3}, \
         {:.2}){a_y}.",
        score.horizon,
        score.v_y,
        score.r,
        score.position,
        best(|it| it.v_y),
        best(|it| it.r),
        best(|it| it.position)
    )
}

/// A row for each model.
fn model_table(judged: &[ModelAssessment]) -> ResultTable {
    let mut head = vec!["model".to_owned(), "a_y [m/s2]".to_owned()];
    let horizons = judged.iter().map(|it| &it.open_loop).max_by_key(|it| it.len());
    for score in horizons.into_iter().flatten() {
        let horizon = score.horizon;
        head.extend(["v_y [m/s]", "r [rad/s]", "position [m]"].map(|it| format!("{it}, {horizon} s")));
    }
    let row = |it: &ModelAssessment| {
        let a_y = it.a_y.map_or("–".to_owned(), |score| format!("{:.3}", score.rmse));
        let mut row = vec![it.name.clone(), a_y];
        for score in &it.open_loop {
            row.extend([score.v_y, score.r, score.position].map(|it| format!("{it:.4}")));
        }
        ResultTableRow(row)
    };
    ResultTable { head, rows: judged.iter().map(row).collect() }
}
