//! Writes the page of a prediction: each model's errors on the parts that were not fitted, in tables that a test report can take over.

use askama::Template;
use drive_prediction::agreement::Agreement;
use drive_prediction::score::{BAND, LateralScore, RolloutScore};
use html_page::{Axis, Markup, Plot};
use vehicle::Body;

use crate::assessment::{ModelAssessment, ParameterAssessment, Trace};
use crate::page::filters;

/// The size of a figure [px].
const SIZE: [f64; 2] = [1000.0, 260.0];

#[derive(Template)]
#[template(path = "prediction.html")]
struct Page<'a> {
    title: &'static str,
    summary: &'a [String],
    parts: &'a str,
    models: &'a [ModelAssessment],
    traces: &'a [Trace],
    parameters: &'a [ParameterAssessment],
    car: &'a Body,
}

/// The page: the first model is the one that is judged; `parts` says of which parts of the drives errors are.
pub fn page(
    models: &[ModelAssessment],
    parameters: &[ParameterAssessment],
    car: &Body,
    traces: &[Trace],
    summary: &[String],
    parts: &str,
) -> String {
    let title = "Prediction of drives";
    html_page::render(&Page { title, summary, parts, models, traces, parameters, car })
}

/// A number with its 95 % interval, if there is one.
#[derive(Clone, Copy)]
struct Cell {
    value: f64,
    interval: Option<[f64; 2]>,
    is_best: bool,
}

/// Scores of all models over one horizon, each with its errors of v_y, yaw rate and position.
struct Horizon<'a> {
    horizon: f64,
    rows: Vec<(&'a str, RolloutScore, [Cell; 3])>,
}

/// The rating of one signal of a model.
struct Rating<'a> {
    signal: &'static str,
    model: &'a str,
    rating: &'a Agreement,
    overall: Cell,
}

impl Page<'_> {
    fn lateral(&self) -> Vec<(&str, LateralScore, Cell)> {
        let best = least(self.models.iter().filter_map(|it| it.a_y).map(|it| it.rmse));
        let scores = self.models.iter().filter_map(|it| Some((it.name.as_str(), it.a_y?)));
        let row = |(name, score): (_, LateralScore)| {
            let (value, interval) = (score.rmse, score.rmse_interval);
            (name, score, Cell { value, interval, is_best: value <= best })
        };
        scores.map(row).collect()
    }

    fn horizons(&self) -> Vec<Horizon<'_>> {
        let longest = self.models.iter().map(|it| &it.open_loop).max_by_key(|it| it.len());
        longest.into_iter().flatten().map(|it| self.open_loop(it.horizon)).collect()
    }

    fn open_loop(&self, horizon: f64) -> Horizon<'_> {
        let of =
            |it: &ModelAssessment| it.open_loop.iter().find(|it| it.horizon == horizon).copied();
        let scores = self.models.iter().filter_map(|it| Some((it.name.as_str(), of(it)?)));
        let scores: Vec<(&str, RolloutScore)> = scores.collect();
        let errors = |score: &RolloutScore| [score.v_y, score.r, score.position];
        let best = [0, 1, 2].map(|k| least(scores.iter().map(|(_, score)| errors(score)[k])));
        let cells = |score: &RolloutScore| {
            [0, 1, 2].map(|k| Cell {
                value: errors(score)[k],
                interval: score.intervals.map(|it| it[k]),
                is_best: errors(score)[k] <= best[k],
            })
        };
        let rows = scores.iter().map(|(name, score)| (*name, *score, cells(score))).collect();
        Horizon { horizon, rows }
    }

    /// The longest horizon of predictions [s].
    fn longest(&self) -> f64 {
        self.models.iter().flat_map(|it| &it.open_loop).map(|it| it.horizon).fold(0.0, f64::max)
    }

    /// Ratings by ISO/TS 18571, signal by signal.
    fn ratings(&self) -> Vec<Rating<'_>> {
        type Signal = (&'static str, fn(&ModelAssessment) -> Option<&Agreement>);
        let signals: [Signal; 3] = [
            ("a_y", |it| it.iso_18571.a_y.as_ref()),
            ("yaw rate", |it| it.iso_18571.r.as_ref()),
            ("v_y", |it| it.iso_18571.v_y.as_ref()),
        ];
        let ratings = signals.into_iter().flat_map(|(signal, of)| {
            let best = self.models.iter().filter_map(of).map(|it| it.overall).fold(0.0, f64::max);
            self.models.iter().filter_map(move |model| {
                let rating = of(model)?;
                let (value, interval) = (rating.overall, rating.interval);
                let overall = Cell { value, interval, is_best: value >= best };
                Some(Rating { signal, model: &model.name, rating, overall })
            })
        });
        ratings.collect()
    }
}

fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

/// Measured and predicted yaw rate and sideways velocity over time.
fn plots(trace: &Trace) -> Vec<Markup> {
    let figures = [(1, "yaw rate [deg/s]", 180.0 / std::f64::consts::PI), (0, "v_y [m/s]", 1.0)];
    let plot = |(channel, label, factor): (usize, &str, f64)| {
        let measured: Vec<(f64, f64)> =
            trace.measured.iter().map(|(t, state)| (*t, factor * state[channel])).collect();
        let heights = measured.iter().map(|it| it.1);
        let mut plot = Plot::new(
            SIZE,
            Axis::about("time [s]", measured.iter().map(|it| it.0)),
            Axis::about(label, heights),
        );
        for (k, piece) in trace.predicted.iter().enumerate() {
            let name = |text: &'static str| if k == 0 { text } else { "" };
            let band: Vec<_> = piece
                .iter()
                .filter_map(|(t, state, spread)| {
                    let half = BAND[0] * (*spread)?[channel];
                    Some((*t, [-half, half].map(|it| factor * (state[channel] + it))))
                })
                .collect();
            if !band.is_empty() {
                plot.band(&band, "c1", name("95 % band"));
            }
            let line: Vec<_> = piece.iter().map(|it| (it.0, factor * it.1[channel])).collect();
            plot.line(&line, "c1", name("predicted"));
        }
        plot.line(&measured, "truth", "measured");
        plot.figure(if channel == 1 { &trace.name } else { "" })
    };
    figures.map(plot).into()
}
