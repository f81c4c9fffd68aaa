//! Rules for values of a configuration; each error has the path of its key.

use std::fmt::Display;

use plugin::ConfigError;
use tire_inference::settings::Method;
use tire_inference::variational::Optimiser;
use tire_inference::variational::adam::Adam;

/// Refuses a value unless the rule holds.
pub(super) fn demand(
    holds: bool,
    key: &str,
    expected: &str,
    found: impl Display,
) -> Result<(), ConfigError> {
    let wrong = || ConfigError::at(key, format!("expected {expected}, found {found}"));
    if holds { Ok(()) } else { Err(wrong()) }
}

pub(super) fn positive(key: &str, found: f64) -> Result<(), ConfigError> {
    demand(found > 0.0 && found.is_finite(), key, "a number above 0", found)
}

pub(super) fn not_negative(key: &str, found: f64) -> Result<(), ConfigError> {
    demand(found >= 0.0 && found.is_finite(), key, "0 or above", found)
}

pub(super) fn at_least(key: &str, least: usize, found: usize) -> Result<(), ConfigError> {
    demand(found >= least, key, &format!("{least} or more"), found)
}

/// Demands two rising finite numbers.
pub(super) fn rising(key: &str, [low, high]: [f64; 2]) -> Result<(), ConfigError> {
    let rise = low < high && low.is_finite() && high.is_finite();
    demand(rise, key, "two rising numbers", format_args!("{low} and {high}"))
}

pub(super) fn methods(methods: &[Method]) -> Result<(), ConfigError> {
    demand(!methods.is_empty(), "methods", "one method or more, such as \"least_squares\"", "none")
}

pub(super) fn svi(svi: &Optimiser) -> Result<(), ConfigError> {
    let Optimiser::Adam(Adam { step, steps, batch, .. }) = svi else { return Ok(()) };
    positive("svi.step", *step)?;
    at_least("svi.steps", 1, *steps)?;
    at_least("svi.batch", 1, batch.unwrap_or(1))
}
