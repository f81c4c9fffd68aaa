//! Configuration of `task = "closed_loop"`.

use std::collections::{BTreeMap, BTreeSet};

use drive_inference::likelihood::DriveNoise;
use drive_inference::model_selection::EstimationMode;
use drive_inference::regression::ResidualWeights;
use drive_inference::smoothing::SmootherOptions;
use drive_inference::{DriveOptions, ErrorOptions, FitFormulation, NoiseOption};
use plugin::ConfigError;
use preparation::SystematicError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tire_inference::parameters::Parameter;
use tire_inference::prior::Prior;

use super::car::ClosedLoopCarConfig;
use super::rules::{self, check_rule};
use super::{BoundsChoice, plant, prior_with_overrides};

/// Identifies the tires of both axles from drives under closed-loop control.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClosedLoop {
    /// The car, which is needed: its data have no default.
    pub car: ClosedLoopCarConfig,
    /// Formulation of the fit that decides.
    pub method: FitFormulation,
    /// Further formulations, for comparison.
    pub compare: Vec<FitFormulation>,
    /// Lowest and highest values of B, C, D, E of both axles: `"wide"` by default, `"goblirsch2025"` for Table I of Goblirsch et
    /// al. (2025), or ranges by parameter.
    pub bounds: BoundsChoice,
    /// θ_0: values of a typical tire; those of a lateral curve by default.
    pub typical: BTreeMap<Parameter, f64>,
    /// λ_reg: weight of the distance of each tire to the typical values [-], in standard deviations of a uniform distribution
    /// within the bounds, or within `goblirsch2025` where that is narrower.
    pub regularisation: f64,
    /// λ_sim: weight of the difference between both tires [-], in the same standard deviations.
    pub axle_coupling: f64,
    /// Weights of residuals in fits to smoothed states.
    pub weights: ResidualWeights,
    /// Adds three odd terms to fits to accelerations.
    pub odd_terms: bool,
    /// Number of starts of fits to smoothed states.
    pub starts: usize,
    /// Standard deviations of the noise, when they are known; otherwise they are estimated.
    pub noise: Option<KnownNoise>,
    /// Largest number of passes of expectation maximisation (EM) for the noise of the smoother; 0 for none.
    pub em_passes: usize,
    /// Takes uncertainties from samples of the posterior of `method = "pem"`, at the cost of another fit; otherwise from the
    /// curvature of the likelihood.
    pub posterior: bool,
    /// Fits a normal distribution to the posterior by stochastic variational inference (SVI), and reports its Pareto tail index
    /// (k-hat).
    pub svi: bool,
    /// Takes intervals from profiles of the likelihood, which takes longer than the fit; otherwise from its curvature.
    pub profile: bool,
    /// Errors of sensors, and relaxation lengths: whether each is estimated with the tires. By default where the data ask for it.
    pub errors: BTreeMap<SystematicError, EstimationMode>,
    /// Errors of sensors that are estimated by themselves, too, on rows some hundredths of a second apart, from all of the drive and from its
    /// halves, such as `["v_y_lever", "v_y_delay", "steering_offset"]`. They are told and nothing is corrected.
    pub calibrate: Vec<SystematicError>,
    /// Standard deviations of these errors before any data, each in its unit; those of sensors that were mounted with care by
    /// default.
    pub error_std: BTreeMap<SystematicError, f64>,
    /// Longest time between two rows without a gap [s]; a gap ends a recording. By default 3.5 times the step that 95 % of all
    /// steps do not exceed.
    pub gap: Option<f64>,
    /// Beginning and end of the times to use [s]; all times by default.
    pub windows: Vec<[f64; 2]>,
    /// Times kept for validation: the identified car predicts the measurements.
    pub validate: Vec<HoldOut>,
    /// Node that gets the start values in `tires.toml`.
    pub node: String,
    /// Seed of the starts.
    pub seed: u64,
}

/// Times kept for validation.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HoldOut {
    /// Name in the report.
    pub name: String,
    /// Beginning [s].
    pub from: f64,
    /// End [s].
    pub until: f64,
}

/// Known standard deviations of the noise.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownNoise {
    /// Noise of the measured forward velocity [m/s].
    v_x: f64,
    /// Noise of the measured lateral velocity [m/s].
    v_y: f64,
    /// Noise of the measured yaw rate [rad/s].
    r: f64,
    /// Noise of the measured lateral acceleration [m/s²].
    a_y: f64,
    /// Process noise; hardly any by default.
    process: Option<KnownProcess>,
}

/// Standard deviations of the process noise, a random walk of each state, after one second.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownProcess {
    /// Random walk of the forward velocity [m/s].
    v_x: f64,
    /// Random walk of the lateral velocity [m/s].
    v_y: f64,
    /// Random walk of the yaw rate [rad/s].
    r: f64,
    /// Random walk of the unmeasured longitudinal force [N].
    xi_x: f64,
}

impl Default for ClosedLoop {
    fn default() -> Self {
        let usual = DriveOptions::default();
        Self {
            car: ClosedLoopCarConfig::default(),
            method: usual.method,
            compare: usual.compare,
            errors: BTreeMap::new(),
            error_std: BTreeMap::new(),
            calibrate: Vec::new(),
            bounds: BoundsChoice::default(),
            typical: BTreeMap::new(),
            regularisation: usual.regularisation,
            axle_coupling: usual.axle_coupling,
            weights: usual.weights,
            odd_terms: usual.odd_terms,
            starts: usual.starts,
            noise: None,
            em_passes: usual.smoothing.em_passes,
            posterior: usual.posterior,
            svi: usual.svi,
            profile: usual.profile,
            gap: None,
            windows: Vec::new(),
            validate: Vec::new(),
            node: plant(),
            seed: usual.seed,
        }
    }
}

impl ClosedLoop {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        rules::not_negative("regularisation", self.regularisation)?;
        rules::not_negative("axle_coupling", self.axle_coupling)?;
        if let ResidualWeights::Variance { clamp } = self.weights {
            rules::check_positive("weights.clamp", clamp)?;
        }
        rules::at_least("starts", 1, self.starts)?;
        let pem = self.method == FitFormulation::PredictionError;
        let expected = "false, as only method = \"pem\" has a likelihood";
        check_rule(pem || !self.profile, "profile", expected, true)?;
        let expected = "false, as it fits the posterior of method = \"pem\"";
        check_rule(pem && self.posterior || !self.svi, "svi", expected, true)?;
        self.check_tires()?;
        self.check_noise()?;
        self.check_times()?;
        self.car.to_vehicle().map(drop)
    }

    fn check_tires(&self) -> Result<(), ConfigError> {
        let shift = |parameter: &Parameter| [Parameter::S_h, Parameter::S_v].contains(parameter);
        let bounds = self.bounds.given_ranges().map(|(parameter, _)| ("bounds", parameter));
        let typical = self.typical.keys().map(|&parameter| ("typical", parameter));
        if let Some((table, parameter)) = bounds.chain(typical).find(|(_, it)| shift(it)) {
            let name = parameter.symbol();
            let message = format!("`{name}` is not fitted to drives; expected B, C, D or E");
            return Err(ConfigError::at_key(&format!("{table}.{name}"), message));
        }
        self.bounds.check()?;
        for (parameter, value) in &self.typical {
            let key = format!("typical.{}", parameter.symbol());
            check_rule(value.is_finite(), &key, "a finite typical value", value)?;
        }
        Ok(())
    }

    fn check_noise(&self) -> Result<(), ConfigError> {
        let Some(KnownNoise { v_x, v_y, r, a_y, process }) = self.noise else { return Ok(()) };
        for (name, std) in [("v_x", v_x), ("v_y", v_y), ("r", r), ("a_y", a_y)] {
            rules::check_positive(&format!("noise.{name}"), std)?;
        }
        let Some(KnownProcess { v_x, v_y, r, xi_x }) = process else { return Ok(()) };
        for (name, std) in [("v_x", v_x), ("v_y", v_y), ("r", r), ("xi_x", xi_x)] {
            rules::not_negative(&format!("noise.process.{name}"), std)?;
        }
        Ok(())
    }

    fn check_times(&self) -> Result<(), ConfigError> {
        self.gap.map_or(Ok(()), |gap| rules::check_positive("gap", gap))?;
        for (cause, std) in &self.error_std {
            rules::check_positive(&format!("error_std.{}", cause.describe().name), *std)?;
        }
        for (place, cause) in self.calibrate.iter().enumerate() {
            let first = !self.calibrate[..place].contains(cause);
            let name = cause.describe().name;
            check_rule(
                first,
                &format!("calibrate.{place}"),
                "each error once",
                format_args!("`{name}` again"),
            )?;
        }
        let errors = self.errors.keys().map(|cause| ("errors", cause));
        let errors = errors.chain(self.calibrate.iter().map(|cause| ("calibrate", cause)));
        let of_car = errors.chain(self.error_std.keys().map(|cause| ("error_std", cause)));
        for (table, cause) in of_car.filter(|(_, cause)| SystematicError::CAR.contains(cause)) {
            let name = cause.describe().name;
            let expected = "an error of a sensor; those of the car are standard deviations in `car`";
            check_rule(false, &format!("{table}.{name}"), expected, format_args!("`{name}`"))?;
        }
        for (index, window) in self.windows.iter().enumerate() {
            rules::check_rising(&format!("windows.{index}"), *window)?;
        }
        let mut names = BTreeSet::new();
        for (index, HoldOut { name, from, until }) in self.validate.iter().enumerate() {
            let rise = from < until && from.is_finite() && until.is_finite();
            let after = format!("a time after from = {from}");
            check_rule(rise, &format!("validate.{index}.until"), &after, until)?;
            let key = format!("validate.{index}.name");
            check_rule(names.insert(name), &key, "a name of its own", format_args!("`{name}` twice"))?;
        }
        Ok(())
    }

    /// What the library is asked for.
    ///
    /// # Errors
    /// When data of the car are missing or make no sense.
    pub fn drive_options(&self) -> Result<DriveOptions, ConfigError> {
        let (car, uncertainty) = self.car.to_vehicle()?;
        let mut causes = ErrorOptions::default();
        self.errors.iter().for_each(|(cause, mode)| causes.wanted.0[*cause as usize] = *mode);
        self.error_std.iter().for_each(|(cause, std)| causes.std[*cause] = *std);
        Ok(DriveOptions {
            car,
            uncertainty,
            causes,
            method: self.method,
            compare: self.compare.clone(),
            prior: prior_with_overrides(Prior::lateral(), &self.bounds, &self.typical),
            regularisation: self.regularisation,
            axle_coupling: self.axle_coupling,
            weights: self.weights,
            odd_terms: self.odd_terms,
            starts: self.starts,
            seed: self.seed,
            noises: self
                .noise
                .map_or(NoiseOption::Estimated, |noise| NoiseOption::Known(noise.to_drive_noise())),
            smoothing: SmootherOptions { em_passes: self.em_passes },
            posterior: self.posterior,
            svi: self.svi,
            profile: self.profile,
        })
    }
}

impl KnownNoise {
    fn to_drive_noise(self) -> DriveNoise {
        let Self { v_x, v_y, r, a_y, process } = self;
        let noise = DriveNoise::from_sensor_stds([v_x, v_y, r, a_y]);
        match process {
            Some(KnownProcess { v_x, v_y, r, xi_x }) => DriveNoise { process: [v_x, v_y, r, xi_x], ..noise },
            None => noise,
        }
    }
}
