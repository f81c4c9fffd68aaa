//! Examines a log before tires are identified from it, or for its own sake, and lets what is found weigh on verdicts.

use drive_doctor::{
    CHANNELS, CarData, CorrectionTarget, Examination, Finding, SteeringMap, SteeringPoint, examine,
    steering_map,
};
use numerics::text::significant;
use plugin::{Host, Request, ResultSummary, Table};
use preparation::{Drive, DriveLog, Interpolation, Span};
use serde::Serialize;
use serde_json::{Value, json};
use tire_inference::estimate::Estimate;
use tire_inference::model::{CauseEstimate, Fit, ModelVerdict};
use vehicle::Body;

use crate::config::Doctor;
use crate::loads::AxleLoadEffects;
use crate::page::doctor;
use crate::plugin::drive_log;
use crate::summary::IdentificationSummary;

/// Does `task = "doctor"`.
pub(super) fn task(config: &Doctor, request: &Request, host: &mut dyn Host) -> Value {
    let mut seen = drive_log(request);
    if config.staircase {
        // A command is no angle: no relation of the motion holds for it.
        seen.remove("delta");
    }
    let found = examine(&seen, &config.car());
    host.file("doctor.html", &doctor::page(&found));
    let mut tables = corrections(&found);
    let staircase = config.staircase.then(|| staircase(request, config));
    let verdict = match (found.is_ill(), found.too_short) {
        (true, _) => "found",
        (_, true) => "cannot_tell",
        _ => "nothing",
    };
    let mut summary = found.summary();
    match &staircase {
        Some(Ok(map)) => {
            summary.push(mapped(map));
            tables.push(points(map));
        }
        Some(Err(refused)) => summary.push(format!("{refused}.")),
        None => {}
    }
    let words = ResultSummary { summary, sound: verdict == "nothing", tables };
    let steering_map = staircase.and_then(Result::ok);
    json!(Outcome { words, verdict, steering_map, doctor: &found })
}

/// Whether there is something to look at.
///
/// # Errors
/// When no signal is one of a drive.
pub(super) fn check(request: &Request) -> Result<(), String> {
    let known = |name: &&str| request.signal(name).is_some();
    let names = CHANNELS.map(|(name, _)| name);
    match names.iter().any(known) {
        true => Ok(()),
        false => Err(format!("expected signals of a drive, found none of {}", names.join(", "))),
    }
}

/// What is wrong with the log of a car.
pub(super) fn of_car(log: &DriveLog, body: &Body) -> Examination {
    let car = CarData { wheelbase: None, axles: Some([body.l_f, body.l_r]), m: Some(body.m) };
    let mut found = examine(log, &car);
    // Where time has a gap, a recording ends and another one begins: the task says so itself.
    found.findings.retain(|it| it.check != "gap");
    found
}

/// What is wrong with the stretches of a log that are used. All its signals count, those too that only the doctor knows what to do
/// with, such as the speeds of wheels.
pub(super) fn of_drives(drives: &[Drive], log: &DriveLog, body: &Body) -> Examination {
    let ends = |drive: &Drive| Some(Span { start: *drive.t.first()?, end: *drive.t.last()? });
    let stretches: Vec<Span> = drives.iter().filter_map(ends).collect();
    of_car(&log.within(&stretches), body)
}

/// The verdict on a model whose log has an error that no fit makes up for; `model` otherwise.
pub(super) fn judge(found: &Examination, model: ModelVerdict) -> ModelVerdict {
    let Some(refusal) = found.refusal() else { return model };
    let sentence = format!("The log is wrong: {}", refusal.sentence);
    ModelVerdict { verdict: Fit::DoesNotFit, sentence, ..model }
}

/// Puts what is found into what is told.
pub(super) fn tell(found: &Examination, overall: &mut IdentificationSummary) {
    overall.model = judge(found, std::mem::take(&mut overall.model));
    // Where no stiffness is to be had from the log, this is what it says of the tires.
    let gradient = found.understeer.as_ref().filter(|_| found.refusal().is_some());
    overall.log.extend(gradient.map(|it| format!("Log: {}", it.sentence)));
    let refusal = found.refusal().map(|it| &it.sentence);
    let others = found.serious().filter(|it| Some(&it.sentence) != refusal);
    // Lines of a column say what is to be written; advice is a sentence of its own.
    let advice = |it: &Finding| match (it.correction.place, it.channels.as_slice()) {
        (Some(CorrectionTarget::Column), [channel]) => {
            format!("Column {channel}: {}.", it.correction.text)
        }
        _ => it.correction.text.clone(),
    };
    overall.log.extend(others.map(|it| format!("Log: {} {}", it.sentence, advice(it))));
}

/// Puts what is wrong with the log into sentences: before the others what no fit makes up for.
pub(super) fn warn(found: &Examination, summary: &mut Vec<String>) {
    let mut overall = IdentificationSummary::default();
    tell(found, &mut overall);
    if found.refusal().is_some() {
        summary.insert(0, overall.model.sentence);
    }
    summary.extend(overall.log);
}

/// Caps the verdicts of an estimate by an error of the log that no fit makes up for.
pub(super) fn cap(found: &Examination, estimate: &mut Estimate) {
    let model = judge(found, ModelVerdict::default());
    for (name, verdict) in &mut estimate.identified {
        model.cap_with(verdict, estimate.reason.entry(*name).or_default());
    }
}

/// Caps what is told of loads and longitudinal forces from such a log.
pub(super) fn cap_loads(found: &Examination, loads: &mut [AxleLoadEffects]) {
    let model = judge(found, ModelVerdict::default());
    for effect in loads.iter_mut().flat_map(AxleLoadEffects::effects_mut) {
        model.cap_with(&mut effect.verdict, &mut effect.reason);
    }
}

/// Caps the verdicts of errors that were estimated from such a log.
pub(super) fn cap_causes(found: &Examination, causes: &mut [CauseEstimate]) {
    let model = judge(found, ModelVerdict::default());
    causes.iter_mut().for_each(|cause| cause.verdict = model.cap(cause.verdict));
}

/// The map of the steering, at the time stamps of the command.
fn staircase(request: &Request, config: &Doctor) -> Result<SteeringMap, String> {
    let signal = |name: &str| {
        let signal = request.signal(name);
        signal.ok_or_else(|| format!("expected the signal `{name}` of a staircase, found none"))
    };
    let (command, v_x, r) = (signal("delta")?, signal("v_x")?, signal("r")?);
    let car = config.car();
    let wheelbase = car.wheelbase.or(car.axles.map(|[l_f, l_r]| l_f + l_r)).unwrap_or(f64::NAN);
    let at = |signal: plugin::Signal| -> Vec<f64> {
        Interpolation::Linear.resample(signal.time, signal.values, command.time)
    };
    steering_map(command.time, command.values, &at(v_x), &at(r), wheelbase)
}

fn mapped(map: &SteeringMap) -> String {
    let milli = |angle: f64| significant(1e3 * angle, 3);
    let play = match (map.play, map.play_interval) {
        (Some(play), Some([low, high])) => {
            format!("the play is {} mrad [{}, {}]", milli(play), milli(low), milli(high))
        }
        (Some(play), None) => format!("the play is {} mrad", milli(play)),
        (None, _) => "the play is not told".to_owned(),
    };
    let advice = map.advice.map_or(String::new(), |advice| format!(" {advice}"));
    format!(
        "The staircase tells {} points of the map of the steering; {play}.{advice}",
        map.points.len()
    )
}

fn points(map: &SteeringMap) -> Table {
    let row = |it: &SteeringPoint| {
        let ends = it.interval.map(|end| significant(end, 4));
        [
            significant(it.command, 4),
            significant(it.angle, 4),
            format!("{} to {}", ends[0], ends[1]),
        ]
    };
    Table::new(["command", "angle [rad]", "95 % interval"], map.points.iter().map(row))
}

/// The result of the task.
#[derive(Serialize)]
struct Outcome<'a> {
    #[serde(flatten)]
    words: ResultSummary,
    /// For checks of a scenario.
    verdict: &'static str,
    /// Where a staircase tells it.
    steering_map: Option<SteeringMap>,
    doctor: &'a Examination,
}

/// A row for each finding: how sure, which channels, the line to write.
fn corrections(found: &Examination) -> Vec<Table> {
    let row = |it: &Finding| {
        [it.sure.word().to_owned(), it.channels.join(", "), it.correction.text.clone()]
    };
    let rows = found.findings.iter().map(row);
    let table = || Table::new(["sure", "channel", "to correct it"], rows);
    if found.findings.is_empty() { Vec::new() } else { vec![table()] }
}
