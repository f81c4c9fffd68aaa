//! Fits a tire to data of a test bench: a `.tir` file, a page, and a verdict for each coefficient.

#[cfg(test)]
mod tests;

use plugin::Host;
use serde_json::{Map, Value, json};
use tire_bench::{Channel, Fit, Residuals, Verdict, condition, fit_points, read_all, write_tir};

use super::go_on;
use crate::config::Bench;
use crate::page;

/// The file that the task leaves.
const FILE: &str = "bench.tir";

/// Does `task = "bench"`.
///
/// # Errors
/// When a file cannot be read or fitted, or the program asked to give up.
pub(super) fn bench(config: &Bench, host: &mut dyn Host) -> Result<Value, String> {
    let said = config.said();
    let files: Vec<_> = config.files.iter().map(|(name, it)| (name.as_str(), it.bytes())).collect();
    go_on(host, 0.0, "reading the files")?;
    let read = read_all(&files, &config.reading(&said)).map_err(|bad| bad.to_string())?;
    go_on(host, 0.1, "fitting the tire")?;
    let options = config.options();
    let points = condition(&read.samples, &options.tire);
    let found = fit_points(&points, &options).map_err(|bad| bad.to_string())?;
    host.file(FILE, &write_tir(&found));
    let summary = summary(&found, read.samples.len(), read.notes);
    host.file("tires.html", &page::bench::page(&found, &points, &summary));
    Ok(result(&found, summary))
}

/// How much the data tell, and what was assumed.
fn summary(found: &Fit, samples: usize, notes: Vec<String>) -> Vec<String> {
    let count = |verdict| found.estimates.iter().filter(|it| it.verdict == verdict).count();
    let first = format!(
        "{} of {} coefficients are identified, {} weak, by {samples} samples; the tire is in {FILE}.",
        count(Verdict::Identified),
        found.estimates.len(),
        count(Verdict::Weak)
    );
    let mut summary = vec![first];
    summary.extend(notes.into_iter().map(|it| format!("{it}.")));
    summary
}

fn result(found: &Fit, summary: Vec<String>) -> Value {
    let (mut coefficients, mut rows) = (Map::new(), Vec::new());
    for it in &found.estimates {
        let verdict = it.verdict.words();
        let key = it.verdict.key();
        let entry =
            json!({ "value": it.value, "std": it.std, "verdict": key, "reason": it.reason });
        coefficients.insert(it.name.to_owned(), entry);
        rows.push(json!([
            it.name,
            format!("{:.5}", it.value),
            format!("{:.1e}", it.std),
            verdict,
            it.reason
        ]));
    }
    let (mut residuals, mut fits) = (Map::new(), Vec::new());
    for it in &found.residuals {
        let Residuals { points, rms, status, iterations, .. } = it;
        let (name, unit) = match it.channel {
            Channel::Longitudinal => ("F_x", "N"),
            Channel::Lateral => ("F_y", "N"),
            Channel::Aligning => ("M_z", "N.m"),
        };
        let status = format!("{status:?}");
        fits.push(json!([name, points.to_string(), format!("{rms:.3}"), unit, status]));
        residuals.insert(
            name.to_owned(),
            json!({ "points": points, "rms": rms, "status": status, "iterations": iterations }),
        );
    }
    json!({
        "coefficients": coefficients,
        "residuals": residuals,
        "draws": found.draws,
        "summary": summary,
        "tables": [
            { "head": ["channel", "points", "rms", "unit", "status"], "rows": fits },
            { "head": ["coefficient", "value", "standard deviation", "verdict", "reason"], "rows": rows },
        ],
    })
}
