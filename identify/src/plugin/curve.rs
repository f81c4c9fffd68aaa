//! Identifies one tire curve from its slip and its force, such as a test bench or a wheel that measures forces gives.

use std::time::Instant;

use plugin::{AnalysisRequest, AnalysisServices};
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use serde_json::{Map, Value, json};
use tire_inference::estimate::identify_tire;
use tire_inference::fit::FitError;
use tire_inference::settings::IdentificationSettings;
use units::Unit;

use crate::config::OneCurve;
use crate::page::{self, PageContent, TireSection};
use crate::plugin::{method_sections, overall_summary, report_progress};
use crate::summary::{CurveSummary, remove_absent_peak};

/// The columns of slip and force, which belong together row by row: slip angles in rad, slip ratios and forces over loads as such.
///
/// # Errors
/// When one of them is missing or in a unit of something else, or they are not of the same length.
pub(super) fn slip_force_columns(
    request: &AnalysisRequest,
    direction: ForceDirection,
) -> Result<CurveSamples, String> {
    let column = |name, accepted: &[&str]| {
        let missing = || format!("a curve needs the signal `{name}`");
        let signal = request.find_signal(name).ok_or_else(missing)?;
        let factor = unit_factor(name, signal.unit, accepted)?;
        Ok::<_, String>(signal.values.iter().map(|value| factor * value).collect::<Vec<f64>>())
    };
    let slips: &[&str] = match direction {
        // The tangent of a slip angle has no unit.
        ForceDirection::Lateral => &["rad", "1"],
        ForceDirection::Longitudinal => &["1"],
    };
    let (slip, force) = (column("slip", slips)?, column("force", &["1"])?);
    if slip.len() != force.len() {
        let (slips, forces) = (slip.len(), force.len());
        return Err(format!("expected a force for each slip, found {forces} for {slips}"));
    }
    Ok(CurveSamples::new(slip, force))
}

/// The rows that have a slip and a force, and a sentence about the others.
fn drop_incomplete_rows(samples: &CurveSamples) -> (CurveSamples, Option<String>) {
    let whole = |&row: &usize| samples.slip[row].is_finite() && samples.force[row].is_finite();
    let rows: Vec<usize> = (0..samples.len()).filter(whole).collect();
    let (all, lost) = (samples.len(), samples.len() - rows.len());
    let told = (lost > 0).then(|| format!("{lost} of {all} rows have no slip or no force; left out."));
    (samples.select_rows(&rows), told)
}

/// What values in a unit are multiplied with to be in the first accepted unit of its dimension.
fn unit_factor(name: &str, unit: &str, accepted: &[&str]) -> Result<f64, String> {
    if unit.is_empty() {
        return Ok(1.0);
    }
    let parse = |unit: &str| Unit::parse(unit).map_err(|error| format!("`{name}`: {error}"));
    let from = parse(unit)?;
    for to in accepted {
        if let Some((factor, 0.0)) = Unit::conversion(&from, &parse(to)?) {
            return Ok(factor);
        }
    }
    let wanted = accepted.join("] or [");
    Err(format!("expected `{name}` in [{wanted}], found [{unit}]"))
}

/// Does `task = "curve"`.
///
/// # Errors
/// When the curve cannot be fitted, or the program asked to give up.
pub(super) fn identify_curve(
    config: &OneCurve,
    request: &AnalysisRequest,
    host: &mut dyn AnalysisServices,
) -> Result<Value, String> {
    let (samples, lost) = drop_incomplete_rows(&slip_force_columns(request, config.direction)?);
    let begin = Instant::now();
    report_progress(host, 0.0, "fitting the curve")?;
    let usual = config.fit.fit_settings(config.direction, config.known_shift(), config.seed);
    let prior_from_file = config.files.prior_of_curve("curve", &usual.prior.free)?;
    let settings = IdentificationSettings { prior_from_file, svi: config.svi, ..usual };
    let wrong = |error: FitError| error.to_string();
    let settings = config.fit.loss.apply_to_settings(settings, &samples).map_err(wrong)?;
    let (settings, extensions) = settings.extend_bounds(&samples).map_err(wrong)?;
    let settling = begin.elapsed().as_secs_f64();
    let mut found = identify_tire(&samples, &settings, &config.methods).map_err(wrong)?;
    for (_, estimate) in &mut found.estimates {
        remove_absent_peak(estimate);
        estimate.seconds += settling;
    }
    let first = found.estimates.first().map(|(_, estimate)| estimate);
    let told = |estimate| CurveSummary {
        name: "curve",
        direction: config.direction,
        estimate,
        prior: &settings.prior,
        load: None,
    };
    let mut overall = overall_summary(first.into_iter().map(told).collect());
    overall.log.extend(lost);
    overall.log.extend(extensions.iter().map(ToString::to_string));
    let section = TireSection {
        name: "Curve",
        direction: config.direction,
        samples: &samples,
        prior: &settings.prior,
        methods: method_sections(&found),
    };
    let page = PageContent {
        title: "Tire",
        overall: Some(&overall),
        sections: vec![section],
        ..PageContent::default()
    };
    page::write_page(&page, host);
    let mut result: Map<_, _> = found
        .estimates
        .iter()
        .map(|(method, estimate)| (method.name().to_owned(), json!({ "curve": estimate })))
        .collect();
    result.insert("bounds".to_owned(), json!(settings.prior.bounds));
    result.insert("bound_extensions".to_owned(), json!(extensions));
    Ok(overall.result_json(None, result))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_without_a_number_are_left_out_and_counted() {
        let samples = CurveSamples::new(vec![0.0, f64::NAN, 0.2], vec![0.1, 0.2, 0.3]);
        let (rest, told) = drop_incomplete_rows(&samples);
        assert_eq!((rest.slip, rest.force), (vec![0.0, 0.2], vec![0.1, 0.3]));
        assert_eq!(told.as_deref(), Some("1 of 3 rows have no slip or no force; left out."));
        assert_eq!(drop_incomplete_rows(&CurveSamples::new(vec![0.0], vec![0.1])).1, None);
    }
}
