//! Reads what an earlier run or a test bench found: the `report.json` of a run, or a few lines of TOML.
//!
//! Of a report that is mean and covariance of the posterior with all parameters free: all there is to say where the posterior
//! is close to normal, and less where it is not. In TOML a curve has a table with `mean` and `std`, or with `mean`,
//! `parameters` and `covariance`.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use plugin::{ConfigError, ConfigFile};
use serde::Deserialize;
use serde_json::Value;
use tire_inference::parameters::{COUNT, Normal, Parameter};

/// Methods of a report, those first whose covariance is that of the posterior.
const METHODS: [&str; 5] = ["reference", "least_squares", "nelder_mead", "svi", "pem"];

/// Texts that a scenario hands over.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PriorFiles {
    /// What an earlier run or a test bench found.
    pub prior: Option<ConfigFile>,
}

impl PriorFiles {
    /// What is known of a curve beforehand, see [`parse_prior`].
    ///
    /// # Errors
    /// Those of [`parse_prior`].
    pub fn prior_of_curve(&self, curve: &str, free: &[bool; COUNT]) -> Result<Option<Normal>, String> {
        let Some(file) = &self.prior else { return Ok(None) };
        let found = file_text(file).and_then(|text| parse_prior(text, curve, free));
        found.map_err(|error| format!("`prior`: {error}"))
    }

    /// Whether the file can be read and tells of one of the curves at least.
    ///
    /// # Errors
    /// If not.
    pub fn check(&self, curves: &[&str]) -> Result<(), ConfigError> {
        let Some(file) = &self.prior else { return Ok(()) };
        let wrong = |message| ConfigError::at_key("files.prior", message);
        let text = file_text(file).map_err(wrong)?;
        let mut found = false;
        for curve in curves {
            found |= parse_prior(text, curve, &[true; COUNT]).map_err(wrong)?.is_some();
        }
        let names = curves.join(", ");
        let none = || wrong(format!("expected one of the curves {names} or more, found none"));
        if found { Ok(()) } else { Err(none()) }
    }
}

fn file_text(file: &ConfigFile) -> Result<&str, String> {
    std::str::from_utf8(file.bytes())
        .map_err(|_| "expected a report in JSON or TOML, found what is no text".to_owned())
}

/// The part of a result that matters.
#[derive(Deserialize)]
struct StoredPosterior {
    mean: BTreeMap<String, f64>,
    #[serde(default)]
    std: BTreeMap<String, f64>,
    #[serde(default)]
    parameters: Vec<String>,
    #[serde(default)]
    covariance: Vec<Vec<f64>>,
    posterior: Option<StoredMean>,
}

#[derive(Deserialize)]
struct StoredMean {
    mean: BTreeMap<String, f64>,
}

/// What the file says of a curve, `front` for one, and of its parameters that are `free`: the others drop out. `None` if it says
/// nothing of that curve.
///
/// # Errors
/// If the text is neither JSON nor TOML, more than one analysis has the curve, or its numbers make no normal distribution.
pub fn parse_prior(text: &str, curve: &str, free: &[bool; COUNT]) -> Result<Option<Normal>, String> {
    let file: Value = match serde_json::from_str(text) {
        Ok(value) => value,
        Err(_) => toml::from_str(text).map_err(|error: toml::de::Error| {
            let what = error.message();
            format!("expected a report in JSON or a table in TOML, found neither: {what}")
        })?,
    };
    let Some(stored) = find_curve_table(&file, curve)? else { return Ok(None) };
    let wrong = |what: String| format!("`{curve}`: {what}");
    let stored: StoredPosterior =
        serde_json::from_value(stored.clone()).map_err(|error| wrong(error.to_string()))?;
    normal_from_posterior(&stored, free).map_err(wrong)
}

/// The table of a curve.
fn find_curve_table<'a>(file: &'a Value, curve: &str) -> Result<Option<&'a Value>, String> {
    let Some(analyses) = file.get("analyses").and_then(Value::as_object) else {
        return Ok(file.get(curve));
    };
    let of = |analysis: &'a Value| METHODS.iter().find_map(|m| analysis.get(m)?.get(curve));
    let mut found = analyses.iter().filter_map(|(name, analysis)| Some((name, of(analysis)?)));
    let first = found.next();
    if let (Some((one, _)), Some((other, _))) = (first, found.next()) {
        return Err(format!(
            "expected one analysis with the curve `{curve}`, found `{one}` and `{other}`: leave the one that counts in the file"
        ));
    }
    Ok(first.map(|(_, stored)| stored))
}

fn normal_from_posterior(stored: &StoredPosterior, free: &[bool; COUNT]) -> Result<Option<Normal>, String> {
    let means = stored.posterior.as_ref().map_or(&stored.mean, |posterior| &posterior.mean);
    let diagonal = stored.covariance.is_empty();
    let rows: Vec<&String> =
        if diagonal { stored.std.keys().collect() } else { stored.parameters.iter().collect() };
    let square = stored.covariance.iter().all(|row| row.len() == rows.len());
    if !diagonal && (stored.covariance.len() != rows.len() || !square) {
        return Err("expected a row and a column of the covariance for each parameter".to_owned());
    }
    let mut mean = [0.0; COUNT];
    let mut used: Vec<(usize, usize)> = Vec::new();
    for (row, name) in rows.iter().enumerate() {
        // A report tells of the stiffness and the peak, too: they follow.
        let Some(parameter) = Parameter::ALL.into_iter().find(|p| p.symbol() == *name) else {
            continue;
        };
        if free[parameter as usize] {
            let found = means.get(*name);
            mean[parameter as usize] =
                *found.ok_or_else(|| format!("expected a mean of `{name}` beside its width"))?;
            used.push((row, parameter as usize));
        }
    }
    if used.is_empty() {
        return Ok(None);
    }
    let covariance = DMatrix::from_fn(used.len(), used.len(), |k, l| match diagonal {
        true if k == l => stored.std[rows[used[k].0]].powi(2),
        true => 0.0,
        false => stored.covariance[used[k].0][used[l].0],
    });
    let places: Vec<usize> = used.iter().map(|(_, index)| *index).collect();
    let normal = Normal::from_covariance(&places, mean, &covariance);
    normal
        .map(Some)
        .ok_or_else(|| "expected finite means and a positive definite covariance, found others".to_owned())
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const FREE: [bool; COUNT] = [true, true, true, true, false, false];

    #[test]
    fn of_a_report_the_parameters_that_are_free_count() {
        let text = r#"{ "analyses": { "lap": { "innovations": 3 }, "tires": { "preparation": {}, "least_squares": { "front": {
            "mean": { "B": 1.0, "D": 1.0, "S_h": 0.0 }, "std": { "B": 2.0 }, "posterior": { "mean": { "B": 15.0, "D": 1.5, "S_h": 0.1 } },
            "parameters": ["B", "S_h", "D"], "covariance": [[4.0, 0.01, -0.1], [0.01, 0.001, 0.0], [-0.1, 0.0, 0.01]] } } } } }"#;
        let normal = parse_prior(text, "front", &FREE).expect("reads").expect("has this curve");
        assert_eq!(normal.mean, [15.0, 0.0, 1.5, 0.0, 0.0, 0.0]);
        // The inverse of [4 −0.1; −0.1 0.01].
        let expected = [[0.01, 0.1], [0.1, 4.0]].map(|row| row.map(|x| x / 0.03));
        for (i, k) in [(0, 0), (0, 2), (2, 2)] {
            let expected = expected[i / 2][k / 2];
            assert_relative_eq!(normal.precision[i][k], expected, max_relative = 1e-12);
        }
        assert_eq!(normal.precision[4], [0.0; COUNT]);
        assert_eq!(parse_prior(text, "rear", &FREE), Ok(None));
        let twice = text.replace(r#""lap": { "innovations": 3 }"#, r#""lap": { "pem": { "front": {} } }"#);
        assert!(parse_prior(&twice, "front", &FREE).is_err_and(|error| error.contains("`lap` and `tires`")));
    }

    #[test]
    fn a_bench_is_told_of_in_toml() {
        let text = "[front]\nmean = { C = 1.4, E = 0.1 }\nstd = { C = 0.1, E = 0.2 }\n";
        let normal = parse_prior(text, "front", &FREE).expect("reads").expect("has this curve");
        let expected = Normal::diagonal(
            [0.0, 1.4, 0.0, 0.1, 0.0, 0.0],
            [f64::INFINITY, 0.1, f64::INFINITY, 0.2, f64::INFINITY, f64::INFINITY],
        );
        assert_eq!(normal.mean, expected.mean);
        assert_relative_eq!(normal.precision[1][1], expected.precision[1][1], max_relative = 1e-14);
        for (wrong, word) in [
            (text.replace("C = 1.4, ", ""), "mean of `C`"),
            (text.replace("C = 0.1", "C = 0.0"), "positive definite"),
            ("hello".to_owned(), "JSON"),
        ] {
            let error = parse_prior(&wrong, "front", &FREE).expect_err("is refused");
            assert!(error.contains(word), "{error}");
        }
    }
}
