//! Configuration of what `task = "tires"` tells of parts of the log: windows and drift.

use plugin::ConfigError;
use schemars::JsonSchema;
use serde::Deserialize;
use tire_inference::local::StretchPrior;
use tire_inference::window::WindowRequirement;

use super::rules;

/// Judges windows of the log by themselves: whether each tells the lateral curves.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WindowConfig {
    /// Length of a window [s]; one begins where the last one ends.
    pub length: f64,
    /// Largest error of a curve inside the excited slip that is called identified, over its largest force there [-].
    pub tolerance: f64,
    /// Standard deviation of an unknown offset of the slip [rad].
    pub slip_offset: f64,
}

impl Default for WindowConfig {
    fn default() -> Self {
        let WindowRequirement { tolerance, usual: StretchPrior { slip_offset, .. }, .. } =
            WindowRequirement::default();
        Self { length: 10.0, tolerance, slip_offset }
    }
}

impl WindowConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        rules::check_positive("length", self.length)?;
        rules::check_positive("tolerance", self.tolerance)?;
        rules::not_negative("slip_offset", self.slip_offset)
    }

    /// What is asked of a window.
    pub fn curve_requirement(&self) -> WindowRequirement {
        let usual = StretchPrior { slip_offset: self.slip_offset, ..StretchPrior::default() };
        WindowRequirement { tolerance: self.tolerance, usual, ..WindowRequirement::default() }
    }
}

/// Drift of stiffness and friction from stretch to stretch.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriftConfig {
    /// Length of a stretch [s].
    pub length: f64,
    /// Stretches are laps, as the signal `lap` has them, whatever `length` is.
    pub laps: bool,
}

impl Default for DriftConfig {
    fn default() -> Self {
        Self { length: 20.0, laps: false }
    }
}

impl DriftConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        rules::check_positive("length", self.length)
    }

    /// Demands the signal that tells laps.
    ///
    /// # Errors
    /// When laps are asked for without it.
    pub fn check_lap_signal(&self, has: impl Fn(&str) -> bool) -> Result<(), ConfigError> {
        let message = "expected the signal `lap`, the number of the lap, found none: map it to a column, or leave `laps` out for stretches of `length`";
        if self.laps && !has("lap") { Err(ConfigError::at_key("drift.laps", message)) } else { Ok(()) }
    }
}
