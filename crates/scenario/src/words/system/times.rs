//! Proposes start, step and stop of a system's run: SSP has no step and no algorithm.

use diagnostics::Error;
use fmu_import::Fmu;

/// Steps of a run whose FMUs propose none, as fmpy takes them.
const STEPS: f64 = 500.0;

/// The times of a run [s], and where they come from.
pub(super) struct Proposed {
    pub start: f64,
    pub step: f64,
    pub stop: f64,
    /// Where the stop time comes from.
    pub origin: &'static str,
    /// Where the step comes from.
    pub reason: String,
}

/// The times that a system and its FMUs propose; the stop time is a multiple of `step`, if there is one already.
pub(super) fn proposed(
    system: &ssp::System,
    fmus: &[Fmu],
    step: Option<f64>,
) -> Result<Proposed, Error> {
    let start = system.experiment.start.unwrap_or(0.0);
    let latest = fmus.iter().filter_map(|fmu| fmu.description.default_stop).reduce(f64::max);
    let (stop, origin) = match (system.experiment.stop, latest) {
        (Some(stop), _) => (stop, "its DefaultExperiment"),
        (None, Some(stop)) => (stop, "the latest one that its FMUs propose"),
        (None, None) => (start + 1.0, "neither the system nor an FMU proposes one"),
    };
    if stop <= start || stop.is_nan() {
        return Err(Error::input(format!(
            "`{}`: expected a stop time after the start time {start} s, found {stop} s ({origin})",
            system.name
        )));
    }
    let duration = stop - start;
    let steps = fmus.iter().filter_map(|fmu| fmu.description.default_step);
    let steps = steps.filter(|step| *step > 0.0 && *step <= duration);
    let (step, reason) = match (step, steps.reduce(f64::min)) {
        (Some(step), _) => (step, String::new()),
        (None, Some(step)) => (step, "the shortest one that its FMUs propose".to_owned()),
        (None, None) => (duration / STEPS, format!("{STEPS} steps, since no FMU proposes one")),
    };
    let stop = match step > 0.0 {
        true => start + (duration / step).round().max(1.0) * step,
        // A wrong step is told where it is written.
        false => stop,
    };
    Ok(Proposed { start, step, stop, origin, reason })
}
