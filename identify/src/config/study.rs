//! Configuration of the studies.

use plugin::ConfigError;
use schemars::JsonSchema;
use serde::Deserialize;
use tire_inference::parameters::{Theta, Tire, by_parameter, from_parameters};
use tire_inference::synthetic::SyntheticExcitation;

use super::rules;

pub(super) fn check_excitation(study: &SyntheticExcitation) -> Result<(), ConfigError> {
    rules::at_least("levels", 1, study.levels.len())?;
    for (index, &level) in study.levels.iter().enumerate() {
        rules::check_positive(&format!("levels.{index}"), level)?;
    }
    rules::at_least("samples", 10, study.samples)?;
    rules::not_negative("slip_std", study.slip_std)?;
    rules::check_positive("force_std", study.force_std)
}

/// Finds the parameters that matter at each slip.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensitivityConfig {
    /// The tire: B, C, D, E and, if not 0, S_h and S_v.
    #[serde(serialize_with = "by_parameter", deserialize_with = "from_parameters")]
    #[schemars(with = "Tire")]
    pub tire: Theta,
    /// Half the range of each parameter over its value [-], between 0 and 1.
    pub spread: f64,
    /// Largest slip, in the unit of the slip.
    pub limit: f64,
    /// Number of slips.
    pub count: usize,
}

impl Default for SensitivityConfig {
    /// Table II and Fig. 4 of the paper.
    fn default() -> Self {
        let tire = SyntheticExcitation::default().truth;
        Self { tire, spread: 0.1, limit: 1.0, count: 100 }
    }
}

impl SensitivityConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let Self { spread, limit, count, .. } = *self;
        rules::check_rule(spread > 0.0 && spread < 1.0, "spread", "a share between 0 and 1", spread)?;
        rules::check_positive("limit", limit)?;
        rules::at_least("count", 1, count)
    }
}
