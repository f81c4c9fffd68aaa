//! Configuration of a curve, and of `task = "curve"`.

use std::collections::BTreeMap;

use plugin::ConfigError;
use preparation::CurveShift;
use preparation::direction::ForceDirection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tire_inference::fit::{CurveConstraints, FitOptions, SlipNoise};
use tire_inference::noise::NoiseModel;
use tire_inference::parameters::{COUNT, Parameter};
use tire_inference::regularisation::Regularisation;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::variational::ElboOptimiser;

use super::{BoundsChoice, methods, prior_with_overrides, rules};
use crate::prior_from_file::PriorFiles;

/// Identifies one curve from slips and forces.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OneCurve {
    /// Direction of the force.
    pub direction: ForceDirection,
    /// Prior knowledge and fit of the curve.
    #[serde(default)]
    pub fit: CurveConfig,
    /// Fits the shifts S_h and S_v too; otherwise both are 0.
    #[serde(default)]
    pub shifts: bool,
    /// Methods of the fit.
    #[serde(default = "methods")]
    pub methods: Vec<FitMethod>,
    /// Text files of the scenario, from `[analysis.files]`.
    #[serde(default)]
    #[schemars(skip)]
    pub files: PriorFiles,
    /// Optimiser of the method `svi`.
    #[serde(default)]
    pub svi: ElboOptimiser,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl OneCurve {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        rules::check_methods(&self.methods)?;
        rules::check_svi_settings(&self.svi)?;
        self.fit.check().map_err(|error| error.with_parent_key("fit"))?;
        self.files.check(&["curve"])
    }

    /// The shift that is known beforehand.
    pub fn known_shift(&self) -> Option<CurveShift> {
        (!self.shifts).then_some(CurveShift { S_h: 0.0, S_v: 0.0, K: f64::NAN, samples: 0 })
    }
}

/// Prior knowledge of a curve, and its fit.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CurveConfig {
    /// Lowest and highest values: `"wide"` by default, `"goblirsch2025"` for Table I of Goblirsch et al. (2025), or ranges by
    /// parameter. Without a name, and without ranges of B and D, the sides of both move where the data push against them; the result says so.
    pub bounds: BoundsChoice,
    /// Typical values, for parameters that the data cannot tell; those of the literature by default.
    pub typical: BTreeMap<Parameter, f64>,
    /// Parameters to hold at their typical values.
    pub hold: FixedParameters,
    /// Limits of the stiffness K = B C D, in the unit of B.
    pub stiffness: Option<[f64; 2]>,
    /// Limits of the slip at the peak, in the unit of the slip.
    pub peak_slip: Option<[f64; 2]>,
    /// Loss of the residuals: the noise model of the force.
    pub loss: NoiseModel,
    /// Standard deviation of the noise of the slip, in the unit of the slip; 0 by default. With normal noise only.
    pub slip_std: Option<f64>,
    /// λ_reg: weight of the distance to the typical values [-], in standard deviations of a uniform distribution within the
    /// bounds, or within `goblirsch2025` where that is narrower.
    pub regularisation: f64,
    /// Number of starts of the fit.
    pub starts: Option<usize>,
}

/// Parameters that are held at their typical values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FixedParameters {
    /// Those that the data cannot tell.
    #[default]
    NotIdentifiable,
    /// None: all are fitted.
    Nothing,
}

impl CurveConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.bounds.check()?;
        rules::not_negative("regularisation", self.regularisation)?;
        if !self.loss.is_valid() {
            return Err(ConfigError::at_key("loss", "expected finite numbers above 0"));
        }
        if self.loss != NoiseModel::Square && self.slip_std.is_some() {
            let message = "expected no `slip_std` with this `loss`: it goes with normal noise only";
            return Err(ConfigError::at_key("slip_std", message));
        }
        rules::at_least("starts", 1, self.starts.unwrap_or(1))
    }

    /// The settings for points whose shift was found beforehand, or is to be found with the rest; the noise is yet to be settled.
    pub fn fit_settings(
        &self,
        direction: ForceDirection,
        shift: Option<CurveShift>,
        seed: u64,
    ) -> IdentificationSettings {
        let usual = IdentificationSettings::new(direction);
        let mut prior = prior_with_overrides(usual.prior, &self.bounds, &self.typical);
        match shift {
            Some(CurveShift { S_h, S_v, .. }) => {
                prior.centre[Parameter::S_h as usize] = S_h;
                prior.centre[Parameter::S_v as usize] = S_v;
            }
            None => prior.free = [true; COUNT],
        }
        let regularisation = Regularisation::towards_typical(&prior, self.regularisation);
        IdentificationSettings {
            prior,
            extensible: self.bounds.is_extensible(),
            constraints: CurveConstraints { stiffness: self.stiffness, peak_slip: self.peak_slip },
            regularisation,
            slip_noise: self.slip_std.map(SlipNoise::new),
            hold: self.hold == FixedParameters::NotIdentifiable,
            options: FitOptions {
                starts: self.starts.unwrap_or(usual.options.starts),
                seed,
                ..usual.options
            },
            ..usual
        }
    }
}
