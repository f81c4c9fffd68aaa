//! Estimates errors of sensors by themselves, where the configuration asks for it.

use drive_doctor::Examination;
use drive_inference::calibration::{Judged, judge};
use drive_inference::{Drive, DriveOptions};
use plugin::Host;
use tire_inference::verdict::Verdict;

use crate::config::ClosedLoop;
use crate::plugin::go_on;

/// The errors of sensors that are wanted by themselves; none can be told of a log that is wrong.
pub(super) fn judged(
    config: &ClosedLoop,
    options: &DriveOptions,
    (used, log): (&[Drive], &Examination),
    host: &mut dyn Host,
) -> Result<Vec<Judged>, String> {
    if config.calibrate.is_empty() {
        return Ok(Vec::new());
    }
    go_on(host, 0.9, "calibrating sensors")?;
    let mut judged =
        judge(&options.car, used, &config.calibrate).map_err(|error| error.to_string())?;
    if let Some(refusal) = log.refusal() {
        for it in &mut judged {
            it.verdict = Verdict::NotIdentifiable;
            it.reason = format!("The log is wrong: {}", refusal.sentence);
        }
    }
    Ok(judged)
}
