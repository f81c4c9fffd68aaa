//! Writes verdicts and intervals in templates.
#![allow(missing_docs, reason = "the macro makes types without documentation")]

use std::borrow::Borrow;

use askama::{Result, Values};
pub use html_page::filters::*;
use numerics::text::decimals_for_std;
use tire_inference::verdict::Identifiability;

/// A verdict in words.
#[askama::filter_fn]
pub fn words(verdict: impl Borrow<Identifiability>, _: &dyn Values) -> Result<&'static str> {
    Ok(verdict.borrow().to_display_text())
}

/// The class of a verdict in the style.
#[askama::filter_fn]
pub fn class(verdict: impl Borrow<Identifiability>, _: &dyn Values) -> Result<&'static str> {
    Ok(verdict.borrow().key())
}

/// The ends of an interval with the decimals of a value and its standard deviation.
#[askama::filter_fn]
pub fn interval<V: TemplateNumber, S: TemplateNumber>(
    ends: impl Borrow<[f64; 2]>,
    _: &dyn Values,
    value: V,
    std: S,
) -> Result<String> {
    let decimals = decimals_for_std(value.as_f64(), std.as_f64());
    let [low, high] = ends.borrow().map(|end| match end.is_finite() {
        true => format!("{end:.decimals$}"),
        false => "–".to_owned(),
    });
    Ok(format!("{low} … {high}"))
}

/// A share in percent with one decimal, or a dash where there is none.
#[askama::filter_fn]
pub fn share(value: impl TemplateNumber, _: &dyn Values) -> Result<String> {
    let value = value.as_f64();
    Ok(if value.is_nan() { "–".to_owned() } else { format!("{:.1} %", 100.0 * value) })
}
