//! Fits a tire to data of a test bench: a `.tir` file, a page, and a verdict for each coefficient.

#[cfg(test)]
mod tests;

use plugin::AnalysisServices;
use serde_json::{Map, Value, json};
use tire_bench::{
    ChannelFitSummary, FittedChannel, Identifiability, TireFit, average_over_revolutions, fit_tire_to_means,
    read_bench_files, write_tir,
};

use super::report_progress;
use crate::config::BenchConfig;
use crate::page;

/// The file that the task leaves.
const FILE: &str = "bench.tir";

/// Does `task = "bench"`.
///
/// # Errors
/// When a file cannot be read or fitted, or the program asked to give up.
pub(super) fn run_bench_fit(config: &BenchConfig, host: &mut dyn AnalysisServices) -> Result<Value, String> {
    let said = config.declared_channels();
    let files: Vec<_> = config.files.iter().map(|(name, it)| (name.as_str(), it.bytes())).collect();
    report_progress(host, 0.0, "reading the files")?;
    let read = read_bench_files(&files, &config.reading_options(&said)).map_err(|bad| bad.to_string())?;
    report_progress(host, 0.1, "fitting the tire")?;
    let options = config.fit_options();
    let points = average_over_revolutions(&read.samples, &options.tire);
    let found = fit_tire_to_means(&points, &options).map_err(|bad| bad.to_string())?;
    host.write_file(FILE, &write_tir(&found));
    let summary = bench_summary(&found, read.samples.len(), read.notes);
    host.write_file("tires.html", &page::bench::render_bench_page(&found, &points, &summary));
    Ok(result_json(&found, summary))
}

/// How much the data tell, and what was assumed.
fn bench_summary(found: &TireFit, samples: usize, notes: Vec<String>) -> Vec<String> {
    let count = |verdict| found.estimates.iter().filter(|it| it.verdict == verdict).count();
    let first = format!(
        "{} of {} coefficients are identified, {} weak, by {samples} samples; the tire is in {FILE}.",
        count(Identifiability::Identified),
        found.estimates.len(),
        count(Identifiability::Weak)
    );
    let mut summary = vec![first];
    summary.extend(notes.into_iter().map(|it| format!("{it}.")));
    summary
}

fn result_json(found: &TireFit, summary: Vec<String>) -> Value {
    let (mut coefficients, mut rows) = (Map::new(), Vec::new());
    for it in &found.estimates {
        let verdict = it.verdict.to_display_text();
        let key = it.verdict.key();
        let entry = json!({ "value": it.value, "std": it.std, "verdict": key, "reason": it.reason });
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
        let ChannelFitSummary { points, rms, status, iterations, .. } = it;
        let (name, unit) = match it.channel {
            FittedChannel::Longitudinal => ("F_x", "N"),
            FittedChannel::Lateral => ("F_y", "N"),
            FittedChannel::Aligning => ("M_z", "N.m"),
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
