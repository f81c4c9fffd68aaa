//! Rules for values of a configuration; each error has the path of its key.

use std::fmt::Display;

use plugin::ConfigError;
use tire_inference::settings::FitMethod;
use tire_inference::variational::ElboOptimiser;
use tire_inference::variational::adam::Adam;

/// Refuses a value unless the rule holds.
pub(super) fn check_rule(
    holds: bool,
    key: &str,
    expected: &str,
    found: impl Display,
) -> Result<(), ConfigError> {
    let wrong = || ConfigError::at_key(key, format!("expected {expected}, found {found}"));
    if holds { Ok(()) } else { Err(wrong()) }
}

pub(super) fn check_positive(key: &str, found: f64) -> Result<(), ConfigError> {
    check_rule(found > 0.0 && found.is_finite(), key, "a number above 0", found)
}

pub(super) fn not_negative(key: &str, found: f64) -> Result<(), ConfigError> {
    check_rule(found >= 0.0 && found.is_finite(), key, "0 or above", found)
}

pub(super) fn at_least(key: &str, least: usize, found: usize) -> Result<(), ConfigError> {
    check_rule(found >= least, key, &format!("{least} or more"), found)
}

/// Demands two rising finite numbers.
pub(super) fn check_rising(key: &str, [low, high]: [f64; 2]) -> Result<(), ConfigError> {
    let rise = low < high && low.is_finite() && high.is_finite();
    check_rule(rise, key, "two rising numbers", format_args!("{low} and {high}"))
}

pub(super) fn check_methods(methods: &[FitMethod]) -> Result<(), ConfigError> {
    check_rule(!methods.is_empty(), "methods", "one method or more, such as \"least_squares\"", "none")
}

pub(super) fn check_svi_settings(svi: &ElboOptimiser) -> Result<(), ConfigError> {
    let ElboOptimiser::Adam(Adam { step, steps, batch, .. }) = svi else { return Ok(()) };
    check_positive("svi.step", *step)?;
    at_least("svi.steps", 1, *steps)?;
    at_least("svi.batch", 1, batch.unwrap_or(1))
}
