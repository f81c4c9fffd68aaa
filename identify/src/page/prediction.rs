//! Writes the page of a prediction: each model's errors on the parts that were not fitted, in tables that a test report can take over.

use askama::Template;
use drive_prediction::agreement::AgreementRating;
use drive_prediction::score::{BAND, LateralScore, RolloutScore};
use html_page::{Markup, Plot, PlotAxis};
use vehicle::VehicleBody;

use crate::assessment::{ModelAssessment, ParameterAssessment, PredictionTrace};
use crate::conclusion::Conclusion;
use crate::page::filters;

/// The size of a figure [px].
const SIZE: [f64; 2] = [1000.0, 260.0];

/// What the page says in words.
#[derive(Clone, Copy)]
pub struct PredictionWords<'a> {
    /// Sentences.
    pub summary: &'a [String],
    /// What to do with the result.
    pub conclusion: &'a Conclusion,
    /// Of which parts of the drives errors are.
    pub parts: &'a str,
}

#[derive(Template)]
#[template(path = "prediction.html")]
struct PredictionPage<'a> {
    title: &'static str,
    words: PredictionWords<'a>,
    models: &'a [ModelAssessment],
    traces: &'a [PredictionTrace],
    parameters: &'a [ParameterAssessment],
    car: &'a VehicleBody,
}

/// The page: the first model is the one that is judged.
pub fn render_prediction_page(
    models: &[ModelAssessment],
    parameters: &[ParameterAssessment],
    car: &VehicleBody,
    traces: &[PredictionTrace],
    words: PredictionWords,
) -> String {
    let title = "Prediction of drives";
    html_page::render_page(&PredictionPage { title, words, models, traces, parameters, car })
}

/// A number with its 95 % interval, if there is one.
#[derive(Clone, Copy)]
struct ScoreCell {
    value: f64,
    interval: Option<[f64; 2]>,
    is_best: bool,
}

/// Scores of all models over one horizon, each with its errors of v_y, yaw rate and position.
struct HorizonTable<'a> {
    horizon: f64,
    rows: Vec<(&'a str, RolloutScore, [ScoreCell; 3])>,
}

/// The rating of one signal of a model.
struct RatingRow<'a> {
    signal: &'static str,
    model: &'a str,
    rating: &'a AgreementRating,
    overall: ScoreCell,
}

impl PredictionPage<'_> {
    fn lateral(&self) -> Vec<(&str, LateralScore, ScoreCell)> {
        let best = smallest_value(self.models.iter().filter_map(|it| it.a_y).map(|it| it.rmse));
        let scores = self.models.iter().filter_map(|it| Some((it.name.as_str(), it.a_y?)));
        let row = |(name, score): (_, LateralScore)| {
            let (value, interval) = (score.rmse, score.rmse_interval);
            (name, score, ScoreCell { value, interval, is_best: value <= best })
        };
        scores.map(row).collect()
    }

    fn horizons(&self) -> Vec<HorizonTable<'_>> {
        let longest = self.models.iter().map(|it| &it.open_loop).max_by_key(|it| it.len());
        longest.into_iter().flatten().map(|it| self.horizon_table(it.horizon)).collect()
    }

    fn horizon_table(&self, horizon: f64) -> HorizonTable<'_> {
        let of = |it: &ModelAssessment| it.open_loop.iter().find(|it| it.horizon == horizon).copied();
        let scores = self.models.iter().filter_map(|it| Some((it.name.as_str(), of(it)?)));
        let scores: Vec<(&str, RolloutScore)> = scores.collect();
        let errors = |score: &RolloutScore| [score.v_y, score.r, score.position];
        let best = [0, 1, 2].map(|k| smallest_value(scores.iter().map(|(_, score)| errors(score)[k])));
        let cells = |score: &RolloutScore| {
            [0, 1, 2].map(|k| ScoreCell {
                value: errors(score)[k],
                interval: score.intervals.map(|it| it[k]),
                is_best: errors(score)[k] <= best[k],
            })
        };
        let rows = scores.iter().map(|(name, score)| (*name, *score, cells(score))).collect();
        HorizonTable { horizon, rows }
    }

    /// The longest horizon of predictions [s].
    fn longest(&self) -> f64 {
        self.models.iter().flat_map(|it| &it.open_loop).map(|it| it.horizon).fold(0.0, f64::max)
    }

    /// Ratings by ISO/TS 18571, signal by signal.
    fn ratings(&self) -> Vec<RatingRow<'_>> {
        type RatedSignal = (&'static str, fn(&ModelAssessment) -> Option<&AgreementRating>);
        let signals: [RatedSignal; 3] = [
            ("a_y", |it| it.iso_18571.a_y.as_ref()),
            ("yaw rate", |it| it.iso_18571.r.as_ref()),
            ("v_y", |it| it.iso_18571.v_y.as_ref()),
        ];
        let ratings = signals.into_iter().flat_map(|(signal, of)| {
            let best = self.models.iter().filter_map(of).map(|it| it.overall).fold(0.0, f64::max);
            self.models.iter().filter_map(move |model| {
                let rating = of(model)?;
                let (value, interval) = (rating.overall, rating.interval);
                let overall = ScoreCell { value, interval, is_best: value >= best };
                Some(RatingRow { signal, model: &model.name, rating, overall })
            })
        });
        ratings.collect()
    }
}

fn smallest_value(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

/// Measured and predicted yaw rate and sideways velocity over time.
fn plots(trace: &PredictionTrace) -> Vec<Markup> {
    let figures = [(1, "yaw rate [deg/s]", 180.0 / std::f64::consts::PI), (0, "v_y [m/s]", 1.0)];
    let plot = |(channel, label, factor): (usize, &str, f64)| {
        let measured: Vec<(f64, f64)> =
            trace.measured.iter().map(|(t, state)| (*t, factor * state[channel])).collect();
        let heights = measured.iter().map(|it| it.1);
        let mut plot = Plot::new(
            SIZE,
            PlotAxis::around_values("time [s]", measured.iter().map(|it| it.0)),
            PlotAxis::around_values(label, heights),
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
                plot.add_band(&band, "c1", name("95 % band"));
            }
            let line: Vec<_> = piece.iter().map(|it| (it.0, factor * it.1[channel])).collect();
            plot.add_line(&line, "c1", name("predicted"));
        }
        plot.add_line(&measured, "truth", "measured");
        plot.figure_with_legend(if channel == 1 { &trace.name } else { "" })
    };
    figures.map(plot).into()
}
