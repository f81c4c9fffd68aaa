//! Chooses start, step and stop of a case: from the options beside its reference, the times of the reference, or the description.

use std::path::Path;

use diagnostics::read_text_bounded;
use fmu_import::FmuDescription;

use super::toml_text::{comment_text, toml_number, without_rounding_digits};

/// A file of options has a few lines.
const LARGEST_OPTIONS: u64 = 1 << 20;
/// Steps of a run whose files propose none, as for `trackside run X.fmu`.
const STEPS: f64 = 500.0;
/// A step that makes a run of more steps than this is none to begin with.
const MOST_STEPS: f64 = 1e6;

/// A number of an experiment, and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SourcedNumber {
    pub value: f64,
    pub origin: String,
}

impl SourcedNumber {
    fn new(value: f64, origin: impl Into<String>) -> Self {
        SourcedNumber { value, origin: origin.into() }
    }

    /// The stop time at the end of a step; a run does not end before its reference.
    fn after_whole_steps(self, start: f64, step: f64) -> Self {
        let value = whole_steps_stop(start, step, self.value);
        let origin = match (value - self.value).abs() <= 1e-9 * value {
            true => self.origin,
            false => format!("{}, {} s, and on to the end of a step", self.origin, self.value),
        };
        SourcedNumber { value, origin }
    }

    fn line(&self, key: &str) -> String {
        format!("{key} = {} # {}\n", toml_number(self.value), comment_text(&self.origin))
    }
}

/// When a case begins and ends, and its communication step.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CaseExperiment {
    /// [s]
    pub start: SourcedNumber,
    /// [s]
    pub step: SourcedNumber,
    /// [s]
    pub stop: SourcedNumber,
    /// Relative tolerance of the integration inside the FMU [-].
    pub tolerance: Option<SourcedNumber>,
}

impl CaseExperiment {
    /// The section `[time]`.
    pub fn toml_section(&self) -> String {
        let CaseExperiment { start, step, stop, tolerance } = self;
        let lines = [Some((start, "start")), Some((step, "step")), Some((stop, "stop"))];
        let tolerance = tolerance.as_ref().map(|it| (it, "tolerance"));
        let lines = lines.into_iter().chain([tolerance]).flatten().map(|(number, key)| number.line(key));
        format!("[time] # [s]\n{}", lines.collect::<String>())
    }

    /// In words.
    pub fn describe(&self) -> String {
        let CaseExperiment { start, step, stop, .. } = self;
        format!("{} to {} s in steps of {} s", start.value, stop.value, step.value)
    }
}

/// The options beside a reference.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ExperimentOptions {
    pub file: String,
    start: Option<f64>,
    stop: Option<f64>,
    step: Option<f64>,
    tolerance: Option<f64>,
}

impl ExperimentOptions {
    /// Reads lines such as `StepSize,0.001`.
    ///
    /// # Errors
    /// In words, when the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = read_text_bounded(path, LARGEST_OPTIONS).map_err(|error| error.to_string())?;
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(ExperimentOptions { file, ..Self::parse(&text) })
    }

    fn parse(text: &str) -> Self {
        let mut options = ExperimentOptions::default();
        for line in text.lines() {
            let mut words =
                line.split([',', ';', '=', ':', '\t', ' ']).map(|word| word.trim().trim_matches('"'));
            let Some(key) = words.next() else { continue };
            let Some(value) = words.find(|word| !word.is_empty()).and_then(|word| word.parse().ok()) else {
                continue;
            };
            let place = match key.to_ascii_lowercase().as_str() {
                "starttime" => &mut options.start,
                "stoptime" => &mut options.stop,
                "stepsize" => &mut options.step,
                "reltol" | "tolerance" => &mut options.tolerance,
                _ => continue,
            };
            *place = Some(value).filter(|value: &f64| value.is_finite());
        }
        options
    }
}

/// The experiment of an FMU whose reference, called `reference`, has rows at these times [s].
///
/// # Errors
/// In words, when nothing says a stop time after the start.
pub(super) fn case_experiment(
    description: &FmuDescription,
    options: &ExperimentOptions,
    reference: &str,
    times: &[f64],
) -> Result<CaseExperiment, String> {
    let [first, last] = [times.first(), times.last()].map(|time| time.copied().unwrap_or_default());
    let of_options = |value: f64, key: &str| SourcedNumber::new(value, format!("{key} of {}", options.file));
    let start = match options.start {
        Some(start) if start >= 0.0 && start <= first => of_options(start, "StartTime"),
        _ if first >= 0.0 => SourcedNumber::new(first, format!("the first row of {reference}")),
        _ => SourcedNumber::new(
            0.0,
            format!("recordings have no time before 0; {reference} begins at {first} s"),
        ),
    };
    let stop = match options.stop {
        Some(stop) if stop >= last => of_options(stop, "StopTime"),
        _ => SourcedNumber::new(last, format!("the last row of {reference}")),
    };
    if stop.value <= start.value {
        return Err(format!("{reference} ends at {last} s, which is not after {} s", start.value));
    }
    let duration = stop.value - start.value;
    let step = match options.step.filter(|step| *step > 0.0 && *step <= duration) {
        Some(step) => of_options(step, "StepSize"),
        None => case_step(description, reference, times, duration),
    };
    let stop = stop.after_whole_steps(start.value, step.value);
    let tolerance = options.tolerance.filter(|it| *it > 0.0 && *it < 1.0).map(|it| of_options(it, "RelTol"));
    Ok(CaseExperiment { start, step, stop, tolerance })
}

/// The step between the rows of the reference, unless the FMU has an inner one that does not fit it, or else that of the description.
fn case_step(description: &FmuDescription, reference: &str, times: &[f64], duration: f64) -> SourcedNumber {
    let own =
        description.default_step_size().filter(|step| *step <= duration && duration / step < MOST_STEPS);
    let of_description = |step| SourcedNumber::new(step, "the DefaultExperiment of the FMU");
    let fits = |spacing: f64| description.internal_step.is_none_or(|inner| is_multiple(spacing, inner));
    match (own, row_spacing(times).filter(|spacing| duration / spacing < MOST_STEPS)) {
        (Some(own), Some(spacing)) if !fits(spacing) => of_description(own),
        (_, Some(spacing)) => SourcedNumber::new(spacing, format!("the rows of {reference}")),
        (Some(own), None) => of_description(own),
        (None, None) => {
            let step = without_rounding_digits(duration / STEPS);
            SourcedNumber::new(step, format!("{STEPS} steps, since no file proposes one"))
        }
    }
}

/// The experiment of FMUs that are connected: the latest stop and the shortest step that they propose.
pub(super) fn system_experiment(descriptions: &[&FmuDescription]) -> CaseExperiment {
    let start = SourcedNumber::new(0.0, "the beginning");
    let latest = descriptions.iter().filter_map(|it| it.default_stop).reduce(f64::max);
    let stop = match latest.filter(|stop| *stop > 0.0 && stop.is_finite()) {
        Some(stop) => SourcedNumber::new(stop, "the latest stop that the descriptions propose"),
        None => SourcedNumber::new(1.0, "no description proposes a stop"),
    };
    let steps = descriptions.iter().filter_map(|it| it.default_step_size());
    let shortest =
        steps.filter(|step| *step <= stop.value && stop.value / step < MOST_STEPS).reduce(f64::min);
    let step = match shortest {
        Some(step) => SourcedNumber::new(step, "the shortest step that the descriptions propose"),
        None => {
            let step = without_rounding_digits(stop.value / STEPS);
            SourcedNumber::new(step, format!("{STEPS} steps, since no description proposes one"))
        }
    };
    let stop = stop.after_whole_steps(0.0, step.value);
    CaseExperiment { start, step, stop, tolerance: None }
}

/// The first end of a step that is not before `stop` [s].
fn whole_steps_stop(start: f64, step: f64, stop: f64) -> f64 {
    let steps = ((stop - start) / step - 1e-6).ceil().max(1.0);
    without_rounding_digits(start + steps * step)
}

/// The time between rows where most of them have the same one, as the output interval of a simulator; rows at events come between [s].
fn row_spacing(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let median = *steps.get(steps.len() / 2)?;
    let equal = steps.iter().filter(|step| (**step - median).abs() <= 1e-4 * median);
    let equal: Vec<f64> = equal.copied().collect();
    if equal.len() * 10 < steps.len() * 8 {
        return None;
    }
    // Times are rounded; the mean of their differences is less so, and most steps are short decimal numbers.
    let mean = equal.iter().sum::<f64>() / equal.len() as f64;
    let short: f64 = format!("{mean:.5e}").parse().unwrap_or(mean);
    Some(if (short - mean).abs() <= 1e-7 * mean { short } else { without_rounding_digits(mean) })
}

fn is_multiple(value: f64, of: f64) -> bool {
    let quotient = value / of;
    quotient > 0.5 && (quotient - quotient.round()).abs() < 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_of_the_cross_check_are_read() {
        let read = ExperimentOptions::parse(
            "StepSize,0\r\n\"StartTime\", 0.5\nStopTime = 1.5\nRelTol,1e-4\nSolver,x\n\n",
        );
        assert_eq!(
            (read.start, read.stop, read.step, read.tolerance),
            (Some(0.5), Some(1.5), Some(0.0), Some(1e-4))
        );
    }

    #[test]
    fn the_spacing_of_rows_is_that_of_most_of_them() {
        let with_event: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.01).chain([1.0, 1.003, 1.01]).collect();
        assert_eq!(row_spacing(&with_event), Some(0.01));
        let thirds: Vec<f64> = (0..=3).map(|k| f64::from(k) / 3.0).collect();
        assert!((row_spacing(&thirds).expect("a spacing") - 1.0 / 3.0).abs() < 1e-11);
        // The last row may come early.
        let cut: Vec<f64> = (0..=39).map(|k| f64::from(k) * 0.0256).chain([1.0]).collect();
        assert_eq!(row_spacing(&cut), Some(0.0256));
        assert_eq!(row_spacing(&[0.0, 0.1, 0.3, 0.7, 1.5]), None);
        assert_eq!(row_spacing(&[0.0]), None);
    }

    #[test]
    fn a_run_does_not_end_before_its_reference() {
        assert_eq!(whole_steps_stop(0.0, 0.01, 3.0), 3.0);
        assert_eq!(whole_steps_stop(0.0, 0.4, 1.5), 1.6);
        assert_eq!(whole_steps_stop(0.5, 0.25, 1.5), 1.5);
    }
}
