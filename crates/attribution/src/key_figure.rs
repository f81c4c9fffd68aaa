//! Collects the key figures of two runs side by side: lap times, and the values that a sweep collects.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use crate::run_inputs::RecordedReport;

/// The result of an analysis with the time of a lap.
const LAP_TIME: &str = "lap_time";
/// Laps that are listed one by one.
const MOST_LAPS: usize = 12;

/// A figure of two runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KeyFigure {
    /// What it is: `lap 1`.
    pub name: String,
    /// Its unit; none if the runs did not keep it.
    pub unit: Option<String>,
    /// In A; none if A does not have it.
    pub a: Option<f64>,
    /// In B.
    pub b: Option<f64>,
}

/// The figures that at least one of two runs has: lap times, then collected values.
pub(crate) fn collect_key_figures(reports: [Option<&RecordedReport>; 2]) -> Vec<KeyFigure> {
    let of_laps = reports.map(|report| report.map(lap_times).unwrap_or_default());
    let of_analyses = reports.map(|report| report.map(analysed_lap_times).unwrap_or_default());
    let of_collected = reports.map(|report| {
        let values = report.into_iter().flat_map(|it| &it.collected);
        values.filter_map(|(name, value)| Some((name.clone(), (*value)?))).collect::<Vec<_>>()
    });
    let seconds = Some("s".to_owned());
    let mut figures = join_figures(of_laps, &seconds);
    figures.extend(join_figures(of_analyses, &seconds));
    figures.extend(join_figures(of_collected, &None));
    figures
}

/// Joins the named values of A and B, in the order of A; what only B has comes last.
fn join_figures([of_a, of_b]: [Vec<(String, f64)>; 2], unit: &Option<String>) -> Vec<KeyFigure> {
    let mut rest: BTreeMap<String, f64> = of_b.iter().cloned().collect();
    let figure = |name: String, a, b| KeyFigure { name, unit: unit.clone(), a, b };
    let mut figures = Vec::new();
    for (name, value) in of_a {
        let other = rest.remove(&name);
        figures.push(figure(name, Some(value), other));
    }
    let new = of_b.into_iter().filter(|(name, _)| rest.contains_key(name));
    figures.extend(new.map(|(name, value)| figure(name, None, Some(value))));
    figures
}

/// The completed laps [s], and the best of several.
fn lap_times(report: &RecordedReport) -> Vec<(String, f64)> {
    let laps: Vec<(usize, f64)> =
        report.laps.iter().filter_map(|lap| Some((lap.number, lap.duration?))).collect();
    let listed = laps.iter().take(MOST_LAPS);
    let mut figures: Vec<_> = listed.map(|(number, duration)| (format!("lap {number}"), *duration)).collect();
    if laps.len() > 1 {
        let best = laps.iter().map(|(_, duration)| *duration).fold(f64::INFINITY, f64::min);
        figures.push(("best lap".to_owned(), best));
    }
    figures
}

/// The results of analyses that are called `lap_time` [s].
fn analysed_lap_times(report: &RecordedReport) -> Vec<(String, f64)> {
    let mut figures = Vec::new();
    let mut open: Vec<(String, &Value)> =
        report.analyses.iter().map(|(name, result)| (name.clone(), result)).collect();
    while let Some((path, value)) = open.pop() {
        for (key, inner) in value.as_object().into_iter().flatten() {
            let path = format!("{path}.{key}");
            match inner.as_f64().filter(|_| key == LAP_TIME) {
                Some(lap) => figures.push((path, lap)),
                None => open.push((path, inner)),
            }
        }
    }
    figures.sort_by(|x, y| x.0.cmp(&y.0));
    figures
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run_inputs::RecordedLap;

    #[test]
    fn laps_stand_side_by_side() {
        let report = |durations: &[f64], analyses: serde_json::Value| {
            let laps = durations.iter().enumerate();
            let lap = |(place, duration): (usize, &f64)| RecordedLap {
                number: place + 1,
                duration: Some(*duration),
            };
            RecordedReport {
                laps: laps.map(lap).collect(),
                analyses: analyses.as_object().cloned().unwrap_or_default(),
                ..RecordedReport::default()
            }
        };
        let a = report(&[40.0, 39.5], serde_json::json!({"lap": {"fastest": {"lap_time": 38.0}}}));
        let b = report(&[41.0], serde_json::json!({}));
        let found = collect_key_figures([Some(&a), Some(&b)]);
        let shown: Vec<_> = found.iter().map(|it| (it.name.as_str(), it.a, it.b)).collect();
        assert_eq!(
            shown,
            [
                ("lap 1", Some(40.0), Some(41.0)),
                ("lap 2", Some(39.5), None),
                ("best lap", Some(39.5), None),
                ("lap.fastest.lap_time", Some(38.0), None),
            ]
        );
    }
}
