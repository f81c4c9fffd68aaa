//! Estimates errors of sensors by themselves, where the configuration asks for it.

use drive_doctor::Examination;
use drive_inference::calibration::{CalibrationAssessment, assess};
use drive_inference::{Drive, DriveOptions};
use numerics::text::significant;
use plugin::Host;
use tire_inference::model::ModelVerdict;
use tire_inference::verdict::Verdict;

use crate::config::ClosedLoop;
use crate::names::words;
use crate::plugin::go_on;

/// The errors of sensors that are wanted by themselves; none can be told of a log that is wrong.
pub(super) fn assess_sensors(
    config: &ClosedLoop,
    options: &DriveOptions,
    used: &[Drive],
    log: &Examination,
    model: &ModelVerdict,
    host: &mut dyn Host,
) -> Result<Vec<CalibrationAssessment>, String> {
    if config.calibrate.is_empty() {
        return Ok(Vec::new());
    }
    go_on(host, 0.9, "calibrating sensors")?;
    let mut judged =
        assess(&options.car, used, &config.calibrate).map_err(|error| error.to_string())?;
    // A model that does not fit the drive tells no error of a sensor.
    judged.iter_mut().for_each(|it| model.cap_with(&mut it.verdict, &mut it.reason));
    if let Some(refusal) = log.refusal() {
        for it in &mut judged {
            it.verdict = Verdict::NotIdentifiable;
            it.reason = format!("The log is wrong: {}", refusal.sentence);
        }
    }
    Ok(judged)
}

/// Each error with its interval and verdict in a sentence.
pub(super) fn sentences(judged: &[CalibrationAssessment]) -> impl Iterator<Item = String> {
    judged.iter().map(|it| {
        let about = it.error.cause.describe();
        let (factor, unit) = about.display;
        let [value, low, high] = [it.error.value, it.error.interval[0], it.error.interval[1]]
            .map(|number| significant(factor * number, 3));
        let verdict = words(it.verdict);
        format!(
            "By itself, {} is {value} {unit} [{low}, {high}], {verdict}: {}",
            about.title, it.reason
        )
    })
}
