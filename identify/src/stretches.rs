//! Tells what parts of a log say of the lateral curves: whether a window tells them, and whether stiffness and friction drift.

use preparation::{Pipeline, Prepared, Series};
use serde::Serialize;
use serde_json::{Value, json};
use tire_inference::drift::{self, Drift};
use tire_inference::local::{Local, Usual};
use tire_inference::window::Window;

use crate::config::stretches::Windows;

/// Parts of a log that are looked at: more would only say that the length is too short.
const MOST: usize = 20_000;

/// Stretches of a drift: the effort grows with the third power of their number.
const MOST_STRETCHES: f64 = 100.0;

/// The drift of one quantity of one axle.
#[derive(Clone, Debug, Serialize)]
pub struct Drifting {
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
    pub drift: Drift,
}

/// Lateral points and load at rest of both axles [N].
pub(crate) fn axles<'a>(
    prepared: &'a Prepared,
    pipeline: &Pipeline,
) -> [(&'static str, &'a Series, f64); 2] {
    let [front, rear] = pipeline.car.body.static_loads();
    [
        ("front", &prepared.front.lateral.series, front),
        ("rear", &prepared.rear.lateral.series, rear),
    ]
}

/// Parts of a length [s] from the first row on: their beginning, and their points.
fn parts(series: &Series, length: f64) -> Vec<(f64, Series)> {
    let [Some(first), Some(last)] = [series.time.first(), series.time.last()] else {
        return Vec::new();
    };
    let count = ((last - first) / length).floor().min(MOST as f64) as usize;
    let part = |k: usize| {
        let from = first + k as f64 * length;
        let row = |time: f64| series.time.partition_point(|t| *t < time);
        let rows: Vec<usize> = (row(from)..row(from + length)).collect();
        (from, series.pick(&rows))
    };
    (0..count).map(part).collect()
}

/// Drift of K and D of both axles from stretch to stretch of a length [s], in a long log of a hundredth of it; with time stamps and values of a signal by its name, such as
/// `tread_temperature_f`.
pub fn drift<'a>(
    length: f64,
    signal: impl Fn(&str) -> Option<[&'a [f64]; 2]>,
    (prepared, pipeline): (&Prepared, &Pipeline),
) -> Vec<Drifting> {
    let usual = Usual::default();
    let of_axle = |(axle, series, load): (&'static str, &Series, f64)| {
        let seconds =
            series.time.last().zip(series.time.first()).map_or(0.0, |(last, first)| last - first);
        let length = length.max(seconds / MOST_STRETCHES);
        let name = format!("tread_temperature_{}", &axle[..1]);
        let temperature = |from: f64| {
            let [times, values] = signal(&name)?;
            let row = |time: f64| times.partition_point(|t| *t < time);
            let values = values.get(row(from)..row(from + length))?;
            let sum: f64 = values.iter().sum();
            (!values.is_empty()).then(|| sum / values.len() as f64)
        };
        let stretches: Vec<[drift::Value; 2]> = parts(series, length)
            .iter()
            .filter_map(|(from, part)| {
                let local = Local::fit(part, load, &usual)?;
                let time = from + 0.5 * length;
                let value = |(logarithm, variance)| drift::Value {
                    time,
                    logarithm,
                    variance,
                    temperature: temperature(*from),
                };
                Some(local.logarithms().map(value))
            })
            .collect();
        let quantities =
            [("K", "stiffness K", (1e-3 * load, "kN/rad")), ("D", "friction D", (1.0, ""))];
        quantities.into_iter().enumerate().map(move |(place, (quantity, title, unit))| {
            let values: Vec<_> = stretches.iter().map(|both| both[place]).collect();
            let drift = Drift::of(&values);
            let name = format!("{title} of the {axle} axle");
            let sentence = drift.sentence(&name, unit);
            Drifting { name, axle, quantity, unit, sentence, drift }
        })
    };
    axles(prepared, pipeline).into_iter().flat_map(of_axle).collect()
}

/// The drift by axle and quantity.
pub fn report(told: &[Drifting]) -> Value {
    let mut result = json!({});
    for it in told {
        result[it.axle][it.quantity] = json!(it);
    }
    result
}

/// What each window says of both axles.
pub fn windows(config: &Windows, (prepared, pipeline): (&Prepared, &Pipeline)) -> Value {
    let claim = config.claim();
    let of_axle = |(axle, series, load): (&str, &Series, f64)| {
        let told = |(from, part): (f64, Series)| json!({ "from": from, "until": from + config.length, "curve": Window::of(&part, load, &claim) });
        let all: Vec<Value> = parts(series, config.length).into_iter().map(told).collect();
        (axle.to_owned(), Value::Array(all))
    };
    Value::Object(axles(prepared, pipeline).into_iter().map(of_axle).collect())
}
