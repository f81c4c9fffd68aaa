//! Collects the key figures of two runs side by side: lap times, and the values that a sweep collects.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use crate::run_inputs::RecordedReport;
use crate::trajectory::Trajectory;

/// The variable or result with the time of a completed lap.
const LAP_TIME: &str = "lap_time";
/// Laps that are listed one by one.
const MOST_LAPS: usize = 12;

/// A figure of two runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KeyFigure {
    /// What it is: `driver.lap_time, lap 1`.
    pub name: String,
    /// Its unit; none if the runs did not keep it.
    pub unit: Option<String>,
    /// In A; none if A does not have it.
    pub a: Option<f64>,
    /// In B.
    pub b: Option<f64>,
}

/// The figures that at least one of two runs has: lap times, then collected values.
pub(crate) fn collect_key_figures(
    reports: [Option<&RecordedReport>; 2],
    trajectories: [Option<&Trajectory>; 2],
) -> Vec<KeyFigure> {
    let of_laps = trajectories.map(|run| run.map(driven_lap_times).unwrap_or_default());
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

/// The completed laps of each output called `lap_time`, which shows the last one [s], and the best of several.
fn driven_lap_times(run: &Trajectory) -> Vec<(String, f64)> {
    let mut figures = Vec::new();
    let is_lap_time = |name: &str| name.rsplit('.').next() == Some(LAP_TIME);
    let outputs = run.columns.iter().filter(|it| !it.input && is_lap_time(&it.variable));
    for signal in outputs {
        let name = signal.qualified_name();
        let mut laps = run.column_values(signal).unwrap_or_default();
        laps.dedup();
        laps.retain(|it| it.is_finite() && *it > 0.0);
        let listed = laps.iter().take(MOST_LAPS).enumerate();
        figures.extend(listed.map(|(place, lap)| (format!("{name}, lap {}", place + 1), *lap)));
        if laps.len() > 1 {
            let best = laps.iter().copied().fold(f64::INFINITY, f64::min);
            figures.push((format!("{name}, best lap"), best));
        }
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
    use crate::trajectory::SignalName;

    #[test]
    fn laps_stand_side_by_side() {
        let run = |laps: [f64; 5]| {
            let name = SignalName {
                node: "driver".to_owned(),
                variable: "lap_time".to_owned(),
                input: false,
                unit: Some("s".to_owned()),
            };
            Trajectory::from_columns(vec![name], vec![0.0, 1.0, 2.0, 3.0, 4.0], laps.to_vec())
        };
        let (a, b) = (run([0.0, 40.0, 40.0, 39.5, 39.5]), run([0.0, 0.0, 41.0, 41.0, 41.0]));
        let analysed = RecordedReport {
            analyses: serde_json::json!({"lap": {"fastest": {"lap_time": 38.0}}})
                .as_object()
                .cloned()
                .unwrap_or_default(),
            ..RecordedReport::default()
        };
        let found = collect_key_figures([Some(&analysed), None], [Some(&a), Some(&b)]);
        let shown: Vec<_> = found.iter().map(|it| (it.name.as_str(), it.a, it.b)).collect();
        assert_eq!(
            shown,
            [
                ("driver.lap_time, lap 1", Some(40.0), Some(41.0)),
                ("driver.lap_time, lap 2", Some(39.5), None),
                ("driver.lap_time, best lap", Some(39.5), None),
                ("lap.fastest.lap_time", Some(38.0), None),
            ]
        );
    }
}
