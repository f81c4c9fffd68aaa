//! Fits a tire to tables of a test bench: a `.tir` file, and a verdict for each coefficient.

use plugin::Host;
use serde_json::{Map, Value, json};
use tire_bench::{Channel, Fit, Residuals, fit, read_csv, write_tir};

use super::go_on;
use crate::config::Bench;

/// The file that the task leaves.
const FILE: &str = "bench.tir";

/// Does `task = "bench"`.
///
/// # Errors
/// When a table cannot be read or fitted, or the program asked to give up.
pub(super) fn bench(config: &Bench, host: &mut dyn Host) -> Result<Value, String> {
    let columns: Vec<_> = config
        .columns
        .iter()
        .map(|(name, it)| (name.as_str(), it.column.as_str(), it.unit.as_str()))
        .collect();
    let mut samples = Vec::new();
    for (run, (name, text)) in config.files.iter().enumerate() {
        go_on(host, 0.0, &format!("reading {name}"))?;
        let read = read_csv(text, name, run, &columns, config.axes());
        samples.extend(read.map_err(|bad| bad.to_string())?);
    }
    go_on(host, 0.1, "fitting the tire")?;
    let found = fit(&samples, &config.options()).map_err(|bad| bad.to_string())?;
    host.file(FILE, &write_tir(&found));
    Ok(result(&found, samples.len()))
}

fn result(found: &Fit, samples: usize) -> Value {
    let (mut coefficients, mut rows) = (Map::new(), Vec::new());
    for it in &found.estimates {
        let verdict = format!("{:?}", it.verdict);
        let entry =
            json!({ "value": it.value, "std": it.std, "verdict": verdict, "reason": it.reason });
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
    let summary = format!("{samples} samples; the tire is in {FILE}.");
    json!({
        "coefficients": coefficients,
        "residuals": residuals,
        "draws": found.draws,
        "summary": [summary],
        "tables": [
            { "head": ["channel", "points", "rms", "unit", "status"], "rows": fits },
            { "head": ["coefficient", "value", "standard deviation", "verdict", "reason"], "rows": rows },
        ],
    })
}
