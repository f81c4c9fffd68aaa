//! Reads the configuration of an identification: the part `[analysis.config]` of a scenario.

mod bench;
mod bounds;
mod car;
mod closed_loop;
mod curve;
mod doctor;
mod prediction;
mod rules;
mod shared;
pub mod stretches;
mod study;
mod tires;
mod uncertain_value;

use std::collections::BTreeMap;

pub use bench::Bench;
pub use bounds::BoundsChoice;
pub use car::{DrivenCar, LoggedCar};
pub use closed_loop::{ClosedLoop, HoldOut};
pub use curve::{Curve, Hold, OneCurve};
pub use doctor::Doctor;
use plugin::ConfigError;
pub use prediction::Prediction;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;
pub use study::Sensitivity;
use tire_inference::parameters::Parameter;
use tire_inference::prior::Prior;
use tire_inference::settings::Method;
use tire_inference::synthetic::Excitation;
pub use tires::Tires;

/// Configuration of the plugin `identify`, in `[analysis.config]` of a scenario: a task and its settings.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(tag = "task", rename_all = "snake_case")]
pub enum Config {
    /// Identifies the tires of a car from its motion.
    Tires(Box<Tires>),
    /// Identifies the tires of both axles from drives under closed-loop control.
    ClosedLoop(Box<ClosedLoop>),
    /// Identifies one curve from slips and forces.
    Curve(Box<OneCurve>),
    /// Fits a tire to data of a test bench.
    Bench(Box<Bench>),
    /// Looks for errors in a log.
    Doctor(Doctor),
    /// Identifies a car that predicts drives, and judges it on parts that were not fitted.
    Prediction(Box<Prediction>),
    /// Finds the excitation that identifies each parameter.
    ExcitationStudy(Excitation),
    /// Finds the parameters that matter at each slip.
    SensitivityStudy(Sensitivity),
}

/// The key that the other keys depend on.
#[derive(Deserialize)]
struct Head {
    task: Task,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Task {
    Tires,
    ClosedLoop,
    Curve,
    Bench,
    Doctor,
    Prediction,
    ExcitationStudy,
    SensitivityStudy,
}

impl Config {
    /// Reads and checks TOML.
    ///
    /// # Errors
    /// With the path of the wrong key.
    pub fn read(text: &str) -> Result<Self, ConfigError> {
        let Head { task } = plugin::from_toml(text)?;
        let mut table: toml::Table = plugin::from_toml(text)?;
        table.remove("task");
        shared::take(&mut table, &task)?;
        let rest = table.to_string();
        // One by one, not as a tagged enum: serde loses the path of a key inside of those.
        let config = match task {
            Task::Tires => Self::Tires(settings(&rest)?),
            Task::ClosedLoop => Self::ClosedLoop(settings(&rest)?),
            Task::Curve => Self::Curve(settings(&rest)?),
            Task::Bench => Self::Bench(settings(&rest)?),
            Task::Doctor => Self::Doctor(settings(&rest)?),
            Task::Prediction => Self::Prediction(settings(&rest)?),
            Task::ExcitationStudy => Self::ExcitationStudy(settings(&rest)?),
            Task::SensitivityStudy => Self::SensitivityStudy(settings(&rest)?),
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
            Self::ExcitationStudy(excitation) => study::check(excitation),
            Self::SensitivityStudy(sensitivity) => sensitivity.check(),
        }
    }

    /// The JSON schema of all settings.
    pub fn schema() -> String {
        format!("{:#}", schemars::schema_for!(Self).as_value())
    }
}

fn settings<T: DeserializeOwned>(text: &str) -> Result<T, ConfigError> {
    plugin::from_toml(text)
}

fn methods() -> Vec<Method> {
    vec![Method::LeastSquares, Method::NelderMead]
}

fn plant() -> String {
    "plant".to_owned()
}

/// The usual prior with other bounds and other typical values.
fn prior(usual: Prior, bounds: &BoundsChoice, typical: &BTreeMap<Parameter, f64>) -> Prior {
    let mut prior = usual.within(bounds.bounds());
    for (&parameter, &value) in typical {
        prior.centre[parameter as usize] = value;
    }
    prior
}
