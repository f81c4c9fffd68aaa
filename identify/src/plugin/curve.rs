//! Identifies one tire curve from its slip and its force, such as a test bench or a wheel that measures forces gives.

use plugin::{Host, Request};
use preparation::samples::Samples;
use serde_json::{Map, Value, json};
use tire_inference::estimate::identify;
use tire_inference::fit::FitError;
use tire_inference::settings::Settings;

use crate::config::OneCurve;
use crate::page::{self, Page, Section};
use crate::plugin::{go_on, methods, overall};
use crate::told::{Told, forget_absent_peak};

/// The columns of slip and force, which belong together row by row.
///
/// # Errors
/// When one of them is missing, or they are not of the same length.
pub(super) fn columns(request: &Request) -> Result<Samples, String> {
    let column = |name| {
        let signal = request.signal(name).ok_or(format!("a curve needs the signal `{name}`"));
        signal.map(|signal| signal.values.to_vec())
    };
    let (slip, force) = (column("slip")?, column("force")?);
    if slip.len() != force.len() {
        let (slips, forces) = (slip.len(), force.len());
        return Err(format!("expected a force for each slip, found {forces} for {slips}"));
    }
    Ok(Samples::new(slip, force))
}

/// Does `task = "curve"`.
///
/// # Errors
/// When the curve cannot be fitted, or the program asked to give up.
pub(super) fn curve(
    config: &OneCurve,
    request: &Request,
    host: &mut dyn Host,
) -> Result<Value, String> {
    let samples = columns(request)?;
    go_on(host, 0.0, "fitting the curve")?;
    let usual = config.fit.settings(config.direction, config.shift(), config.seed);
    let prior_from_file = config.files.curve("curve", &usual.prior.free)?;
    let settings = Settings { prior_from_file, svi: config.svi, ..usual };
    let wrong = |error: FitError| error.to_string();
    let settings = config.fit.loss.settle(settings, &samples).map_err(wrong)?;
    let mut found = identify(&samples, &settings, &config.methods).map_err(wrong)?;
    found.estimates = found
        .estimates
        .into_iter()
        .map(|(method, estimate)| (method, forget_absent_peak(estimate)))
        .collect();
    let first = found.estimates.first().map(|(_, estimate)| estimate);
    let told = |estimate| Told {
        name: "curve",
        direction: config.direction,
        estimate,
        prior: &settings.prior,
    };
    let overall = overall(first.into_iter().map(told).collect());
    let section = Section {
        name: "Curve",
        direction: config.direction,
        samples: &samples,
        prior: &settings.prior,
        methods: methods(&found),
    };
    let page =
        Page { title: "Tire", overall: Some(&overall), sections: vec![section], ..Page::default() };
    page::leave(&page, host);
    let mut result: Map<_, _> = found
        .estimates
        .iter()
        .map(|(method, estimate)| (method.name().to_owned(), json!({ "curve": estimate })))
        .collect();
    result.insert("bounds".to_owned(), json!(settings.prior.bounds));
    overall.add_to(&mut result);
    Ok(result.into())
}
