//! Derives start, step and stop time from the DefaultExperiment of FMUs, where a system or a single FMU gives none.

use cosim::order;
use diagnostics::Error;
use fmu_import::Fmu;

use crate::document::{Algorithm, Document};

/// Steps of a run whose FMUs propose none, as fmpy takes them.
const STEPS: f64 = 500.0;

/// A time of a run [s], and where it comes from.
#[derive(Debug, Clone)]
pub(in crate::document) struct ExperimentTime {
    pub value: f64,
    /// In brackets behind the value.
    pub origin: String,
}

impl ExperimentTime {
    pub fn new(value: f64, origin: impl Into<String>) -> Self {
        ExperimentTime { value, origin: origin.into() }
    }

    /// The value, and where it comes from if a run has it.
    fn describe_value(&self, value: f64) -> String {
        match value == self.value {
            true => format!("{value} s ({})", self.origin),
            false => format!("{value} s"),
        }
    }
}

/// What is known of a run before its FMUs are asked.
pub(in crate::document) struct ExperimentSettings {
    pub start: f64,
    pub stop: Option<ExperimentTime>,
    pub step: Option<ExperimentTime>,
}

/// The times of a run.
#[derive(Debug, Clone)]
pub(in crate::document) struct DefaultExperiment {
    /// [s]
    pub start: f64,
    pub step: ExperimentTime,
    pub stop: ExperimentTime,
}

/// The times that FMUs propose where nothing is given; the stop time is a multiple of the step.
pub(in crate::document) fn default_experiment(
    name: &str,
    ExperimentSettings { start, stop, step }: ExperimentSettings,
    fmus: &[Fmu],
) -> Result<DefaultExperiment, Error> {
    let several = fmus.len() > 1;
    let latest = fmus.iter().filter_map(|fmu| fmu.description.default_stop).reduce(f64::max);
    let latest = latest.filter(|stop| *stop > start);
    let proposed = |stop| match several {
        true => ExperimentTime::new(stop, "the latest one that its FMUs propose"),
        false => ExperimentTime::new(stop, "the DefaultExperiment of the FMU"),
    };
    let stop = stop.or_else(|| latest.map(proposed));
    let ExperimentTime { value: stop, origin } = stop
        .unwrap_or_else(|| ExperimentTime::new(start + 1.0, "nothing proposes a stop time after the start"));
    if stop <= start || !stop.is_finite() {
        return Err(Error::invalid_input(format!(
            "`{name}`: expected a stop time after the start time {start} s, found {stop} s ({origin})",
        )));
    }
    let duration = stop - start;
    let steps = fmus.iter().filter_map(|fmu| fmu.description.default_step);
    let steps = steps.filter(|step| *step > 0.0 && *step <= duration);
    let shortest = steps.reduce(f64::min).map(|step| match several {
        true => ExperimentTime::new(step, "the shortest one that its FMUs propose"),
        false => ExperimentTime::new(step, "the DefaultExperiment of the FMU"),
    });
    // The difference of two decimal times has errors in its last digits.
    let part = format!("{:.12e}", duration / STEPS).parse().unwrap_or(duration / STEPS);
    let none = || ExperimentTime::new(part, format!("{STEPS} steps, since no FMU proposes one that fits"));
    let step = step.or(shortest).unwrap_or_else(none);
    let stop = match step.value > 0.0 {
        true => start + (duration / step.value).round().max(1.0) * step.value,
        // A wrong step is told where it is written.
        false => stop,
    };
    Ok(DefaultExperiment { start, step, stop: ExperimentTime::new(stop, origin) })
}

/// How a system is stepped, as far as it decides that.
#[derive(Debug)]
pub(in crate::document) enum SystemStepping {
    /// The whole scenario is made of the system.
    Whole {
        /// Its name.
        name: String,
        times: DefaultExperiment,
        /// The algorithm of its annotation, and where that is.
        algorithm: Option<(Algorithm, String)>,
    },
    /// The system is a part of a scenario.
    Part {
        /// The sentence about its times.
        times: String,
        /// The algorithm of the scenario, and where it is written.
        algorithm: (String, String),
    },
}

impl SystemStepping {
    /// The sentence about it for a run whose scenario may say otherwise.
    pub fn describe_stepping(&self, document: &Document) -> Option<String> {
        let chosen = document.coupling.algorithm;
        match self {
            SystemStepping::Whole { name, times, algorithm } => {
                let time = document.time.as_ref()?;
                let start = time.start.as_ref().map_or(0.0, |start| *start.get_ref());
                let stop = times.stop.describe_value(*time.stop.get_ref());
                let step = times.step.describe_value(*time.step.get_ref());
                let why = match algorithm {
                    Some((algorithm, place)) if *algorithm == chosen => format!(" ({place})"),
                    _ => String::new(),
                };
                let word = chosen.keyword();
                Some(format!(
                    "the system `{name}` runs from {start} s to {stop} with the step {step}, coupled by {word}{why}; `--coupling` \
                     and a scenario that `extends` it may say otherwise"
                ))
            }
            SystemStepping::Part { times, algorithm: (written, place) } => {
                let place = if written == chosen.keyword() { place } else { "" };
                Some(format!("{times}, coupled by {}{place}", chosen.keyword()))
            }
        }
    }
}

/// Why a system is coupled by Jacobi without saying so: connections lead from a component back to itself.
pub(super) fn jacobi_reason(system: &ssp::SspSystem) -> Option<&'static str> {
    let links: Vec<_> = system.connections.iter().map(|it| (it.from.component, it.to.component)).collect();
    order::has_loop(&links).then_some(
        "its connections form a loop, and libcosim and Ecos give each input the value of the start of the step",
    )
}
