//! Identifies the tires of both axles from a drive under closed-loop control, and tells what was found.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod calibration;
mod columns;
mod facts;

use std::borrow::Cow;
use std::collections::BTreeMap;

use drive_doctor::LogExamination;
use drive_inference::calibration::SensorErrorAssessment;
use drive_inference::model_selection::EstimationMode;
use drive_inference::replay::{OpenLoopReplay, replay_open_loop};
use drive_inference::{
    Drive, DriveIdentification, DriveOptions, FormulationFit, HOLD_OUT, SHORTEST, SamplingReport,
    SegmentedDrive, Tires, identify_tires, smoothing,
};
use numerics::text::format_significant;
use plugin::{AnalysisRequest, AnalysisServices};
use preparation::direction::ForceDirection;
use preparation::{DriveLog, Interpolation, Resampler, Signal, SystematicError, longest_step};
use serde_json::{Value, json};
use tire_inference::axles::{Axle, Axles};
use tire_inference::estimate::TireEstimate;
use tire_inference::parameters::TireParameters;
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::quantity::{PerQuantity, Quantity};
use vehicle::PlanarState;

use crate::conclusion::axle_loads_at_rest;
use crate::config::{ClosedLoop, HoldOut};
use crate::names::SCATTER_ADDED;
use crate::page::{self, DrivesSection, PageContent, TireSection};
use crate::plugin::{doctor, drive_log, report_progress, write_start_values};
use crate::posterior_draws::{self, DrawDependence};
use crate::summary::{CurveSummary, IdentificationSummary, remove_absent_peak};

/// The signals that are needed: what was measured, and the inputs that acted.
const SIGNALS: [&str; 6] = ["v_x", "v_y", "r", "a_y", "F_x", "delta"];

/// The drive that the signals of a log make, at the times of `v_x` at which all others have values: signals with time stamps of their own
/// are interpolated, but not over gaps of more than `gap` [s].
///
/// # Errors
/// When one is missing, or they share no time.
pub(super) fn drive_from_log(log: &DriveLog, gap: Option<f64>) -> Result<Drive, String> {
    let mut signals = Vec::new();
    for name in SIGNALS {
        let missing = || format!("a drive under closed-loop control needs the signal `{name}`");
        signals.push((name, log.get(name).ok_or_else(missing)?));
    }
    let (_, Signal { time, .. }) = signals[0];
    let columns = signals.iter().map(|(_, signal)| resample_at(signal, time, gap));
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
    Ok(Drive { t: pick(time), v_x, v_y, r, a_y, F_x, delta, ..Drive::default() })
}

/// Values of a signal at other times: on the line between neighbours, NaN outside of them or within a gap.
fn resample_at<'a>(signal: &'a Signal, time: &[f64], gap: Option<f64>) -> Cow<'a, [f64]> {
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
pub(super) struct ValidationDrive {
    name: String,
    recording: Drive,
    replay: OpenLoopReplay,
}

/// Does `task = "closed_loop"`.
///
/// # Errors
/// When the recording cannot be used, no start leads anywhere, or the program asked to give up.
pub(super) fn closed_loop(
    config: &ClosedLoop,
    request: &AnalysisRequest,
    host: &mut dyn AnalysisServices,
) -> Result<Value, String> {
    let raw = drive_log(request);
    let mut recording = SegmentedDrive::new(&drive_from_log(&raw, config.gap)?, config.gap)
        .map_err(|error| error.to_string())?;
    let used = stretches_to_identify(config, &mut recording)?;
    let kept = config
        .validate
        .iter()
        .map(|window| Ok((window.name.clone(), stretches_to_validate(window, &recording)?)));
    let kept = kept.collect::<Result<Vec<_>, String>>()?;
    let options = config.drive_options().map_err(|error| error.to_string())?;
    let log = doctor::examine_drives(&used, &raw, &options.car.body, Some(options.car.aero));
    let options = if log.refusing_finding().is_some() { options_for_refused_log(options) } else { options };
    let mut progress = |share, what: &str| host.report_progress(share, what);
    let mut found = identify_tires(&used, &options, &mut progress).map_err(|error| error.to_string())?;
    let axles = &mut found.estimates;
    for estimate in [&mut axles.front, &mut axles.rear] {
        remove_absent_peak(estimate);
        doctor::cap_estimate_verdicts(&log, estimate);
    }
    doctor::cap_causes(&log, &mut found.causes);
    let calibration = calibration::assess_sensors(config, &options, &used, &log, &found.model, host)?;
    report_progress(host, 0.95, "validating")?;
    let validate =
        |(name, stretches): (_, Vec<_>)| replay_validation_drive(name, &stretches, &options, &found);
    let validations = kept.into_iter().map(validate).collect::<Result<Vec<_>, _>>()?;
    columns::record_identification(&options.car, &used, &found, host);
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
    let verdict = result.identification_summary().verdict();
    write_start_values(&of_plant, DrawDependence::Joint, &verdict, config.seed, host);
    result.write_page(host);
    Ok(result.result_json())
}

/// Everything that the task found, for the result and the page.
struct ClosedLoopResult<'a> {
    options: &'a DriveOptions,
    log: &'a LogExamination,
    /// Stretches that tires were identified from.
    used: &'a [Drive],
    sampling: &'a SamplingReport,
    identification: &'a DriveIdentification,
    calibration: &'a [SensorErrorAssessment],
    validations: &'a [ValidationDrive],
}

/// The options for a log that nothing may be identified from: no search for causes that a fit cannot make up for, and no
/// posterior of numbers that are wrong.
fn options_for_refused_log(mut options: DriveOptions) -> DriveOptions {
    for cause in SystematicError::ALL.into_iter().filter(|cause| !SystematicError::CAR.contains(cause)) {
        options.causes.wanted.0[cause as usize] = EstimationMode::Off;
    }
    DriveOptions { posterior: false, svi: false, profile: false, ..options }
}

/// The stretches that tires are identified from.
fn stretches_to_identify(config: &ClosedLoop, recording: &mut SegmentedDrive) -> Result<Vec<Drive>, String> {
    let drive = recording.drive_without_duplicate_times();
    let mut marked = vec![config.windows.is_empty(); drive.len()];
    let mut mark = |window, value| {
        let rows = marked.iter_mut().zip(drive.time_window_mask(window));
        rows.filter(|(_, inside)| *inside).for_each(|(marked, _)| *marked = value);
    };
    config.windows.iter().for_each(|&window| mark(window, true));
    config.validate.iter().for_each(|HoldOut { from, until, .. }| mark([*from, *until], false));
    let (stretches, short) = recording.marked_stretches(&marked);
    recording.sampling.short = short;
    if stretches.is_empty() {
        return Err(format!(
            "expected {SHORTEST} successive rows or more to identify from, found fewer in the windows; the recording {}",
            describe_extent(recording)
        ));
    }
    Ok(stretches)
}

/// The stretches of a window that is kept for validation.
fn stretches_to_validate(window: &HoldOut, recording: &SegmentedDrive) -> Result<Vec<Drive>, String> {
    let HoldOut { name, from, until } = window;
    let (stretches, _) = recording
        .marked_stretches(&recording.drive_without_duplicate_times().time_window_mask([*from, *until]));
    if stretches.is_empty() {
        return Err(format!(
            "`{name}`: expected {SHORTEST} successive rows or more from {from} to {until} s, found fewer; the recording {}",
            describe_extent(recording)
        ));
    }
    Ok(stretches)
}

fn describe_extent(recording: &SegmentedDrive) -> String {
    let SamplingReport { step, gap, gaps, .. } = &recording.sampling;
    let [step, gap] = [step, gap].map(|time| format_significant(*time, 3));
    let gaps = match gaps.len() {
        0 => String::new(),
        count => format!(
            " and has {count} gaps: steps of more than {gap} s, the median being {step} s; `gap` sets the longest that is none"
        ),
    };
    match (
        recording.drive_without_duplicate_times().t.first(),
        recording.drive_without_duplicate_times().t.last(),
    ) {
        (Some(first), Some(last)) => {
            let [first, last] = [first, last].map(|time| format_significant(*time, 5));
            format!("goes from {first} to {last} s{gaps}")
        }
        _ => "is empty".to_owned(),
    }
}

/// Lets the identified car drive what was kept, from the smoothed state at the begin of each stretch.
fn replay_validation_drive(
    name: String,
    stretches: &[Drive],
    options: &DriveOptions,
    found: &DriveIdentification,
) -> Result<ValidationDrive, String> {
    let failed = |error: String| format!("validation '{name}': {error}");
    let car = found.errors.corrected_car(&options.car);
    let mut recording = Drive::default();
    let mut starts = Vec::new();
    for stretch in stretches {
        // The car and its inputs as they were found to be.
        let stretch = &found.errors.corrected_inputs(stretch);
        let smoothed = smoothing::smooth_states(&car, stretch, &found.noise, &options.smoothing, || true)
            .map_err(|error| failed(error.to_string()))?;
        let [v_x, v_y, r, ..]: [f64; 6] = smoothed.states.states[0].mean.into();
        starts.push((stretch.clone(), PlanarState { v_x, v_y, r, ..PlanarState::default() }));
        recording.append_recording(stretch);
    }
    let starts: Vec<_> = starts.iter().map(|(stretch, start)| (stretch, *start)).collect();
    let [front, rear] = found.tires.map(|tire| tire.to_magic_formula()).into_array();
    let replay = replay_open_loop(&car.with_tires(front, rear), &starts, &found.noise);
    Ok(ValidationDrive { name, recording, replay })
}

impl ClosedLoopResult<'_> {
    /// What was found as a whole, in words.
    fn identification_summary(&self) -> IdentificationSummary<'_> {
        let found = self.identification;
        let curve = |(name, axle)| CurveSummary {
            name,
            direction: ForceDirection::Lateral,
            estimate: &found.estimates[axle],
            prior: &self.options.prior,
            load: Some(axle_loads_at_rest(&self.options.car.body)[usize::from(axle == Axle::Rear)]),
        };
        let curves = [("front", Axle::Front), ("rear", Axle::Rear)].map(curve).to_vec();
        let (model, causes) = (found.model.clone(), found.causes.as_slice());
        let mut summary = IdentificationSummary { curves, model, causes, ..IdentificationSummary::default() };
        let held_out = found.model.tests.iter().find(|test| test.name == HOLD_OUT);
        if held_out.is_some_and(|test| !test.has_passed()) {
            summary.widened = SCATTER_ADDED;
        }
        doctor::add_findings_to_summary(self.log, &mut summary);
        let of_plant = posterior_draws::of_drives("", found);
        summary.remarks.extend(posterior_draws::reason_for_no_draws(&of_plant));
        summary
    }

    /// Estimates by method, and what else was found.
    fn result_json(&self) -> Value {
        let found = self.identification;
        let by_formulation: BTreeMap<_, _> =
            found.formulations.iter().map(|fitted| (fitted.formulation.name(), fitted)).collect();
        let recordings = self.used.iter().zip(&found.smoothed).map(|(recording, smoothed)| {
            let window = [recording.t.first(), recording.t.last()];
            json!({ "window": window, "rows": recording.len(), "smoothing": smoothed.report })
        });
        let calibration: BTreeMap<_, _> = self.calibration.iter().map(|it| (it.error.name, it)).collect();
        let validations: BTreeMap<_, _> = self.validations.iter().map(|it| (&it.name, &it.replay)).collect();
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
        let mut summary = self.identification_summary();
        summary.remarks.extend(calibration::describe_sensor_errors(self.calibration));
        let numbers = numbers.into_iter().map(|(key, value)| (key.to_owned(), value));
        summary.result_json(Some(self.log), numbers.collect())
    }

    /// Leaves the page, with the deciding formulation first.
    fn write_page(&self, host: &mut dyn AnalysisServices) {
        let found = self.identification;
        let (decisive, others) = match found.formulations.split_last() {
            Some((decisive, others)) => (decisive.formulation.title(), others),
            None => ("", &[][..]),
        };
        let compared: Axles<Vec<TireEstimate>> = Axles::from_fn(|axle| {
            let decisive = &found.estimates[axle];
            others.iter().rev().map(|fitted| axle_estimate(fitted, axle, decisive)).collect()
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
                methods.push(page::MethodSection { name, estimate, posterior: &none, gaussian: None });
            }
            TireSection {
                name,
                direction: ForceDirection::Lateral,
                samples: &found.samples[axle],
                prior: &self.options.prior,
                methods,
            }
        };
        let replays: Vec<_> =
            self.validations.iter().map(|it| (it.name.as_str(), &it.recording, &it.replay)).collect();
        let page = PageContent {
            title: "Tires from closed-loop driving",
            overall: Some(&self.identification_summary()),
            car: &page::car::closed_loop_car_facts(&self.options.car, &self.options.uncertainty),
            facts: &facts::log_facts(self.used, self.sampling),
            sections: [("Front axle", Axle::Front), ("Rear axle", Axle::Rear)].map(section).into(),
            drives: Some(DrivesSection {
                found,
                calibration: self.calibration,
                recordings: self.used,
                replays: &replays,
            }),
            log: Some(self.log),
            ..PageContent::default()
        };
        page::write_page(&page, host);
    }
}

/// What a formulation says of one axle, which nobody judged.
fn axle_estimate(fitted: &FormulationFit, axle: Axle, decisive: &TireEstimate) -> TireEstimate {
    let parameters = || TireParameters::<f64>::PARAMETERS.into_iter();
    let per_quantity = |tires: &Tires| -> PerQuantity {
        parameters().map(Quantity::from).zip(tires[axle].into_array()).collect()
    };
    let mut mean = per_quantity(&fitted.tires);
    mean.insert(Quantity::K, fitted.tires[axle].stiffness());
    let at_bound = parameters().zip(fitted.at_bound[axle].into_array()).filter(|(_, is)| *is);
    TireEstimate {
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
