//! Examines a log before tires are identified from it, or for its own sake, and lets what is found weigh on verdicts.

use drive_doctor::{CHANNELS, Examination, Finding, KnownCar, Place, examine};
use drive_inference::Drive;
use plugin::{Host, Request, Table, Words};
use preparation::DriveLog;
use serde::Serialize;
use serde_json::{Value, json};
use tire_inference::estimate::Estimate;
use tire_inference::model::{CauseEstimate, Fit, ModelVerdict};
use vehicle::Body;

use crate::config::Doctor;
use crate::page::doctor;
use crate::told::Overall;

/// Does `task = "doctor"`.
pub(super) fn task(config: &Doctor, request: &Request, host: &mut dyn Host) -> Value {
    let found = examine(&log(request), &config.car());
    host.file("doctor.html", &doctor::page(&found));
    let tables = corrections(&found);
    let verdict = match (found.is_ill(), found.too_short) {
        (true, _) => "found",
        (_, true) => "cannot_tell",
        _ => "nothing",
    };
    let words = Words { summary: found.summary(), sound: verdict == "nothing", tables };
    json!(Outcome { words, verdict, doctor: &found })
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

/// The signals as they are.
pub(super) fn log(request: &Request) -> DriveLog {
    let mut log = DriveLog::default();
    for signal in &request.signals {
        log.insert(signal.name, signal.time.to_vec(), signal.values.to_vec());
    }
    log
}

/// What is wrong with the log of a car.
pub(super) fn of_car(log: &DriveLog, body: &Body) -> Examination {
    let car = KnownCar { wheelbase: None, axles: Some([body.l_f, body.l_r]), m: Some(body.m) };
    let mut found = examine(log, &car);
    // Where time has a gap, a recording ends and another one begins: the task says so itself.
    found.findings.retain(|it| it.check != "gap");
    found
}

/// What is wrong with the stretches that are used. Signals that only the doctor knows what to do with, such as the speeds of
/// wheels, count too.
pub(super) fn of_drives(drives: &[Drive], request: &Request, body: &Body) -> Examination {
    let mut log = DriveLog::default();
    let ends = |drive: &Drive| Some([*drive.t.first()?, *drive.t.last()?]);
    let stretches: Vec<[f64; 2]> = drives.iter().filter_map(ends).collect();
    let is_used = |t: f64| stretches.iter().any(|[from, until]| (*from..=*until).contains(&t));
    for signal in &request.signals {
        let rows = signal.time.iter().zip(signal.values).filter(|(t, _)| is_used(**t));
        let (time, values) = rows.unzip();
        log.insert(signal.name, time, values);
    }
    let time: Vec<f64> = drives.iter().flat_map(|drive| drive.t.iter().copied()).collect();
    let names = Drive::default().columns().map(|(name, _)| name);
    for (place, name) in names.into_iter().enumerate().skip(1) {
        let values = drives.iter().flat_map(|drive| drive.columns()[place].1.iter().copied());
        log.insert(name, time.clone(), values.collect());
    }
    of_car(&log, body)
}

/// The verdict on a model whose log has an error that no fit makes up for; `model` otherwise.
pub(super) fn judge(found: &Examination, model: ModelVerdict) -> ModelVerdict {
    let Some(refusal) = found.refusal() else { return model };
    let sentence = format!("The log is wrong: {}", refusal.sentence);
    ModelVerdict { verdict: Fit::DoesNotFit, sentence, ..model }
}

/// Puts what is found into what is told.
pub(super) fn tell(found: &Examination, overall: &mut Overall) {
    overall.model = judge(found, std::mem::take(&mut overall.model));
    // Where no stiffness is to be had from the log, this is what it says of the tires.
    let gradient = found.understeer.as_ref().filter(|_| found.refusal().is_some());
    overall.log.extend(gradient.map(|it| format!("Log: {}", it.sentence)));
    let refusal = found.refusal().map(|it| &it.sentence);
    let others = found.serious().filter(|it| Some(&it.sentence) != refusal);
    // Lines of a column say what is to be written; advice is a sentence of its own.
    let advice = |it: &Finding| match (it.correction.place, it.channels.as_slice()) {
        (Some(Place::Column), [channel]) => format!("Column {channel}: {}.", it.correction.text),
        _ => it.correction.text.clone(),
    };
    overall.log.extend(others.map(|it| format!("Log: {} {}", it.sentence, advice(it))));
}

/// Caps the verdicts of an estimate by an error of the log that no fit makes up for.
pub(super) fn cap(found: &Examination, estimate: &mut Estimate) {
    let model = judge(found, ModelVerdict::default());
    for (name, verdict) in &mut estimate.identified {
        model.cap_with(verdict, estimate.reason.entry(name.clone()).or_default());
    }
}

/// Caps the verdicts of errors that were estimated from such a log.
pub(super) fn cap_causes(found: &Examination, causes: &mut [CauseEstimate]) {
    let model = judge(found, ModelVerdict::default());
    causes.iter_mut().for_each(|cause| cause.verdict = model.cap(cause.verdict));
}

/// The result of the task.
#[derive(Serialize)]
struct Outcome<'a> {
    #[serde(flatten)]
    words: Words,
    /// For checks of a scenario.
    verdict: &'static str,
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
