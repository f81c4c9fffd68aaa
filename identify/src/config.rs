//! Reads the configuration of an identification: the part `[analysis.config]` of a scenario.

mod bench;
mod bounds;
mod car;
mod closed_loop;
mod curve;
mod doctor;
mod fastest_lap;
mod prediction;
mod rules;
mod shared;
pub mod stretches;
mod study;
mod tires;
mod uncertain_value;

use std::collections::BTreeMap;

pub use bench::BenchConfig;
pub use bounds::BoundsChoice;
pub use car::{ClosedLoopCarConfig, LoggedCar};
pub use closed_loop::{ClosedLoop, HoldOut};
pub use curve::{CurveConfig, FixedParameters, OneCurve};
pub use doctor::DoctorConfig;
pub use fastest_lap::FastestLapConfig;
use plugin::ConfigError;
pub use prediction::PredictionConfig;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;
pub use study::SensitivityConfig;
use tire_inference::parameters::Parameter;
use tire_inference::prior::Prior;
use tire_inference::settings::FitMethod;
use tire_inference::synthetic::SyntheticExcitation;
pub use tires::TiresConfig;

/// Configuration of the plugin `identify`, in `[analysis.config]` of a scenario: a task and its settings.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(tag = "task", rename_all = "snake_case")]
pub enum IdentifyConfig {
    /// Identifies the tires of a car from its motion.
    Tires(Box<TiresConfig>),
    /// Identifies the tires of both axles from drives under closed-loop control.
    ClosedLoop(Box<ClosedLoop>),
    /// Identifies one curve from slips and forces.
    Curve(Box<OneCurve>),
    /// Fits a tire to data of a test bench.
    Bench(Box<BenchConfig>),
    /// Looks for errors in a log.
    Doctor(DoctorConfig),
    /// Identifies a car that predicts drives, and judges it on parts that were not fitted.
    Prediction(Box<PredictionConfig>),
    /// Finds the fastest lap of a car on a track, and the time that a drive loses to it.
    FastestLap(Box<FastestLapConfig>),
    /// Finds the excitation that identifies each parameter.
    ExcitationStudy(SyntheticExcitation),
    /// Finds the parameters that matter at each slip.
    SensitivityStudy(SensitivityConfig),
}

/// The key that the other keys depend on.
#[derive(Deserialize)]
struct TaskHeader {
    task: IdentifyTask,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum IdentifyTask {
    Tires,
    ClosedLoop,
    Curve,
    Bench,
    Doctor,
    Prediction,
    FastestLap,
    ExcitationStudy,
    SensitivityStudy,
}

impl IdentifyConfig {
    /// Reads and checks TOML.
    ///
    /// # Errors
    /// With the path of the wrong key.
    pub fn parse(text: &str) -> Result<Self, ConfigError> {
        let TaskHeader { task } = plugin::from_toml(text)?;
        let mut table: toml::Table = plugin::from_toml(text)?;
        table.remove("task");
        shared::apply_shared_parameters(&mut table, &task)?;
        let rest = table.to_string();
        // One by one, not as a tagged enum: serde loses the path of a key inside of those.
        let config = match task {
            IdentifyTask::Tires => Self::Tires(parse_settings(&rest)?),
            IdentifyTask::ClosedLoop => Self::ClosedLoop(parse_settings(&rest)?),
            IdentifyTask::Curve => Self::Curve(parse_settings(&rest)?),
            IdentifyTask::Bench => Self::Bench(parse_settings(&rest)?),
            IdentifyTask::Doctor => Self::Doctor(parse_settings(&rest)?),
            IdentifyTask::Prediction => Self::Prediction(parse_settings(&rest)?),
            IdentifyTask::FastestLap => Self::FastestLap(parse_settings(&rest)?),
            IdentifyTask::ExcitationStudy => Self::ExcitationStudy(parse_settings(&rest)?),
            IdentifyTask::SensitivityStudy => Self::SensitivityStudy(parse_settings(&rest)?),
        };
        config.check()?;
        Ok(config)
    }

    fn check(&self) -> Result<(), ConfigError> {
        match self {
            Self::Tires(tires) => tires.check(),
            Self::ClosedLoop(drive) => drive.check(),
            Self::Curve(curve) => curve.check(),
            Self::Bench(bench) => bench.check(),
            Self::Doctor(doctor) => doctor.check(),
            Self::Prediction(prediction) => prediction.check(),
            Self::FastestLap(lap) => lap.check(),
            Self::ExcitationStudy(excitation) => study::check_excitation(excitation),
            Self::SensitivityStudy(sensitivity) => sensitivity.check(),
        }
    }

    /// The JSON schema of all settings.
    pub fn json_schema() -> String {
        format!("{:#}", schemars::schema_for!(Self).as_value())
    }
}

fn parse_settings<T: DeserializeOwned>(text: &str) -> Result<T, ConfigError> {
    plugin::from_toml(text)
}

fn methods() -> Vec<FitMethod> {
    vec![FitMethod::LeastSquares, FitMethod::NelderMead]
}

fn plant() -> String {
    "plant".to_owned()
}

/// The usual prior with other bounds and other typical values.
fn prior_with_overrides(usual: Prior, bounds: &BoundsChoice, typical: &BTreeMap<Parameter, f64>) -> Prior {
    let mut prior = usual.with_bounds(bounds.bounds());
    for (&parameter, &value) in typical {
        prior.centre[parameter as usize] = value;
    }
    prior
}
