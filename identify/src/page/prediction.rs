//! Writes the page of a prediction: each model's errors on the parts that were not fitted, in tables that a test report can take over.

use std::fmt::Write;

use drive_prediction::agreement::Agreement;
use drive_prediction::score::BAND;
use html_page::{Axis, Plot, escape};
use numerics::text::{significant, with_std};
use vehicle::Body;

use crate::assessment::{ModelAssessment, ParameterAssessment, Trace};
use crate::names::{class, words};

/// The size of a figure [px].
const SIZE: [f64; 2] = [1000.0, 260.0];

/// The page: the first model is the one that is judged.
pub fn page(
    (judged, found, car): (&[ModelAssessment], &[ParameterAssessment], &Body),
    traces: &[Trace],
    summary: &[String],
    parts: &str,
) -> String {
    let mut html = String::new();
    let mut sentences = summary.iter();
    if let Some(first) = sentences.next() {
        let _ = writeln!(html, "<p>{}</p>", escape(first));
    }
    let list: String = sentences.map(|it| format!("<li>{}</li>\n", escape(it))).collect();
    if !list.is_empty() {
        let _ = writeln!(html, "<ul>\n{list}</ul>");
    }
    let _ = writeln!(html, "<h2>Errors</h2>\n<p class=\"faint\">{}</p>", escape(parts));
    lateral(&mut html, judged);
    let horizons = judged.iter().map(|it| &it.open_loop).max_by_key(|it| it.len());
    for score in horizons.into_iter().flatten() {
        open_loop(&mut html, judged, score.horizon);
    }
    rated(&mut html, judged);
    if let (false, Some(model)) = (traces.is_empty(), judged.first()) {
        let _ = writeln!(
            html,
            "<h2>Predictions of the {} car</h2>\n<p class=\"faint\">Each begins with the measured state and sees speed and steering alone. 95 % of \
             what happens is meant to lie within the band.</p>",
            escape(&model.name)
        );
        traces.iter().for_each(|trace| drawn(&mut html, trace));
    }
    parameters(&mut html, found, car);
    html_page::page("Prediction of drives", "td.best { font-weight: 700; }\n", &html)
}

/// A cell with a number and its 95 % interval, if there is one.
fn cell(value: f64, interval: Option<[f64; 2]>, is_best: bool) -> String {
    let class = if is_best { "number best" } else { "number" };
    let interval = interval.map_or(String::new(), |[low, high]| {
        format!(" <span class=\"faint\">{} to {}</span>", significant(low, 3), significant(high, 3))
    });
    format!("<td class=\"{class}\">{}{interval}</td>", significant(value, 3))
}

fn share(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| format!("{:.1} %", 100.0 * value))
}

fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

fn lateral(html: &mut String, judged: &[ModelAssessment]) {
    let scores = || judged.iter().filter_map(|it| Some((&it.name, it.a_y?)));
    if scores().next().is_none() {
        return;
    }
    html.push_str(
        "<h3>Lateral acceleration from measured speed, sideslip, yaw rate and steering</h3>\n<table>\n<tr><th>Model</th>\
         <th>RMSE [m/s²]</th><th>Bias [m/s²]</th><th>In the 50 % band</th><th>In the 95 % band</th><th>Rows</th></tr>\n",
    );
    let best = least(scores().map(|(_, it)| it.rmse));
    for (name, score) in scores() {
        let _ = writeln!(
            html,
            "<tr><th>{}</th>{}<td class=\"number\">{:+.3}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escape(name),
            cell(score.rmse, score.rmse_interval, score.rmse <= best),
            score.bias,
            share(score.coverage_half),
            share(score.coverage),
            score.rows
        );
    }
    html.push_str("</table>\n");
}

fn open_loop(html: &mut String, judged: &[ModelAssessment], horizon: f64) {
    let of =
        |it: &ModelAssessment| it.open_loop.iter().find(|score| score.horizon == horizon).copied();
    let scores: Vec<_> = judged.iter().filter_map(|it| Some((&it.name, of(it)?))).collect();
    let _ = writeln!(
        html,
        "<h3>Open loop over {horizon} s</h3>\n<table>\n<tr><th>Model</th><th>v_y [m/s]</th><th>Yaw rate [rad/s]</th><th>Position at the \
         end [m]</th><th>v_y, yaw rate in the 50 % band</th><th>In the 95 % band</th><th>Spins</th><th>Predictions</th></tr>"
    );
    let best = [
        least(scores.iter().map(|it| it.1.v_y)),
        least(scores.iter().map(|it| it.1.r)),
        least(scores.iter().map(|it| it.1.position)),
    ];
    for (name, score) in &scores {
        let inside = [score.coverage_half, score.coverage].map(|band| match band {
            Some(shares) => shares.map(|it| share(Some(it))).join(", "),
            None => "–".to_owned(),
        });
        let inside = inside.join("</td><td>");
        let interval = |i: usize| score.intervals.map(|it| it[i]);
        let _ = writeln!(
            html,
            "<tr><th>{}</th>{}{}{}<td>{inside}</td><td>{:.1} %</td><td>{}</td></tr>",
            escape(name),
            cell(score.v_y, interval(0), score.v_y <= best[0]),
            cell(score.r, interval(1), score.r <= best[1]),
            cell(score.position, interval(2), score.position <= best[2]),
            100.0 * score.spun,
            score.count
        );
    }
    html.push_str("</table>\n");
}

/// The rating of one signal of a model.
type Of = fn(&ModelAssessment) -> Option<&Agreement>;

/// Ratings by ISO/TS 18571, with their parts.
fn rated(html: &mut String, judged: &[ModelAssessment]) {
    let longest =
        judged.iter().flat_map(|it| &it.open_loop).map(|it| it.horizon).fold(0.0, f64::max);
    let channels: [(&str, Of); 3] = [
        ("a_y", |it| it.iso_18571.a_y.as_ref()),
        ("yaw rate", |it| it.iso_18571.r.as_ref()),
        ("v_y", |it| it.iso_18571.v_y.as_ref()),
    ];
    if judged.iter().all(|it| channels.iter().all(|(_, of)| of(it).is_none())) {
        return;
    }
    let _ = writeln!(
        html,
        "<h3>Ratings by ISO/TS 18571</h3>\n<p class=\"faint\">Of a_y from measured states in pieces of 10 s, of yaw rate and v_y in predictions \
         over {longest} s: means over the pieces in which something happens. 1 is the best; above 0.94 is excellent, above 0.80 good, above \
         0.58 fair.</p>\n<table>\n<tr><th>Signal</th><th>Model</th><th>Rating</th><th>Grade</th><th>Corridor</th><th>Phase</th>\
         <th>Magnitude</th><th>Slope</th><th>Pieces</th></tr>"
    );
    for (signal, of) in channels {
        let best = judged.iter().filter_map(of).map(|it| it.overall).fold(0.0, f64::max);
        for (model, it) in judged.iter().filter_map(|it| Some((&it.name, of(it)?))) {
            let parts = [it.corridor, it.phase, it.magnitude, it.slope];
            let parts = parts.map(|part| format!("<td class=\"number\">{part:.2}</td>")).concat();
            let _ = writeln!(
                html,
                "<tr><th>{signal}</th><td>{}</td>{}<td>{}</td>{parts}<td>{}</td></tr>",
                escape(model),
                cell(it.overall, it.interval, it.overall >= best),
                it.grade,
                it.pieces
            );
        }
    }
    html.push_str("</table>\n");
}

fn parameters(html: &mut String, found: &[ParameterAssessment], car: &Body) {
    let _ = writeln!(
        html,
        "<h2>The car</h2>\n<p class=\"faint\">As configured: {} kg, centre of gravity {} m behind the front and {} m ahead of the rear axle.</p>",
        significant(car.m, 4),
        significant(car.l_f, 4),
        significant(car.l_r, 4)
    );
    html.push_str(
        "<table class=\"stack\">\n<tr><th>Parameter</th><th>Value</th><th>95 % interval</th><th>Differs between logs by</th>\
         <th>Verdict</th><th>Why</th></tr>\n",
    );
    for it in found {
        let between = if it.between > 0.0 { significant(it.between, 2) } else { "–".to_owned() };
        let _ = writeln!(
            html,
            "<tr><th>{} [{}]</th><td class=\"number\">{}</td><td class=\"number\">{} to {}</td><td>{between}</td>\
             <td class=\"{}\">{}</td><td>{}</td></tr>",
            it.what,
            if it.unit.is_empty() { "–" } else { it.unit },
            with_std(it.value, it.std),
            significant(it.interval[0], 3),
            significant(it.interval[1], 3),
            class(it.verdict),
            words(it.verdict),
            escape(&it.reason)
        );
    }
    html.push_str("</table>\n");
}

/// Measured and predicted yaw rate and sideways velocity over time.
fn drawn(html: &mut String, trace: &Trace) {
    let figures = [(1, "yaw rate [deg/s]", 180.0 / std::f64::consts::PI), (0, "v_y [m/s]", 1.0)];
    for (number, (channel, label, factor)) in figures.into_iter().enumerate() {
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
        let caption = if number == 0 { trace.name.as_str() } else { "" };
        html.push_str(&plot.figure(caption));
    }
}
