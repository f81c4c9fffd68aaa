//! Tells what parts of a log say of the lateral curves: whether a window tells them, and whether stiffness and friction drift.

use preparation::{PointTimeSeries, PreparationPipeline, PreparedRecording};
use serde::Serialize;
use serde_json::{Value, json};
use tire_inference::drift::{self, DriftEstimate};
use tire_inference::local::{StretchFit, StretchPrior};
use tire_inference::window::WindowIdentifiability;

use crate::config::stretches::{self, WindowConfig};

/// Parts of a log that are looked at: more would only say that the length is too short.
const MOST: usize = 20_000;

/// Stretches of a drift: the effort grows with the third power of their number.
const MOST_STRETCHES: f64 = 100.0;

/// The drift of one quantity of one axle.
#[derive(Clone, Debug, Serialize)]
pub struct QuantityDrift {
    /// As "stiffness K of the rear axle".
    #[serde(skip)]
    pub name: String,
    /// Key of the axle in the result.
    #[serde(skip)]
    pub axle: &'static str,
    /// `K` or `D`.
    #[serde(skip)]
    pub quantity: &'static str,
    /// Unit in sentences and plots, and what a value in the result is multiplied with to have it.
    #[serde(skip)]
    pub unit: (f64, &'static str),
    /// That in a sentence.
    pub sentence: String,
    /// What was found.
    #[serde(flatten)]
    pub drift: DriftEstimate,
}

/// Lateral points and load at rest of both axles [N].
pub(crate) fn lateral_series_and_loads<'a>(
    prepared: &'a PreparedRecording,
    pipeline: &PreparationPipeline,
) -> [(&'static str, &'a PointTimeSeries, f64); 2] {
    let [front, rear] = pipeline.car.body.static_loads();
    [("front", &prepared.front.lateral.series, front), ("rear", &prepared.rear.lateral.series, rear)]
}

/// Parts of a length [s] from the first row on: their beginning, and their points.
fn split_by_length(series: &PointTimeSeries, length: f64) -> Vec<(f64, PointTimeSeries)> {
    let [Some(first), Some(last)] = [series.time.first(), series.time.last()] else {
        return Vec::new();
    };
    let count = ((last - first) / length).floor().min(MOST as f64) as usize;
    let part = |k: usize| {
        let from = first + k as f64 * length;
        (from, points_between(series, [from, from + length]))
    };
    (0..count).map(part).collect()
}

/// The points from a time on, up to before another one [s].
fn points_between(series: &PointTimeSeries, [from, until]: [f64; 2]) -> PointTimeSeries {
    let row = |time: f64| series.time.partition_point(|t| *t < time);
    let rows: Vec<usize> = (row(from)..row(until)).collect();
    series.select_rows(&rows)
}

/// A lap: its number, and its beginning and end [s].
type LapInterval = (f64, [f64; 2]);

/// Laps of the signal `lap`, given by time stamps and values: wherever its nearest whole number changes. Of many laps some are put together.
fn find_laps([times, values]: [&[f64]; 2]) -> Vec<LapInterval> {
    let mut laps: Vec<LapInterval> = Vec::new();
    let rows = times.iter().zip(values).filter(|(_, value)| value.is_finite());
    for (time, number) in rows.map(|(time, value)| (*time, value.round())) {
        if let Some((last, [_, until])) = laps.last_mut() {
            *until = time;
            if *last == number {
                continue;
            }
        }
        laps.push((number, [time; 2]));
    }
    // The last row is part of its lap.
    laps.iter_mut().last().into_iter().for_each(|(_, [_, until])| *until = until.next_up());
    let together = laps.len().div_ceil(MOST_STRETCHES as usize).max(1);
    let joined = |laps: &[LapInterval]| (laps[0].0, [laps[0].1[0], laps[laps.len() - 1].1[1]]);
    laps.chunks(together).map(joined).collect()
}

/// Drift of K and D of both axles from lap to lap, or from stretch to stretch of a length, in a long log of a hundredth of it; with time stamps and
/// values of a signal by its name, such as `lap` and `tread_temperature_f`.
pub fn estimate_drift<'a>(
    config: &stretches::DriftConfig,
    signal: impl Fn(&str) -> Option<[&'a [f64]; 2]>,
    prepared: &PreparedRecording,
    pipeline: &PreparationPipeline,
) -> Vec<QuantityDrift> {
    let usual = StretchPrior::default();
    let of_axle = |(axle, series, load): (&'static str, &PointTimeSeries, f64)| {
        let seconds = series.time.last().zip(series.time.first()).map_or(0.0, |(last, first)| last - first);
        let length = config.length.max(seconds / MOST_STRETCHES);
        let name = format!("tread_temperature_{}", &axle[..1]);
        let temperature = |[from, until]: [f64; 2]| {
            let [times, values] = signal(&name)?;
            let row = |time: f64| times.partition_point(|t| *t < time);
            let values = values.get(row(from)..row(until))?;
            let sum: f64 = values.iter().sum();
            (!values.is_empty()).then(|| sum / values.len() as f64)
        };
        let parts: Vec<(Option<f64>, [f64; 2], PointTimeSeries)> = if config.laps {
            let part = |(number, ends)| (Some(number), ends, points_between(series, ends));
            signal("lap").map(find_laps).unwrap_or_default().into_iter().map(part).collect()
        } else {
            let part = |(from, part)| (None, [from, from + length], part);
            split_by_length(series, length).into_iter().map(part).collect()
        };
        let stretches: Vec<[drift::StretchValue; 2]> = parts
            .iter()
            .filter_map(|(lap, ends, part)| {
                let local = StretchFit::fit(part, load, &usual)?;
                let value = |(logarithm, variance)| drift::StretchValue {
                    time: 0.5 * (ends[0] + ends[1]),
                    lap: *lap,
                    logarithm,
                    variance,
                    temperature: temperature(*ends),
                };
                Some(local.log_stiffness_and_peak().map(value))
            })
            .collect();
        let quantities = [("K", "stiffness K", (1e-3 * load, "kN/rad")), ("D", "friction D", (1.0, ""))];
        quantities.into_iter().enumerate().map(move |(place, (quantity, title, unit))| {
            let values: Vec<_> = stretches.iter().map(|both| both[place]).collect();
            let drift = DriftEstimate::estimate(&values);
            let name = format!("{title} of the {axle} axle");
            let sentence = drift.describe(&name, unit.0, unit.1);
            QuantityDrift { name, axle, quantity, unit, sentence, drift }
        })
    };
    lateral_series_and_loads(prepared, pipeline).into_iter().flat_map(of_axle).collect()
}

/// The drift by axle and quantity.
pub fn drift_json(told: &[QuantityDrift]) -> Value {
    let mut result = json!({});
    for it in told {
        result[it.axle][it.quantity] = json!(it);
    }
    result
}

/// What each window says of both axles.
pub fn assess_windows(
    config: &WindowConfig,
    prepared: &PreparedRecording,
    pipeline: &PreparationPipeline,
) -> Value {
    let claim = config.curve_requirement();
    let of_axle = |(axle, series, load): (&str, &PointTimeSeries, f64)| {
        let told = |(from, part): (f64, PointTimeSeries)| json!({ "from": from, "until": from + config.length, "curve": WindowIdentifiability::judge(&part, load, &claim) });
        let all: Vec<Value> = split_by_length(series, config.length).into_iter().map(told).collect();
        (axle.to_owned(), Value::Array(all))
    };
    Value::Object(lateral_series_and_loads(prepared, pipeline).into_iter().map(of_axle).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laps_begin_where_their_number_changes() {
        let times: Vec<f64> = (0..10).map(f64::from).collect();
        let values = [1.0, 1.0, f64::NAN, 1.4, 1.6, 2.0, 2.0, 0.0, 0.0, 0.0];
        let found = find_laps([&times, &values]);
        let expected = [(1.0, [0.0, 4.0]), (2.0, [4.0, 7.0]), (0.0, [7.0, 9.0_f64.next_up()])];
        assert_eq!(found, expected);
        assert_eq!(find_laps([&[], &[]]), []);
        assert_eq!(find_laps([&times, &[f64::NAN; 10]]), []);
    }

    #[test]
    fn many_laps_are_put_together() {
        let times: Vec<f64> = (0..1000).map(f64::from).collect();
        let found = find_laps([&times, &times]);
        assert_eq!((found.len(), found[1]), (100, (10.0, [10.0, 20.0])));
    }
}
