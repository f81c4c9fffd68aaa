//! Estimates errors of sensors by themselves, where the configuration asks for it.

use drive_doctor::LogExamination;
use drive_inference::calibration::{SensorErrorAssessment, assess_sensor_errors};
use drive_inference::{Drive, DriveOptions};
use numerics::text::format_significant;
use plugin::AnalysisServices;
use tire_inference::model::ModelVerdict;
use tire_inference::verdict::Identifiability;

use crate::config::ClosedLoop;
use crate::plugin::report_progress;

/// The errors of sensors that are wanted by themselves; none can be told of a log that is wrong.
pub(super) fn assess_sensors(
    config: &ClosedLoop,
    options: &DriveOptions,
    used: &[Drive],
    log: &LogExamination,
    model: &ModelVerdict,
    host: &mut dyn AnalysisServices,
) -> Result<Vec<SensorErrorAssessment>, String> {
    if config.calibrate.is_empty() {
        return Ok(Vec::new());
    }
    report_progress(host, 0.9, "calibrating sensors")?;
    let mut judged =
        assess_sensor_errors(&options.car, used, &config.calibrate).map_err(|error| error.to_string())?;
    // A model that does not fit the drive tells no error of a sensor.
    judged.iter_mut().for_each(|it| model.cap_verdict_and_reason(&mut it.verdict, &mut it.reason));
    if let Some(refusal) = log.refusing_finding() {
        for it in &mut judged {
            it.verdict = Identifiability::NotIdentifiable;
            it.reason = format!("The log is wrong: {}", refusal.sentence);
        }
    }
    Ok(judged)
}

/// Each error with its interval and verdict in a sentence.
pub(super) fn describe_sensor_errors(judged: &[SensorErrorAssessment]) -> impl Iterator<Item = String> {
    judged.iter().map(|it| {
        let about = it.error.cause.describe();
        let (factor, unit) = about.display;
        let [value, low, high] = [it.error.value, it.error.interval[0], it.error.interval[1]]
            .map(|number| format_significant(factor * number, 3));
        let verdict = it.verdict.to_display_text();
        format!("By itself, {} is {value} {unit} [{low}, {high}], {verdict}: {}", about.title, it.reason)
    })
}
