//! Identifies the tires of both axles from a drive under closed-loop control, and tells what was found.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod calibration;
mod columns;
mod facts;

use std::borrow::Cow;
use std::collections::BTreeMap;

use drive_doctor::Examination;
use drive_inference::calibration::CalibrationAssessment;
use drive_inference::model_selection::Mode;
use drive_inference::replay::{Replay, replay};
use drive_inference::{
    Drive, DriveOptions, FormulationFit, HOLD_OUT, Identification, SHORTEST, Sampling,
    SegmentedDrive, Tires, identify, smoothing,
};
use numerics::text::significant;
use plugin::{Host, Request};
use preparation::direction::Direction;
use preparation::{DriveLog, Interpolation, Resampler, Signal, SystematicError, longest_step};
use serde_json::{Value, json};
use tire_inference::axles::{Axle, Axles};
use tire_inference::estimate::Estimate;
use tire_inference::parameters::TireParameters;
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::quantity::{PerQuantity, Quantity};
use vehicle::State;

use crate::config::{ClosedLoop, HoldOut};
use crate::names::SCATTER_ADDED;
use crate::page::{self, Drives, Page, Section};
use crate::plugin::{doctor, drive_log, go_on, leave_start_values};
use crate::posterior_draws::{self, Dependence};
use crate::summary::{CurveSummary, IdentificationSummary, forget_absent_peak};

/// The signals that are needed: what was measured, and the inputs that acted.
const SIGNALS: [&str; 6] = ["v_x", "v_y", "r", "a_y", "F_x", "delta"];

/// The drive that the signals of a log make, at the times of `v_x` at which all others have values: signals with time stamps of their own
/// are interpolated, but not over gaps of more than `gap` [s].
///
/// # Errors
/// When one is missing, or they share no time.
pub(super) fn drive(log: &DriveLog, gap: Option<f64>) -> Result<Drive, String> {
    let mut signals = Vec::new();
    for name in SIGNALS {
        let missing = || format!("a drive under closed-loop control needs the signal `{name}`");
        signals.push((name, log.get(name).ok_or_else(missing)?));
    }
    let (_, Signal { time, .. }) = signals[0];
    let columns = signals.iter().map(|(_, signal)| at(signal, time, gap));
    let columns: Vec<Cow<[f64]>> = columns.collect();
    // A value that is no number stays where it is recorded, to be told with its row.
    let shared = |&row: &usize| {
        columns
            .iter()
            .zip(&signals)
            .all(|(column, (_, signal))| signal.time == *time || column[row].is_finite())
    };
    let rows: Vec<usize> = (0..time.len()).filter(shared).collect();
    if rows.is_empty() && !time.is_empty() {
        let apart = signals.iter().zip(&columns).filter(|((_, signal), column)| {
            signal.time != *time && column.iter().all(|value| value.is_nan())
        });
        let names: Vec<_> = apart.map(|((name, _), _)| format!("`{name}`")).collect();
        let names = names.join(", ");
        return Err(format!("expected signals at the times of `v_x`, found others in {names}"));
    }
    let pick = |column: &[f64]| rows.iter().map(|&row| column[row]).collect::<Vec<f64>>();
    let [v_x, v_y, r, a_y, F_x, delta] = std::array::from_fn(|i| pick(&columns[i]));
    Ok(Drive { t: pick(time), v_x, v_y, r, a_y, F_x, delta })
}

/// Values of a signal at other times: on the line between neighbours, NaN outside of them or within a gap.
fn at<'a>(signal: &'a Signal, time: &[f64], gap: Option<f64>) -> Cow<'a, [f64]> {
    if *signal.time == *time {
        return Cow::Borrowed(&signal.value);
    }
    let resampler = Resampler {
        interpolation: Interpolation::Linear,
        longest_step: gap.unwrap_or_else(|| longest_step(&signal.time)),
        tolerance: 0.0,
    };
    resampler.resample(&signal.time, &signal.value, time.iter().copied()).into()
}

/// A drive that was not used, and how the identified car went along it.
pub(super) struct Validation {
    name: String,
    recording: Drive,
    replay: Replay,
}

/// Does `task = "closed_loop"`.
///
/// # Errors
/// When the recording cannot be used, no start leads anywhere, or the program asked to give up.
pub(super) fn closed_loop(
    config: &ClosedLoop,
    request: &Request,
    host: &mut dyn Host,
) -> Result<Value, String> {
    let raw = drive_log(request);
    let mut recording = SegmentedDrive::new(&drive(&raw, config.gap)?, config.gap)
        .map_err(|error| error.to_string())?;
    let used = used(config, &mut recording)?;
    let kept =
        config.validate.iter().map(|window| Ok((window.name.clone(), kept(window, &recording)?)));
    let kept = kept.collect::<Result<Vec<_>, String>>()?;
    let options = config.options().map_err(|error| error.to_string())?;
    let log = doctor::of_drives(&used, &raw, &options.car.body);
    let options = if log.refusal().is_some() { refused(options) } else { options };
    let mut progress = |share, what: &str| host.progress(share, what);
    let mut found = identify(&used, &options, &mut progress).map_err(|error| error.to_string())?;
    let axles = &mut found.estimates;
    for estimate in [&mut axles.front, &mut axles.rear] {
        forget_absent_peak(estimate);
        doctor::cap(&log, estimate);
    }
    doctor::cap_causes(&log, &mut found.causes);
    let calibration =
        calibration::assess_sensors(config, &options, &used, &log, &found.model, host)?;
    go_on(host, 0.95, "validating")?;
    let validate = |(name, stretches): (_, Vec<_>)| validation(name, &stretches, &options, &found);
    let validations = kept.into_iter().map(validate).collect::<Result<Vec<_>, _>>()?;
    columns::record(&options.car, &used, &found, host);
    validations.iter().for_each(|validation| columns::record_validation(validation, host));
    let result = ClosedLoopResult {
        options: &options,
        log: &log,
        used: &used,
        sampling: &recording.sampling,
        identification: &found,
        calibration: &calibration,
        validations: &validations,
    };
    let of_plant = posterior_draws::of_drives(&config.node, &found);
    let verdict = result.summary().verdict();
    leave_start_values(&of_plant, Dependence::Joint, &verdict, config.seed, host);
    result.leave_page(host);
    Ok(result.report())
}

/// Everything that the task found, for the result and the page.
struct ClosedLoopResult<'a> {
    options: &'a DriveOptions,
    log: &'a Examination,
    /// Stretches that tires were identified from.
    used: &'a [Drive],
    sampling: &'a Sampling,
    identification: &'a Identification,
    calibration: &'a [CalibrationAssessment],
    validations: &'a [Validation],
}

/// The options for a log that nothing may be identified from: no search for causes that a fit cannot make up for, and no
/// posterior of numbers that are wrong.
fn refused(mut options: DriveOptions) -> DriveOptions {
    for cause in
        SystematicError::ALL.into_iter().filter(|cause| !SystematicError::CAR.contains(cause))
    {
        options.causes.wanted.0[cause as usize] = Mode::Off;
    }
    DriveOptions { posterior: false, svi: false, profile: false, ..options }
}

/// The stretches that tires are identified from.
fn used(config: &ClosedLoop, recording: &mut SegmentedDrive) -> Result<Vec<Drive>, String> {
    let drive = recording.drive();
    let mut marked = vec![config.windows.is_empty(); drive.len()];
    let mut mark = |window, value| {
        let rows = marked.iter_mut().zip(drive.during(window));
        rows.filter(|(_, inside)| *inside).for_each(|(marked, _)| *marked = value);
    };
    config.windows.iter().for_each(|&window| mark(window, true));
    config.validate.iter().for_each(|HoldOut { from, until, .. }| mark([*from, *until], false));
    let (stretches, short) = recording.stretches(&marked);
    recording.sampling.short = short;
    if stretches.is_empty() {
        return Err(format!(
            "expected {SHORTEST} successive rows or more to identify from, found fewer in the windows; the recording {}",
            extent(recording)
        ));
    }
    Ok(stretches)
}

/// The stretches of a window that is kept for validation.
fn kept(window: &HoldOut, recording: &SegmentedDrive) -> Result<Vec<Drive>, String> {
    let HoldOut { name, from, until } = window;
    let (stretches, _) = recording.stretches(&recording.drive().during([*from, *until]));
    if stretches.is_empty() {
        return Err(format!(
            "`{name}`: expected {SHORTEST} successive rows or more from {from} to {until} s, found fewer; the recording {}",
            extent(recording)
        ));
    }
    Ok(stretches)
}

fn extent(recording: &SegmentedDrive) -> String {
    let Sampling { step, gap, gaps, .. } = &recording.sampling;
    let [step, gap] = [step, gap].map(|time| significant(*time, 3));
    let gaps = match gaps.len() {
        0 => String::new(),
        count => format!(
            " and has {count} gaps: steps of more than {gap} s, the median being {step} s; `gap` sets the longest that is none"
        ),
    };
    match (recording.drive().t.first(), recording.drive().t.last()) {
        (Some(first), Some(last)) => {
            let [first, last] = [first, last].map(|time| significant(*time, 5));
            format!("goes from {first} to {last} s{gaps}")
        }
        _ => "is empty".to_owned(),
    }
}

/// Lets the identified car drive what was kept, from the smoothed state at the begin of each stretch.
fn validation(
    name: String,
    stretches: &[Drive],
    options: &DriveOptions,
    found: &Identification,
) -> Result<Validation, String> {
    let failed = |error: String| format!("validation '{name}': {error}");
    let car = found.errors.true_car(&options.car);
    let mut recording = Drive::default();
    let mut starts = Vec::new();
    for stretch in stretches {
        // The car and its inputs as they were found to be.
        let stretch = &found.errors.true_inputs(stretch);
        let smoothed =
            smoothing::smooth_states(&car, stretch, &found.noise, &options.smoothing, || true)
                .map_err(|error| failed(error.to_string()))?;
        let [v_x, v_y, r, ..]: [f64; 6] = smoothed.states.states[0].mean.into();
        starts.push((stretch.clone(), State { v_x, v_y, r, ..State::default() }));
        recording.append(stretch);
    }
    let starts: Vec<_> = starts.iter().map(|(stretch, start)| (stretch, *start)).collect();
    let [front, rear] = found.tires.map(|tire| tire.curve()).into_array();
    let replay = replay(&car.with_tires(front, rear), &starts, &found.noise);
    Ok(Validation { name, recording, replay })
}

impl ClosedLoopResult<'_> {
    /// What was found as a whole, in words.
    fn summary(&self) -> IdentificationSummary<'_> {
        let found = self.identification;
        let curve = |(name, axle)| CurveSummary {
            name,
            direction: Direction::Lateral,
            estimate: &found.estimates[axle],
            prior: &self.options.prior,
        };
        let curves = [("front", Axle::Front), ("rear", Axle::Rear)].map(curve).to_vec();
        let (model, causes) = (found.model.clone(), found.causes.as_slice());
        let mut summary =
            IdentificationSummary { curves, model, causes, ..IdentificationSummary::default() };
        let held_out = found.model.tests.iter().find(|test| test.name == HOLD_OUT);
        if held_out.is_some_and(|test| !test.passed()) {
            summary.widened = SCATTER_ADDED;
        }
        doctor::tell(self.log, &mut summary);
        let of_plant = posterior_draws::of_drives("", found);
        summary.remarks.extend(posterior_draws::missing(&of_plant));
        summary
    }

    /// Estimates by method, and what else was found.
    fn report(&self) -> Value {
        let found = self.identification;
        let by_formulation: BTreeMap<_, _> =
            found.formulations.iter().map(|fitted| (fitted.formulation.name(), fitted)).collect();
        let recordings = self.used.iter().zip(&found.smoothed).map(|(recording, smoothed)| {
            let window = [recording.t.first(), recording.t.last()];
            json!({ "window": window, "rows": recording.len(), "smoothing": smoothed.report })
        });
        let calibration: BTreeMap<_, _> =
            self.calibration.iter().map(|it| (it.error.name, it)).collect();
        let validations: BTreeMap<_, _> =
            self.validations.iter().map(|it| (&it.name, &it.replay)).collect();
        let numbers = [
            (self.options.method.name(), json!(found.estimates)),
            ("bounds", json!(self.options.prior.bounds)),
            ("innovations", json!(found.innovations)),
            ("noise", json!(found.noise)),
            ("covariance", json!(found.covariance)),
            ("calibration", json!(calibration)),
            ("formulations", json!(by_formulation)),
            ("recordings", recordings.collect()),
            ("sampling", json!(self.sampling)),
            ("validate", json!(validations)),
            ("seconds", json!(found.seconds)),
        ];
        let mut summary = self.summary();
        summary.remarks.extend(calibration::sentences(self.calibration));
        let numbers = numbers.into_iter().map(|(key, value)| (key.to_owned(), value));
        summary.result(Some(self.log), numbers.collect())
    }

    /// Leaves the page, with the deciding formulation first.
    fn leave_page(&self, host: &mut dyn Host) {
        let found = self.identification;
        let (decisive, others) = match found.formulations.split_last() {
            Some((decisive, others)) => (decisive.formulation.title(), others),
            None => ("", &[][..]),
        };
        let compared: Axles<Vec<Estimate>> = Axles::new(|axle| {
            let decisive = &found.estimates[axle];
            others.iter().rev().map(|fitted| estimate(fitted, axle, decisive)).collect()
        });
        let none = PosteriorSamples::default();
        let section = |(name, axle): (&'static str, Axle)| {
            let mut methods = vec![page::MethodSection {
                name: decisive,
                estimate: &found.estimates[axle],
                posterior: &found.posterior[axle],
                gaussian: found.gaussian.as_ref().map(|axles| &axles[axle]),
            }];
            for (fitted, estimate) in others.iter().rev().zip(&compared[axle]) {
                let name = fitted.formulation.title();
                methods.push(page::MethodSection {
                    name,
                    estimate,
                    posterior: &none,
                    gaussian: None,
                });
            }
            Section {
                name,
                direction: Direction::Lateral,
                samples: &found.samples[axle],
                prior: &self.options.prior,
                methods,
            }
        };
        let replays: Vec<_> = self
            .validations
            .iter()
            .map(|it| (it.name.as_str(), &it.recording, &it.replay))
            .collect();
        let page = Page {
            title: "Tires from closed-loop driving",
            overall: Some(&self.summary()),
            car: &page::car::driven(&self.options.car, &self.options.uncertainty),
            facts: &facts::facts(self.used, self.sampling),
            sections: [("Front axle", Axle::Front), ("Rear axle", Axle::Rear)].map(section).into(),
            drives: Some(Drives {
                found,
                calibration: self.calibration,
                recordings: self.used,
                replays: &replays,
            }),
            log: Some(self.log),
            ..Page::default()
        };
        page::leave(&page, host);
    }
}

/// What a formulation says of one axle, which nobody judged.
fn estimate(fitted: &FormulationFit, axle: Axle, decisive: &Estimate) -> Estimate {
    let parameters = || TireParameters::<f64>::PARAMETERS.into_iter();
    let per_quantity = |tires: &Tires| -> PerQuantity {
        parameters().map(Quantity::from).zip(tires[axle].into_array()).collect()
    };
    let mut mean = per_quantity(&fitted.tires);
    mean.insert(Quantity::K, fitted.tires[axle].stiffness());
    let at_bound = parameters().zip(fitted.at_bound[axle].into_array()).filter(|(_, is)| *is);
    Estimate {
        mean,
        std: per_quantity(&fitted.std),
        at_bound: at_bound.map(|(parameter, _)| parameter).collect(),
        noise_std: f64::NAN,
        convergence: fitted.convergence.clone(),
        seconds: fitted.seconds,
        source: UncertaintySource::Likelihood,
        posterior: None,
        svi: None,
        ..decisive.clone()
    }
}

#[cfg(test)]
mod late_yaw_rate;
#[cfg(test)]
mod tests;
