//! Plots signals and checks of two runs over each other.

use expression::{ComparisonTrace, TraceContent, TracePoint, comparison_sides, reduced_quantity};
use html_page::{Plot, PlotAxis};
use recording::overview::Envelopes;
use units::display::{name_with_unit, shorten_end};

use crate::check_comparison::CheckComparison;
use crate::check_evaluation::evaluate_check;
use crate::trajectory::{SignalDeviation, Trajectory, unit_conversion};

/// Sizes of plots [px]: of a check or a signal, and of a difference.
const SIZE: [f64; 2] = [540.0, 250.0];
const LOW: [f64; 2] = [540.0, 180.0];
/// What a letter of an upright label takes of the height [px].
const LETTER_HEIGHT: f64 = 10.0;
/// Signals that are plotted.
const MOST_SIGNALS: usize = 4;
/// Checks that are plotted.
const MOST_CHECKS: usize = 12;
/// Points of a line at most, two for each bucket.
const MOST_BUCKETS: usize = 400;
/// The plots go on until a signal has reached this share of its largest difference.
const SHARE_OF_LARGEST: f64 = 0.5;
/// Time before the first difference and behind the last one that is to be seen, relative to what is between [-].
const LEAD: f64 = 0.2;
/// The plots show so many communication steps at least.
const LEAST_STEPS: f64 = 40.0;

/// A title and its plot.
pub(crate) type TitledPlot = (String, Plot);

/// A signal of both runs at the communication points that both have.
struct SignalPair<'d> {
    deviation: &'d SignalDeviation,
    /// Time [s], the value of A, and that of B in the unit of A.
    points: Vec<(f64, f64, f64)>,
}

/// A signal in both runs, and below it B without A.
#[derive(Debug, Clone)]
pub(crate) struct SignalPlots {
    pub name: String,
    pub both: Plot,
    pub difference: Plot,
}

/// The first signals that differ: each in both runs, and B without A. All have one time axis, from shortly before the first
/// difference until one of the differences has grown.
pub(crate) fn plot_first_deviations(runs: [&Trajectory; 2], spread: &[SignalDeviation]) -> Vec<SignalPlots> {
    let numbers = spread.iter().filter(|it| !it.a.is_nan() || !it.b.is_nan());
    let pairs: Vec<_> = numbers.filter_map(|it| SignalPair::new(it, runs)).take(MOST_SIGNALS).collect();
    let Some(span) = time_span_of(&pairs, runs[0]) else { return Vec::new() };
    pairs.iter().map(|pair| pair.plots(span)).collect()
}

impl<'d> SignalPair<'d> {
    fn new(deviation: &'d SignalDeviation, [a, b]: [&Trajectory; 2]) -> Option<Self> {
        let signal = &deviation.signal;
        let in_b = b.columns.iter().find(|it| {
            (&it.node, &it.variable, it.input) == (&signal.node, &signal.variable, signal.input)
        })?;
        let (factor, offset) = unit_conversion(in_b, signal)?;
        let (of_a, of_b) = (a.column_values(signal)?, b.column_values(in_b)?);
        let point = |row: usize| {
            let time = a.times[row];
            Some((time, of_a[row], of_b[b.find_time(time)?] * factor + offset))
        };
        Some(SignalPair { deviation, points: (0..a.times.len()).filter_map(point).collect() })
    }

    /// When the difference has grown to a share of its largest value [s].
    fn grown_at(&self) -> f64 {
        let enough = SHARE_OF_LARGEST * self.deviation.largest;
        let grown = self.points.iter().find(|(_, a, b)| (a - b).abs() >= enough);
        grown.map_or(self.deviation.time, |(time, ..)| *time)
    }

    fn plots(&self, [from, to]: [f64; 2]) -> SignalPlots {
        let seen: Vec<_> =
            self.points.iter().copied().filter(|(time, ..)| (from..=to).contains(time)).collect();
        let signal = &self.deviation.signal;
        let side = if signal.input { " (input)" } else { "" };
        let [a, b, apart] = [
            thinned_line(&seen, |(_, a, _)| a),
            thinned_line(&seen, |(_, _, b)| b),
            thinned_line(&seen, |(_, a, b)| b - a),
        ];
        let unit = signal.unit.as_deref();
        let values = a.iter().chain(&b).map(|point| point.1);
        let mut both = empty_plot(SIZE, [from, to], &signal.variable, unit, values);
        both.add_line(&a, "c0", "A");
        both.add_line(&b, "c1", "B");
        let mut difference = empty_plot(LOW, [from, to], "B − A", unit, apart.iter().map(|point| point.1));
        difference.add_line(&apart, "c2", "");
        for plot in [&mut both, &mut difference] {
            plot.add_vertical_line(self.deviation.time, "data", "first difference");
        }
        SignalPlots { name: format!("{}{side}", signal.qualified_name()), both, difference }
    }
}

/// A span of time [s] that begins before the first difference and ends when one of them has grown; none without signals.
fn time_span_of(pairs: &[SignalPair], run: &Trajectory) -> Option<[f64; 2]> {
    let first = pairs.iter().map(|it| it.deviation.time).min_by(f64::total_cmp)?;
    let grown = pairs.iter().map(SignalPair::grown_at).min_by(f64::total_cmp)?;
    let [begin, end] = [*run.times.first()?, *run.times.last()?];
    let step = (end - begin) / (run.times.len() - 1).max(1) as f64;
    let shown = (grown - first).max(LEAST_STEPS * step);
    Some([(first - LEAD * shown).max(begin), (first + (1.0 + LEAD) * shown).min(end)])
}

/// A line through the extremes of the points, in the order of their time.
fn thinned_line(points: &[(f64, f64, f64)], value: fn((f64, f64, f64)) -> f64) -> Vec<(f64, f64)> {
    let mut envelope = Envelopes::new(1, MOST_BUCKETS);
    points.iter().for_each(|point| envelope.push(std::iter::once(value(*point))));
    let stride = envelope.stride();
    let line = envelope.extremes(0).enumerate().flat_map(|(bucket, [first, second])| {
        let at = |place: usize| points[place.min(points.len() - 1)].0;
        let [begin, middle] = [at(bucket * stride), at(bucket * stride + stride / 2)];
        [(begin, first), (middle, second)].into_iter().take(stride.min(2))
    });
    line.collect()
}

/// An empty plot over time, its upward axis about the values.
fn empty_plot(
    size: [f64; 2],
    [from, to]: [f64; 2],
    label: &str,
    unit: Option<&str>,
    values: impl IntoIterator<Item = f64>,
) -> Plot {
    let room = (size[1] / LETTER_HEIGHT) as usize;
    let title = name_with_unit(&shorten_end(label, room), unit);
    Plot::new(size, PlotAxis::linear("time [s]", from, to), PlotAxis::around_values(&title, values))
}

/// What the checks compare whose verdicts differ, in both runs with their limits, each over its window.
pub(crate) fn plot_flipped_checks(
    [a, b]: [&Trajectory; 2],
    checks: &[CheckComparison],
    first_difference: Option<f64>,
) -> Vec<TitledPlot> {
    let flipped = checks.iter().filter(|it| it.flipped_by.is_some());
    let plot = |check: &CheckComparison| {
        let traces =
            [evaluate_check(check.a.as_ref()?, a)?.trace, evaluate_check(check.b.as_ref()?, b)?.trace];
        let plot = plot_check(check, &traces, first_difference)?;
        Some((check.name.clone(), plot))
    };
    flipped.filter_map(plot).take(MOST_CHECKS).collect()
}

fn plot_check(
    check: &CheckComparison,
    traces: &[ComparisonTrace; 2],
    first_difference: Option<f64>,
) -> Option<Plot> {
    let [of_a, of_b] = traces.each_ref().map(ComparisonTrace::points);
    if of_a.len() < 2 || of_b.len() < 2 {
        return None;
    }
    let [during_a, during_b] = [check.a.as_ref()?.during, check.b.as_ref()?.during];
    let span = [during_a[0].min(during_b[0]), during_a[1].max(during_b[1])];
    let that = &check.a.as_ref()?.that;
    let (label, unit) = match traces[0].content() {
        TraceContent::Sides => (comparison_sides(that).map_or("value", |[left, _]| left), check.unit()),
        TraceContent::Reduced => (reduced_quantity(that).unwrap_or("quantity"), check.unit()),
        TraceContent::Margins => ("margin", None),
    };
    let all = of_a.iter().chain(of_b);
    let mut plot =
        empty_plot(SIZE, span, label, unit, all.flat_map(|it| it.value.into_iter().chain(it.limit)));
    let [limit_a, limit_b] = [of_a, of_b].map(|points| extreme_line(points, |it| it.limit));
    plot.add_line(&extreme_line(of_a, |it| it.value), "c0", "A");
    plot.add_line(&extreme_line(of_b, |it| it.value), "c1", "B");
    let has_limit = |points: &[TracePoint]| points.iter().any(|it| it.limit[0].is_finite());
    match limit_a == limit_b || check.limits()[0] == check.limits()[1] {
        true if has_limit(of_a) => plot.add_dashed_line(&limit_a, "truth", "limit"),
        true => {}
        false => {
            plot.add_dashed_line(&limit_a, "c0", "limit of A");
            plot.add_dashed_line(&limit_b, "c1", "limit of B");
        }
    }
    if let Some(first) = first_difference.filter(|it| (span[0]..=span[1]).contains(it)) {
        plot.add_vertical_line(first, "data", "first difference");
    }
    Some(plot)
}

/// The line through the lowest and the highest value of each point.
fn extreme_line(points: &[TracePoint], of: fn(&TracePoint) -> [f64; 2]) -> Vec<(f64, f64)> {
    let both = points.iter().flat_map(|point| of(point).map(|value| (point.time, value)));
    let mut line: Vec<_> = both.collect();
    line.dedup();
    line
}
