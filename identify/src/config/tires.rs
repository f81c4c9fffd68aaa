//! Configuration of `task = "tires"`.

use drive_inference::CarUncertainty;
use plugin::ConfigError;
use preparation::{Car, Error, PreparationPipeline};
use schemars::JsonSchema;
use serde::Deserialize;
use tire_inference::settings::FitMethod;
use tire_inference::variational::ElboOptimiser;

use super::car::LoggedCar;
use super::curve::CurveConfig;
use super::stretches::{DriftConfig, WindowConfig};
use super::{methods, plant, rules};
use crate::prior_from_file::PriorFiles;

/// Identifies the tires of a car from its motion.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TiresConfig {
    /// The car, which is needed: its data have no default.
    pub car: Option<LoggedCar>,
    /// Preparation: from signals to points of curves.
    #[serde(default)]
    pub prepare: PreparationPipeline,
    /// Prior knowledge and fit of the lateral curves.
    #[serde(default)]
    pub lateral: CurveConfig,
    /// Prior knowledge and fit of the longitudinal curves.
    #[serde(default)]
    pub longitudinal: CurveConfig,
    /// Methods of the fit. The first one fills `tires.toml`.
    #[serde(default = "methods")]
    pub methods: Vec<FitMethod>,
    /// Optimiser of the method `svi`.
    #[serde(default)]
    pub svi: ElboOptimiser,
    /// λ_sim: weight of the difference between front and rear lateral curves [-], in standard deviations of a uniform
    /// distribution within the bounds, or within `goblirsch2025` where that is narrower.
    #[serde(default)]
    pub axle_coupling: f64,
    /// Drift of stiffness and friction of both axles over the log.
    #[serde(default)]
    pub drift: DriftConfig,
    /// Judges windows of the log by themselves, if it is there: whether each tells the lateral curves.
    pub windows: Option<WindowConfig>,
    /// Node that gets the start values in `tires.toml`.
    #[serde(default = "plant")]
    pub node: String,
    /// Text files of the scenario, from `[analysis.files]`.
    #[serde(default)]
    #[schemars(skip)]
    pub files: PriorFiles,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl TiresConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        rules::check_methods(&self.methods)?;
        rules::not_negative("axle_coupling", self.axle_coupling)?;
        rules::check_svi_settings(&self.svi)?;
        self.drift.check().map_err(|error| error.with_parent_key("drift"))?;
        let mut windows = self.windows.iter();
        windows.try_for_each(WindowConfig::check).map_err(|error| error.with_parent_key("windows"))?;
        // The car has its own errors.
        let prepare = PreparationPipeline { car: Car::default(), ..self.prepare.clone() };
        prepare.check_settings().map_err(|error| match &error {
            Error::Setting { name, .. } => {
                ConfigError::at_key(name, error.to_string()).with_parent_key("prepare")
            }
            _ => ConfigError::at_key("prepare", error.to_string()),
        })?;
        self.lateral.check().map_err(|error| error.with_parent_key("lateral"))?;
        self.longitudinal.check().map_err(|error| error.with_parent_key("longitudinal"))?;
        self.files.check(&["front", "rear", "front_x", "rear_x"])?;
        self.car().map(drop)
    }

    /// The car, and how well it is known.
    ///
    /// # Errors
    /// When data are missing or make no sense.
    pub fn car(&self) -> Result<(Car, CarUncertainty), ConfigError> {
        self.car.clone().unwrap_or_default().to_car()
    }
}
