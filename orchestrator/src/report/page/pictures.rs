//! Draws what checks compare over time.

use assessment::check::CheckVerdict;
use expression::{TraceContent, TracePoint, comparison_sides, reduced_quantity};
use html_page::{Markup, Plot, PlotAxis};
use units::display::{name_with_unit, shorten_end};

/// Sizes of pictures [px]: of failed checks, and of passed ones.
pub const WIDE: [f64; 2] = [1080.0, 280.0];
pub const SMALL: [f64; 2] = [350.0, 190.0];
/// What a letter of an upright label takes of the height [px].
const LETTER_HEIGHT: f64 = 10.0;

/// What a check compares over time, and its expression.
pub struct CheckPlot<'a> {
    /// The place of the check among all.
    pub place: usize,
    pub plot: Markup,
    pub that: &'a str,
}

/// What a check compares over its window, if that is more than a moment.
pub fn check_plot(place: usize, check: &CheckVerdict, size: [f64; 2]) -> Option<CheckPlot<'_>> {
    let points = check.trace.points();
    let seen = points.iter().filter(|point| point.value.iter().all(|it| it.is_finite()));
    if seen.count() < 2 {
        return None;
    }
    let [from, to] = check.during;
    let limits = points.iter().flat_map(|point| point.limit);
    let [label, limit] = trace_names(check);
    let room = (size[1] / LETTER_HEIGHT) as usize;
    let title = name_with_unit(&shorten_end(label, room), check.unit.as_deref());
    let y = PlotAxis::around_values(&title, points.iter().flat_map(|point| point.value).chain(limits));
    let mut plot = Plot::new(size, PlotAxis::linear("time [s]", from, to), y);
    plot.add_line(&min_max_line(points, |point| point.value), "c0", label);
    if points.iter().any(|point| point.limit[0].is_finite()) {
        plot.add_dashed_line(&min_max_line(points, |point| point.limit), "limit", limit);
    }
    if let Some(first) = check.first {
        plot.add_vertical_line(first, "poor", "first deviation");
    }
    if let (Some(at), Some(value)) = (check.at, worst_trace_value(check)) {
        let class = if check.passed { "c1" } else { "poor" };
        plot.add_dots(&[(at, value)], 4.5, class, "worst");
    }
    Some(CheckPlot { place, plot: plot.figure_with_legend(&check.name), that: &check.that })
}

/// What a check's trace and its limit are called.
pub fn trace_names(check: &CheckVerdict) -> [&str; 2] {
    match check.trace.content() {
        TraceContent::Sides => [comparison_sides(&check.that).map_or("value", |[left, _]| left), "limit"],
        TraceContent::Reduced => [reduced_quantity(&check.that).unwrap_or("quantity"), "limit"],
        TraceContent::Margins => ["margin", "violated below"],
    }
}

/// The worst value of what the trace shows.
pub fn worst_trace_value(check: &CheckVerdict) -> Option<f64> {
    match check.trace.content() {
        TraceContent::Sides | TraceContent::Reduced => check.value,
        TraceContent::Margins => check.margin,
    }
}

/// The line through the lowest and the highest value of each point.
fn min_max_line(points: &[TracePoint], of: fn(&TracePoint) -> [f64; 2]) -> Vec<(f64, f64)> {
    let mut line = Vec::with_capacity(2 * points.len());
    for point in points {
        let [low, high] = of(point);
        line.push((point.time, low));
        if low != high {
            line.push((point.time, high));
        }
    }
    line
}
