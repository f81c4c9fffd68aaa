//! Examines a log before tires are identified from it, or for its own sake, and lets what is found weigh on verdicts.

use drive_doctor::{
    CHANNELS, CarData, CorrectionTarget, LogExamination, LogFinding, SteeringMap, SteeringPoint, examine_log,
    steering_map,
};
use numerics::text::format_significant;
use plugin::{AnalysisRequest, AnalysisServices, ResultSummary, ResultTable};
use preparation::{Drive, DriveLog, Interpolation, TimeInterval};
use serde::Serialize;
use serde_json::{Value, json};
use tire_inference::estimate::TireEstimate;
use tire_inference::model::{ModelFit, ModelVerdict, SystematicErrorEstimate};
use vehicle::{Aerodynamics, VehicleBody};

use crate::conclusion::Reservation;
use crate::config::DoctorConfig;
use crate::loads::AxleLoadEffects;
use crate::page::doctor;
use crate::plugin::drive_log;
use crate::summary::{IdentificationSummary, LogDoubt};

/// Does `task = "doctor"`.
pub(super) fn run_doctor(
    config: &DoctorConfig,
    request: &AnalysisRequest,
    host: &mut dyn AnalysisServices,
) -> Value {
    let mut seen = drive_log(request);
    if config.staircase {
        // A command is no angle: no relation of the motion holds for it.
        seen.remove("delta");
    }
    let found = examine_log(&seen, &config.car_data());
    host.write_file("doctor.html", &doctor::render_doctor_page(&found));
    let mut tables = corrections_table(&found);
    let staircase = config.staircase.then(|| steering_map_of_staircase(request, config));
    let verdict = match (found.has_serious_finding(), found.too_short) {
        (true, _) => "found",
        (_, true) => "cannot_tell",
        _ => "nothing",
    };
    let mut summary = found.summary();
    match &staircase {
        Some(Ok(map)) => {
            summary.push(describe_steering_map(map));
            tables.push(steering_map_table(map));
        }
        Some(Err(refused)) => summary.push(format!("{refused}.")),
        None => {}
    }
    let words = ResultSummary { summary, sound: verdict == "nothing", tables };
    let steering_map = staircase.and_then(Result::ok);
    json!(DoctorResult { words, verdict, steering_map, doctor: &found })
}

/// Whether there is something to look at.
///
/// # Errors
/// When no signal is one of a drive.
pub(super) fn check_has_drive_signal(request: &AnalysisRequest) -> Result<(), String> {
    let known = |name: &&str| request.find_signal(name).is_some();
    let names = CHANNELS.map(|(name, _)| name);
    match names.iter().any(known) {
        true => Ok(()),
        false => Err(format!("expected signals of a drive, found none of {}", names.join(", "))),
    }
}

/// What is wrong with the log of a car.
pub(super) fn examine_car_log(
    log: &DriveLog,
    body: &VehicleBody,
    aero: Option<Aerodynamics>,
) -> LogExamination {
    let car = CarData { wheelbase: None, axles: Some([body.l_f, body.l_r]), m: Some(body.m), aero };
    let mut found = examine_log(log, &car);
    // Where time has a gap, a recording ends and another one begins: the task says so itself.
    found.findings.retain(|it| it.check != "gap");
    found
}

/// What is wrong with the stretches of a log that are used. All its signals count, those too that only the doctor knows what to do
/// with, such as the speeds of wheels.
pub(super) fn examine_drives(
    drives: &[Drive],
    log: &DriveLog,
    body: &VehicleBody,
    aero: Option<Aerodynamics>,
) -> LogExamination {
    let ends = |drive: &Drive| Some(TimeInterval { start: *drive.t.first()?, end: *drive.t.last()? });
    let stretches: Vec<TimeInterval> = drives.iter().filter_map(ends).collect();
    examine_car_log(&log.restricted_to_stretches(&stretches), body, aero)
}

/// The verdict on a model whose log has an error that no fit makes up for; `model` otherwise.
pub(super) fn cap_model_verdict(found: &LogExamination, model: ModelVerdict) -> ModelVerdict {
    let Some(refusal) = found.refusing_finding() else { return model };
    let sentence = format!("The log is wrong: {}", refusal.sentence);
    ModelVerdict { verdict: ModelFit::DoesNotFit, sentence, ..model }
}

/// Puts what is found into what is told.
pub(super) fn add_findings_to_summary(found: &LogExamination, overall: &mut IdentificationSummary) {
    overall.model = cap_model_verdict(found, std::mem::take(&mut overall.model));
    // Where no stiffness is to be had from the log, this is what it says of the tires.
    let gradient = found.understeer.as_ref().filter(|_| found.refusing_finding().is_some());
    overall.log.extend(gradient.map(|it| format!("Log: {}", it.sentence)));
    let refusal = found.refusing_finding().map(|it| &it.sentence);
    let worst = found.refusing_finding().or_else(|| found.serious_findings().next());
    let others = found.serious_findings().filter(|it| Some(&it.sentence) != refusal);
    // Lines of a column say what is to be written; advice is a sentence of its own.
    let advice = |it: &LogFinding| match (it.correction.place, it.channels.as_slice()) {
        (Some(CorrectionTarget::Column), [channel]) => {
            format!("Column {channel}: {}.", it.correction.text)
        }
        _ => it.correction.text.clone(),
    };
    overall.doubt = worst.map(|it| LogDoubt { finding: it.sentence.clone(), correction: advice(it) });
    overall.log.extend(others.map(|it| format!("Log: {} {}", it.sentence, advice(it))));
}

/// Puts what is wrong with the log into sentences, before the others what no fit makes up for, and says what speaks against the result.
pub(super) fn warn_about_findings(found: &LogExamination, summary: &mut Vec<String>) -> Reservation {
    let mut overall = IdentificationSummary::default();
    add_findings_to_summary(found, &mut overall);
    if found.refusing_finding().is_some() {
        summary.insert(0, overall.model.sentence.clone());
    }
    summary.append(&mut overall.log);
    overall.conclusion().reservation
}

/// Caps the verdicts of an estimate by an error of the log that no fit makes up for.
pub(super) fn cap_estimate_verdicts(found: &LogExamination, estimate: &mut TireEstimate) {
    let model = cap_model_verdict(found, ModelVerdict::default());
    for (name, verdict) in &mut estimate.identified {
        model.cap_verdict_and_reason(verdict, estimate.reason.entry(*name).or_default());
    }
}

/// Caps what is told of loads and longitudinal forces from such a log.
pub(super) fn cap_loads(found: &LogExamination, loads: &mut [AxleLoadEffects]) {
    let model = cap_model_verdict(found, ModelVerdict::default());
    for effect in loads.iter_mut().flat_map(AxleLoadEffects::effects_mut) {
        model.cap_verdict_and_reason(&mut effect.verdict, &mut effect.reason);
    }
}

/// Caps the verdicts of errors that were estimated from such a log.
pub(super) fn cap_causes(found: &LogExamination, causes: &mut [SystematicErrorEstimate]) {
    let model = cap_model_verdict(found, ModelVerdict::default());
    causes.iter_mut().for_each(|cause| cause.verdict = model.cap_verdict(cause.verdict));
}

/// The map of the steering, at the time stamps of the command.
fn steering_map_of_staircase(
    request: &AnalysisRequest,
    config: &DoctorConfig,
) -> Result<SteeringMap, String> {
    let signal = |name: &str| {
        let signal = request.find_signal(name);
        signal.ok_or_else(|| format!("expected the signal `{name}` of a staircase, found none"))
    };
    let (command, v_x, r) = (signal("delta")?, signal("v_x")?, signal("r")?);
    let car = config.car_data();
    let wheelbase = car.wheelbase.or(car.axles.map(|[l_f, l_r]| l_f + l_r)).unwrap_or(f64::NAN);
    let at = |signal: plugin::Signal| -> Vec<f64> {
        Interpolation::Linear.resample(signal.time, signal.values, command.time)
    };
    steering_map(command.time, command.values, &at(v_x), &at(r), wheelbase)
}

fn describe_steering_map(map: &SteeringMap) -> String {
    let milli = |angle: f64| format_significant(1e3 * angle, 3);
    let play = match (map.play, map.play_interval) {
        (Some(play), Some([low, high])) => {
            format!("the play is {} mrad [{}, {}]", milli(play), milli(low), milli(high))
        }
        (Some(play), None) => format!("the play is {} mrad", milli(play)),
        (None, _) => "the play is not told".to_owned(),
    };
    let advice = map.advice.map_or(String::new(), |advice| format!(" {advice}"));
    format!("The staircase tells {} points of the map of the steering; {play}.{advice}", map.points.len())
}

fn steering_map_table(map: &SteeringMap) -> ResultTable {
    let row = |it: &SteeringPoint| {
        let ends = it.interval.map(|end| format_significant(end, 4));
        [
            format_significant(it.command, 4),
            format_significant(it.angle, 4),
            format!("{} to {}", ends[0], ends[1]),
        ]
    };
    ResultTable::new(["command", "angle [rad]", "95 % interval"], map.points.iter().map(row))
}

/// The result of the task.
#[derive(Serialize)]
struct DoctorResult<'a> {
    #[serde(flatten)]
    words: ResultSummary,
    /// For checks of a scenario.
    verdict: &'static str,
    /// Where a staircase tells it.
    steering_map: Option<SteeringMap>,
    doctor: &'a LogExamination,
}

/// A row for each finding: how sure, which channels, the line to write.
fn corrections_table(found: &LogExamination) -> Vec<ResultTable> {
    let row =
        |it: &LogFinding| [it.sure.word().to_owned(), it.channels.join(", "), it.correction.text.clone()];
    let rows = found.findings.iter().map(row);
    let table = || ResultTable::new(["sure", "channel", "to correct it"], rows);
    if found.findings.is_empty() { Vec::new() } else { vec![table()] }
}
