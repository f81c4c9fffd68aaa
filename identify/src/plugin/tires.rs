//! Identifies the tires of a car: prepares its signals, identifies each curve, and tells what was found.

mod facts;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::time::Instant;

use drive_doctor::LogExamination;
use drive_inference::CarUncertainty;
use plugin::{AnalysisRequest, AnalysisServices, Signal};
use preparation::direction::ForceDirection;
use preparation::{
    Car, CurvePoints, DriveLog, PreparationPipeline, PreparationStage, PreparedRecording, StageColumn,
};
use serde_json::{Map, Value, json};
use tire_inference::axle_coupling::{AxleFit, fit_coupled_axles};
use tire_inference::bound_extension::BoundExtension;
use tire_inference::estimate::{TireEstimate, TireIdentification, identify_tire};
use tire_inference::fit::{FitError, FitOptions};
use tire_inference::parameters::Theta;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use vehicle::VehicleBody;

use crate::conclusion::axle_loads_at_rest;
use crate::config::TiresConfig;
use crate::design::d_optimal;
use crate::loads::{self, AxleLoadEffects, LoadEffectFits};
use crate::names::CAR_ADDED;
use crate::page::{self, PageContent, TireSection};
use crate::plugin::{
    doctor, drive_log, method_sections, overall_summary, posterior_of_estimate, report_progress,
    write_start_values,
};
use crate::posterior_draws::{self, DrawDependence, TirePosterior};
use crate::start_values::IdentifiedTire;
use crate::stretches;
use crate::summary::{CurveSummary, IdentificationSummary, remove_absent_peak};
use crate::uncertainty_propagation::{PropagatedUncertainty, cars_with_other_brake_share, perturbed_cars};

/// One curve of the car.
struct TireCurve<'a> {
    /// Its key in the result.
    key: &'static str,
    /// Its name on the page.
    name: &'static str,
    /// Its name in a sentence.
    axle: &'static str,
    direction: ForceDirection,
    points: &'a CurvePoints,
}

/// The curves that the points of both axles make.
fn tire_curves(prepared: &PreparedRecording) -> Vec<TireCurve<'_>> {
    let curve = |key, name, axle, direction, points| TireCurve { key, name, axle, direction, points };
    let PreparedRecording { front, rear, .. } = prepared;
    let all = [
        ("front", "Front axle, lateral", "front", ForceDirection::Lateral, Some(&front.lateral)),
        (
            "front_x",
            "Front axle, longitudinal",
            "front",
            ForceDirection::Longitudinal,
            front.longitudinal.as_ref(),
        ),
        ("rear", "Rear axle, lateral", "rear", ForceDirection::Lateral, Some(&rear.lateral)),
        (
            "rear_x",
            "Rear axle, longitudinal",
            "rear",
            ForceDirection::Longitudinal,
            rear.longitudinal.as_ref(),
        ),
    ];
    let present = all
        .into_iter()
        .filter_map(|(key, name, axle, direction, points)| Some(curve(key, name, axle, direction, points?)));
    present.collect()
}

/// What was found of one curve.
struct CurveAnswer<'a> {
    curve: TireCurve<'a>,
    settings: IdentificationSettings,
    /// Sides of the box that the points moved.
    extensions: Vec<BoundExtension>,
    answer: TireIdentification,
}

impl CurveAnswer<'_> {
    /// By the first method that was asked for: the one to go on with.
    fn first_estimate(&self) -> &TireEstimate {
        &self.answer.estimates[0].1
    }
}

/// Does `task = "tires"`.
///
/// # Errors
/// When the signals cannot be used, a curve cannot be fitted, or the program asked to give up.
pub(super) fn identify_tires(
    config: &TiresConfig,
    request: &AnalysisRequest,
    host: &mut dyn AnalysisServices,
) -> Result<Value, String> {
    report_progress(host, 0.0, "preparing the points")?;
    let recording = drive_log(request);
    let (car, uncertainty) = config.car().map_err(|error| error.to_string())?;
    let log = doctor::examine_car_log(&recording, &car.body, Some(car.aero));
    let pipeline = PreparationPipeline { car, ..config.prepare.clone() };
    let prepared = pipeline.prepare(&recording).map_err(|error| error.to_string())?;
    record_stages(&prepared.stages, host);
    let mut found = identify_curves(config, tire_curves(&prepared), host)?;
    if config.axle_coupling > 0.0 {
        couple_axles(&mut found, config.axle_coupling)?;
    }
    report_progress(host, 0.94, "loads and longitudinal forces")?;
    let mut loads = LoadEffectFits::fit(&prepared, &pipeline);
    propagate_uncertainty(config, &pipeline, &uncertainty, &recording, &mut found, &mut loads, host)?;
    for estimate in found.iter_mut().flat_map(|it| &mut it.answer.estimates) {
        remove_absent_peak(&mut estimate.1);
        doctor::cap_estimate_verdicts(&log, &mut estimate.1);
    }
    let longitudinal =
        |key: &str| found.iter().find(|it| it.curve.key == key).map(CurveAnswer::first_estimate);
    let mut loads = loads.axle_load_effects(["front_x", "rear_x"].map(longitudinal));
    doctor::cap_loads(&log, &mut loads);
    let signal = |name: &str| request.find_signal(name).map(|it| [it.time, it.values]);
    let drift = stretches::estimate_drift(&config.drift, signal, &prepared, &pipeline);
    let result = TiresResult {
        config,
        found: &found,
        prepared: &prepared,
        log: &log,
        drift: &drift,
        loads: &loads,
        body: &car.body,
        is_widened: !perturbed_cars(&car, &uncertainty).is_empty(),
    };
    // Each curve has its own data: what they leave open is independent.
    let (posteriors, verdict) = (result.tire_posteriors(), result.identification_summary().verdict());
    write_start_values(&posteriors, DrawDependence::Independent, &verdict, config.seed, host);
    result.write_page(&page::car::logged_car_facts(&car, &uncertainty), host);
    let mut report = result.result_json();
    if let Some(windows) = &config.windows {
        report["windows"] = stretches::assess_windows(windows, &prepared, &pipeline);
    }
    Ok(report)
}

/// Identifies each curve by itself.
fn identify_curves<'a>(
    config: &TiresConfig,
    curves: Vec<TireCurve<'a>>,
    host: &mut dyn AnalysisServices,
) -> Result<Vec<CurveAnswer<'a>>, String> {
    let count = curves.len();
    let mut found = Vec::with_capacity(count);
    for (number, curve) in (1..).zip(curves) {
        report_progress(host, f64::from(number) / (count + 1) as f64, curve.name)?;
        let fit = match curve.direction {
            ForceDirection::Lateral => &config.lateral,
            ForceDirection::Longitudinal => &config.longitudinal,
        };
        let usual = fit.fit_settings(curve.direction, curve.points.shift, config.seed);
        let prior_from_file = config.files.prior_of_curve(curve.key, &usual.prior.free)?;
        let settings = IdentificationSettings { prior_from_file, svi: config.svi, ..usual };
        let samples = &curve.points.samples;
        let wrong = |error: FitError| format!("{}: {error}", curve.name);
        let begin = Instant::now();
        let settings = fit.loss.apply_to_settings(settings, samples).map_err(wrong)?;
        let (settings, extensions) = settings.extend_bounds(samples).map_err(wrong)?;
        let settling = begin.elapsed().as_secs_f64();
        let mut answer = identify_tire(samples, &settings, &config.methods).map_err(wrong)?;
        for (_, estimate) in &mut answer.estimates {
            estimate.seconds += settling;
        }
        found.push(CurveAnswer { curve, settings, extensions, answer });
    }
    Ok(found)
}

/// Fits the lateral curves of both axles again, drawn to each other.
fn couple_axles(found: &mut [CurveAnswer], weight: f64) -> Result<(), String> {
    let lateral = found.iter_mut().filter(|it| it.curve.direction == ForceDirection::Lateral);
    let axles: Vec<_> = lateral
        .map(|CurveAnswer { curve, settings, answer, .. }| AxleFit {
            samples: &curve.points.samples,
            settings,
            answer,
        })
        .collect();
    let Ok(axles) = <[_; 2]>::try_from(axles) else { return Ok(()) };
    fit_coupled_axles(axles, weight).map_err(|error| format!("axle_coupling: {error}"))
}

/// Widens each curve, and what loads tell, by how far they move with the uncertain data of the car.
fn propagate_uncertainty(
    config: &TiresConfig,
    pipeline: &PreparationPipeline,
    uncertainty: &CarUncertainty,
    recording: &DriveLog,
    found: &mut [CurveAnswer],
    loads: &mut LoadEffectFits,
    host: &mut dyn AnalysisServices,
) -> Result<(), String> {
    let mut widenings = vec![PropagatedUncertainty::default(); found.len()];
    for (name, cars) in perturbed_cars(&pipeline.car, uncertainty) {
        report_progress(host, 0.95, &format!("fitting with another {name}"))?;
        let refits = refit_with_both_cars(pipeline, recording, cars, |pipeline, prepared| {
            refit_curves_and_loads(pipeline, prepared, found, loads)
        });
        let [low, high] = refits.map_err(|error| format!("with another {name}: {error}"))?;
        loads.add_car_uncertainty(name, [low.loads, high.loads]);
        for (widening, ends) in widenings.iter_mut().zip(low.curves.into_iter().zip(high.curves)) {
            widening.add_refits(name, ends.into());
        }
    }
    if let Some((name, cars)) = cars_with_other_brake_share(&pipeline.car) {
        report_progress(host, 0.97, &format!("loads with another {name}"))?;
        let refits = refit_with_both_cars(pipeline, recording, cars, |pipeline, prepared| {
            Ok(loads.refit_with_car(prepared, pipeline))
        });
        loads.add_car_uncertainty(name, refits?);
    }
    for (widening, it) in widenings.iter().zip(found) {
        widening.widen_answer(&mut it.answer, &it.settings.prior, config.seed);
    }
    Ok(())
}

/// Parameters of all curves, and effects of loads, with another car.
struct RefitResult {
    curves: Vec<Theta>,
    loads: loads::CarLoadEffects,
}

/// Prepares the points with each of two cars and does something with them, side by side.
fn refit_with_both_cars<T: Send>(
    pipeline: &PreparationPipeline,
    recording: &DriveLog,
    [low, high]: [Car; 2],
    refit: impl Fn(&PreparationPipeline, &PreparedRecording) -> Result<T, String> + Sync,
) -> Result<[T; 2], String> {
    let refit_with = |car| {
        let pipeline = PreparationPipeline { car, ..pipeline.clone() };
        let prepared = pipeline.prepare(recording).map_err(|error| error.to_string())?;
        refit(&pipeline, &prepared)
    };
    let (low, high) = rayon::join(|| refit_with(low), || refit_with(high));
    Ok([low?, high?])
}

/// Fits each curve again from where it is, to the points with another car.
fn refit_curves_and_loads(
    pipeline: &PreparationPipeline,
    prepared: &PreparedRecording,
    found: &[CurveAnswer],
    loads: &LoadEffectFits,
) -> Result<RefitResult, String> {
    let mut thetas = Vec::with_capacity(found.len());
    for (curve, CurveAnswer { settings, answer, .. }) in tire_curves(prepared).into_iter().zip(found) {
        let start = answer.unrestricted.first().map(|(_, solution)| solution.theta);
        let options = start.map_or(settings.options, FitOptions::from_start);
        let settings = IdentificationSettings { options, ..settings.clone() };
        let fit = settings.fit(&curve.points.samples, &settings.prior, FitMethod::LeastSquares);
        thetas.push(fit.map_err(|error| error.to_string())?.theta);
    }
    Ok(RefitResult { curves: thetas, loads: loads.refit_with_car(prepared, pipeline) })
}

/// What to drive next: the slips, up to half as much again as was driven, and how much of the time at each, that would tell
/// most about this tire.
fn design_json(CurveAnswer { curve, answer, .. }: &CurveAnswer) -> Option<Value> {
    let [low, high] = curve.points.samples.slip_range()?;
    let tire = tire_inference::parameters::magic_formula_from_theta(&answer.unrestricted.first()?.1.theta);
    let design = d_optimal(&tire, 1.5 * low.abs().max(high.abs()))?;
    Some(json!({ "slips": design.slips, "shares": design.shares }))
}

/// Everything that the task found, for the result and the page.
struct TiresResult<'a> {
    config: &'a TiresConfig,
    found: &'a [CurveAnswer<'a>],
    prepared: &'a PreparedRecording,
    log: &'a LogExamination,
    drift: &'a [stretches::QuantityDrift],
    loads: &'a [AxleLoadEffects],
    body: &'a VehicleBody,
    /// Whether uncertain data of the car widen intervals.
    is_widened: bool,
}

impl TiresResult<'_> {
    /// What was found as a whole, in words.
    fn identification_summary(&self) -> IdentificationSummary<'_> {
        let mut summary = overall_summary(self.found.iter().map(|it| curve_summary(it, self.body)).collect());
        doctor::add_findings_to_summary(self.log, &mut summary);
        let told = |it: &CurveAnswer| -> Vec<String> {
            it.extensions.iter().map(|extension| format!("{}: {extension}", it.curve.name)).collect()
        };
        summary.log.extend(self.found.iter().flat_map(told));
        if self.is_widened {
            summary.widened = CAR_ADDED;
        }
        summary.remarks.extend(posterior_draws::reason_for_no_draws(&self.tire_posteriors()));
        summary
    }

    /// The tires that the plant has.
    fn tire_posteriors(&self) -> Vec<TirePosterior<'_>> {
        let lateral = self.found.iter().filter(|it| it.curve.direction == ForceDirection::Lateral);
        let mut posteriors = Vec::new();
        for it in lateral {
            let tire = IdentifiedTire {
                node: &self.config.node,
                tire: if it.curve.key == "front" { "tire_f" } else { "tire_r" },
                estimate: it.first_estimate(),
                direction: it.curve.direction,
            };
            posteriors.push(TirePosterior {
                tire,
                posterior: posterior_of_estimate(&it.answer, it.first_estimate()),
            });
        }
        posteriors
    }

    /// Estimates by method, then by curve, and what else was found.
    fn result_json(&self) -> Value {
        let by_curve = |value: &dyn Fn(&CurveAnswer) -> Value| -> Value {
            let entries = self.found.iter().map(|it| (it.curve.key.to_owned(), value(it)));
            Value::Object(entries.collect())
        };
        let mut numbers = Map::from_iter([("preparation".to_owned(), json!(self.prepared.report))]);
        for (index, method) in self.config.methods.iter().enumerate() {
            let estimates = by_curve(&|it| json!(it.answer.estimates[index].1));
            numbers.insert(method.name().to_owned(), estimates);
        }
        numbers.insert("design".to_owned(), by_curve(&|it| json!(design_json(it))));
        numbers.insert("bounds".to_owned(), by_curve(&|it| json!(it.settings.prior.bounds)));
        numbers.insert("bound_extensions".to_owned(), by_curve(&|it| json!(it.extensions)));
        let mut result = self.identification_summary().result_json(Some(self.log), numbers);
        result["drift"] = stretches::drift_json(self.drift);
        [result["load_sensitivity"], result["combined_slip"]] = loads::load_effects_json(self.loads);
        result
    }

    /// Leaves the page, with facts about the car.
    fn write_page<'s>(&'s self, car: &[(String, String)], host: &mut dyn AnalysisServices) {
        let section = |it: &'s CurveAnswer<'_>| TireSection {
            name: it.curve.name,
            direction: it.curve.direction,
            samples: &it.curve.points.samples,
            prior: &it.settings.prior,
            methods: method_sections(&it.answer),
        };
        let page = PageContent {
            title: "Tires",
            overall: Some(&self.identification_summary()),
            car,
            facts: &facts::preparation_facts(self.prepared),
            log: Some(self.log),
            drift: self.drift,
            loads: self.loads,
            sections: self.found.iter().map(section).collect(),
            ..PageContent::default()
        };
        page::write_page(&page, host);
    }
}

fn curve_summary<'a>(it: &'a CurveAnswer, body: &VehicleBody) -> CurveSummary<'a> {
    let [front, rear] = axle_loads_at_rest(body);
    CurveSummary {
        name: it.curve.axle,
        direction: it.curve.direction,
        estimate: it.first_estimate(),
        prior: &it.settings.prior,
        load: Some(if it.curve.axle == "front" { front } else { rear }),
    }
}

/// Shows what went into and came out of each step. What went in is shown where nothing before it shows it.
fn record_stages(stages: &[PreparationStage], host: &mut dyn AnalysisServices) {
    let mut shown: BTreeMap<&str, &StageColumn> = BTreeMap::new();
    for (number, stage) in stages.iter().enumerate() {
        let new = stage.inputs.iter().filter(|column| shown.get(column.name.as_str()) != Some(column));
        let inputs: Vec<_> = new.collect();
        record_columns(&format!("{number} {} from", stage.name), &inputs, host);
        let outputs: Vec<_> = stage.outputs.iter().collect();
        record_columns(&format!("{number} {}", stage.name), &outputs, host);
        for column in &stage.outputs {
            shown.insert(&column.name, column);
        }
    }
}

/// Records columns, those of the same times together.
fn record_columns(group: &str, columns: &[&StageColumn], host: &mut dyn AnalysisServices) {
    let mut rest = columns.to_vec();
    let mut part = 1;
    while let Some(first) = rest.first().copied() {
        let (same, others): (Vec<_>, Vec<_>) = rest.into_iter().partition(|column| column.time == first.time);
        let signals: Vec<_> = same
            .iter()
            .map(|column| Signal {
                name: &column.name,
                unit: column.unit,
                time: &column.time,
                values: &column.values,
            })
            .collect();
        let name = if part == 1 { group.to_owned() } else { format!("{group} {part}") };
        host.record_signals(&name, &signals);
        rest = others;
        part += 1;
    }
}
