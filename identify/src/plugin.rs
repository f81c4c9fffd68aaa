//! Does what a scenario asks for: from its signals and settings to a result, a page, and start values for the next run.

mod bench;
mod closed_loop;
mod curve;
mod doctor;
mod fastest_lap;
#[cfg(test)]
mod hostile;
mod prediction;
mod sideslip;
mod tires;

use plugin::{Analysis, AnalysisError, AnalysisRequest, AnalysisServices, ConfigError, InputSignal};
use preparation::DriveLog;
use serde_json::{Value, json};
use tire_inference::estimate::{TireEstimate, TireIdentification};
use tire_inference::model::{FitTest, ModelFit, ModelVerdict};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::predictive::PosteriorPredictiveCheck;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::settings::FitMethod;
use tire_inference::synthetic::SyntheticExcitation;

use crate::config::{IdentifyConfig, SensitivityConfig};
use crate::page::{self, PageContent};
use crate::posterior_draws::{self, DrawDependence, TirePosterior};
use crate::start_values;
use crate::studies::{excitation, sensitivity};
use crate::summary::{CurveSummary, IdentificationSummary};

/// The plugin.
struct Identify;

impl Analysis for Identify {
    const INPUTS: &'static [InputSignal] = &[
        InputSignal::optional("v_x", "m/s", "forward velocity of the centre of gravity"),
        InputSignal::optional("v_y", "m/s", "velocity of the centre of gravity to the left"),
        InputSignal::optional("a_x", "m/s2", "forward acceleration"),
        InputSignal::optional("a_y", "m/s2", "acceleration to the left"),
        InputSignal::optional("a_z", "m/s2", "vertical specific force; 9.81 on a level road"),
        InputSignal::optional("r", "rad/s", "yaw rate"),
        InputSignal::optional("delta", "rad", "steering angle of the front wheels"),
        InputSignal::optional("F_x", "N", "longitudinal force, braking when negative"),
        InputSignal::optional("omega_fl", "rad/s", "speed of the front left wheel"),
        InputSignal::optional("omega_fr", "rad/s", "speed of the front right wheel"),
        InputSignal::optional("omega_rl", "rad/s", "speed of the rear left wheel"),
        InputSignal::optional("omega_rr", "rad/s", "speed of the rear right wheel"),
        InputSignal::optional("tread_temperature_f", "K", "temperature of the front treads"),
        InputSignal::optional("tread_temperature_r", "K", "temperature of the rear treads"),
        InputSignal::optional(
            "roll",
            "rad",
            "roll angle of the body, road included; positive when its left side is up",
        ),
        InputSignal::optional(
            "course",
            "rad",
            "direction of travel over ground, as of GNSS; positive to the left",
        ),
        InputSignal::optional("ground_speed", "m/s", "speed over ground, as of GNSS"),
        InputSignal::optional(
            "x",
            "m",
            "position on the ground; with y it stands for the course, or is that of a lap on its track",
        ),
        InputSignal::optional("y", "m", "position on the ground, to the left of the axis of x"),
        InputSignal::optional("gear", "", "gear"),
        InputSignal::optional("lap", "", "number of the lap"),
        InputSignal::optional("log", "", "number of the log, from 1, where a table has several paths"),
        InputSignal::optional("slip", "", "slip angle [rad] or slip ratio of one tire"),
        InputSignal::optional("force", "", "its force over its load"),
    ];

    fn check_request(request: &AnalysisRequest) -> Result<(), ConfigError> {
        match IdentifyConfig::parse(request.config)? {
            IdentifyConfig::Tires(config) => {
                let has = |name: &str| request.find_signal(name).is_some();
                config.car.iter().try_for_each(|car| car.check_wheel_data(has))?;
                config.drift.check_lap_signal(has)?;
                drive_log(request).check_completeness().map_err(|error| error.to_string().into())
            }
            IdentifyConfig::ClosedLoop(config) => {
                Ok(closed_loop::drive_from_log(&drive_log(request), config.gap).map(drop)?)
            }
            IdentifyConfig::Curve(config) => {
                Ok(curve::slip_force_columns(request, config.direction).map(drop)?)
            }
            IdentifyConfig::Doctor(_) => Ok(doctor::check_has_drive_signal(request)?),
            IdentifyConfig::Prediction(config) => Ok(prediction::check_required_signals(&config, request)?),
            IdentifyConfig::FastestLap(_) => Ok(fastest_lap::check_position(request)?),
            IdentifyConfig::Bench(_)
            | IdentifyConfig::ExcitationStudy(_)
            | IdentifyConfig::SensitivityStudy(_) => Ok(()),
        }
    }

    fn run(request: &AnalysisRequest, host: &mut dyn AnalysisServices) -> Result<String, AnalysisError> {
        let result = match IdentifyConfig::parse(request.config)? {
            IdentifyConfig::Tires(config) => tires::identify_tires(&config, request, host)?,
            IdentifyConfig::ClosedLoop(config) => closed_loop::closed_loop(&config, request, host)?,
            IdentifyConfig::Curve(config) => curve::identify_curve(&config, request, host)?,
            IdentifyConfig::Bench(config) => bench::run_bench_fit(&config, host)?,
            IdentifyConfig::Doctor(config) => doctor::run_doctor(&config, request, host),
            IdentifyConfig::Prediction(config) => prediction::run_prediction(&config, request, host)?,
            IdentifyConfig::FastestLap(config) => fastest_lap::find_fastest_lap(&config, request, host)?,
            IdentifyConfig::ExcitationStudy(study) => excitation_study(&study, host)?,
            IdentifyConfig::SensitivityStudy(study) => sensitivity_study(&study, host),
        };
        Ok(result.to_string())
    }

    fn config_schema() -> Option<String> {
        Some(IdentifyConfig::json_schema())
    }
}

plugin::export!(Identify);

/// The signals of a request.
fn drive_log<'a>(request: &AnalysisRequest<'a>) -> DriveLog<'a> {
    let mut log = DriveLog::default();
    request.signals.iter().for_each(|it| log.insert_borrowed(it.name, it.time, it.values));
    log
}

/// What an analysis says that the program asked to give up.
const CANCELLED: &str = "cancelled";

fn report_progress(host: &mut dyn AnalysisServices, share: f64, what: &str) -> Result<(), String> {
    if host.report_progress(share, what) { Ok(()) } else { Err(CANCELLED.to_owned()) }
}

/// What was found of these curves as a whole: whether the model fits is what their samples say under the posterior of each.
fn overall_summary<'a>(curves: Vec<CurveSummary<'a>>) -> IdentificationSummary<'a> {
    let predictive = |told: &CurveSummary<'a>| told.estimate.posterior.as_ref()?.predictive.as_ref();
    let checks: Vec<_> = curves.iter().filter_map(|told| Some((told.title(), predictive(told)?))).collect();
    let wrong: Vec<_> = checks.iter().filter(|(_, check)| !check.fits).collect();
    let named = |(title, check): &(String, &PosteriorPredictiveCheck)| {
        let tests = check.tests.clone().into_iter();
        tests.map(|test| FitTest { name: format!("{title}: {}", test.name), ..test }).collect::<Vec<_>>()
    };
    let tests: Vec<FitTest> = checks.iter().flat_map(named).collect();
    let model = match (checks.is_empty(), wrong.is_empty()) {
        (true, _) => ModelVerdict::default(),
        (_, true) => {
            ModelVerdict { sentence: "The model fits the data.".to_owned(), tests, ..ModelVerdict::default() }
        }
        _ => {
            let names: Vec<_> = wrong.iter().map(|(title, _)| title.as_str()).collect();
            let sentence = format!("The model does not fit the data ({}).", names.join(", "));
            ModelVerdict { verdict: ModelFit::DoesNotFit, sentence, tests }
        }
    };
    let log = wrong.iter().map(|(title, check)| format!("{title}: {}", check.message)).collect();
    IdentificationSummary { model, log, curves, ..IdentificationSummary::default() }
}

/// What the page shows of each method.
fn method_sections<'a>(found: &'a TireIdentification) -> Vec<page::MethodSection<'a>> {
    let shown = |(method, estimate): &'a (FitMethod, TireEstimate)| {
        let variational = found.variational.as_ref().filter(|_| estimate.svi.is_some());
        let posterior = posterior_of_estimate(found, estimate);
        let gaussian = variational.map(|variational| &variational.gaussian);
        page::MethodSection { name: method.title(), estimate, posterior, gaussian }
    };
    found.estimates.iter().map(shown).collect()
}

/// The draws that the uncertainty of an estimate is that of.
fn posterior_of_estimate<'a>(found: &'a TireIdentification, estimate: &TireEstimate) -> &'a PosteriorSamples {
    let variational = found.variational.as_ref().filter(|_| estimate.svi.is_some());
    match (estimate.source, variational) {
        (UncertaintySource::Svi, Some(variational)) => &variational.corrected,
        _ => &found.posterior,
    }
}

/// Leaves what was found for the next run, and for a sweep over what the data left open.
fn write_start_values(
    tires: &[TirePosterior],
    dependence: DrawDependence,
    verdict: &str,
    seed: u64,
    host: &mut dyn AnalysisServices,
) {
    let found: Vec<_> = tires.iter().map(|drawn| drawn.tire).collect();
    host.write_file("tires.toml", &start_values::start_values_toml(&found, verdict));
    if let Some(text) = posterior_draws::draws_csv(tires, dependence, seed) {
        host.write_file(posterior_draws::FILE, &text);
    }
}

fn sensitivity_study(config: &SensitivityConfig, host: &mut dyn AnalysisServices) -> Value {
    let SensitivityConfig { tire, spread, limit, count } = *config;
    let study = sensitivity::run_sensitivity_study(
        &tire_inference::parameters::magic_formula_from_theta(&tire),
        spread,
        limit,
        count,
    );
    let page =
        PageContent { title: "Which parameter matters", sensitivity: Some(&study), ..PageContent::default() };
    page::write_page(&page, host);
    json!({ "sensitivity": study })
}

fn excitation_study(config: &SyntheticExcitation, host: &mut dyn AnalysisServices) -> Result<Value, String> {
    let mut go_on = |index: usize| {
        let (level, count) = (config.levels[index], config.levels.len());
        host.report_progress(index as f64 / count as f64, &format!("excitation to {} %", 100.0 * level))
    };
    let study = excitation::run_excitation_study(config, &mut go_on).map_err(|error| error.to_string())?;
    let study = study.ok_or(CANCELLED)?;
    let SensitivityConfig { spread, limit, count, .. } = SensitivityConfig::default();
    let tire = tire_inference::parameters::magic_formula_from_theta(&config.truth);
    let sensitivity = sensitivity::run_sensitivity_study(&tire, spread, limit, count);
    let page = PageContent {
        title: "What excitation tells",
        excitation: Some(&study),
        sensitivity: Some(&sensitivity),
        ..PageContent::default()
    };
    page::write_page(&page, host);
    Ok(json!({ "excitation": study }))
}
