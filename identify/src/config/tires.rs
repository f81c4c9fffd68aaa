//! Configuration of `task = "tires"`.

use drive_inference::CarUncertainty;
use plugin::ConfigError;
use preparation::{Car, Error, Pipeline};
use schemars::JsonSchema;
use serde::Deserialize;
use tire_inference::settings::Method;
use tire_inference::variational::Optimiser;

use super::car::LoggedCar;
use super::curve::Curve;
use super::stretches::{Drift, Windows};
use super::{methods, plant, rules};
use crate::prior_from_file::Files;

/// Identifies the tires of a car from its motion.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tires {
    /// The car, which is needed: its data have no default.
    pub car: Option<LoggedCar>,
    /// Preparation: from signals to points of curves.
    #[serde(default)]
    pub prepare: Pipeline,
    /// Prior knowledge and fit of the lateral curves.
    #[serde(default)]
    pub lateral: Curve,
    /// Prior knowledge and fit of the longitudinal curves.
    #[serde(default)]
    pub longitudinal: Curve,
    /// Methods of the fit. The first one fills `tires.toml`.
    #[serde(default = "methods")]
    pub methods: Vec<Method>,
    /// Optimiser of the method `svi`.
    #[serde(default)]
    pub svi: Optimiser,
    /// λ_sim: weight of the difference between front and rear lateral curves [-], in standard deviations of a uniform
    /// distribution within the bounds, or within `goblirsch2025` where that is narrower.
    #[serde(default)]
    pub axle_coupling: f64,
    /// Drift of stiffness and friction of both axles over the log.
    #[serde(default)]
    pub drift: Drift,
    /// Judges windows of the log by themselves, if it is there: whether each tells the lateral curves.
    pub windows: Option<Windows>,
    /// Node that gets the start values in `tires.toml`.
    #[serde(default = "plant")]
    pub node: String,
    /// Text files of the scenario, from `[analysis.files]`.
    #[serde(default)]
    #[schemars(skip)]
    pub files: Files,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl Tires {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        rules::methods(&self.methods)?;
        rules::not_negative("axle_coupling", self.axle_coupling)?;
        rules::svi(&self.svi)?;
        self.drift.check().map_err(|error| error.within("drift"))?;
        let mut windows = self.windows.iter();
        windows.try_for_each(Windows::check).map_err(|error| error.within("windows"))?;
        // The car has its own errors.
        let prepare = Pipeline { car: Car::default(), ..self.prepare.clone() };
        prepare.check().map_err(|error| match &error {
            Error::Setting { name, .. } => {
                ConfigError::at(name, error.to_string()).within("prepare")
            }
            _ => ConfigError::at("prepare", error.to_string()),
        })?;
        self.lateral.check().map_err(|error| error.within("lateral"))?;
        self.longitudinal.check().map_err(|error| error.within("longitudinal"))?;
        self.files.check(&["front", "rear", "front_x", "rear_x"])?;
        self.car().map(drop)
    }

    /// The car, and how well it is known.
    ///
    /// # Errors
    /// When data are missing or make no sense.
    pub fn car(&self) -> Result<(Car, CarUncertainty), ConfigError> {
        self.car.clone().unwrap_or_default().read()
    }
}
