//! Collects recorded numbers in columns and assigns an entity to each curve of a plot.

use re_sdk::EntityPathPart;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{Scalars, SeriesLines};
use recording::view::{CurveRole, PlotLimit, PlotSeries, RowQuantity, TimePlot};
use recording::{
    AnalysisColumns, Column, Columns, NumberIndex, RecordedVariables, Row, RunHeader, ValueKind,
    VariableDirection,
};

use units::display::{name_with_unit, unit_text};

use super::decimation::{self, Interpolation, ValueRange};
use super::run_slot::RunNamespace;
use super::timeline::{TimePoints, TimelineClock};

/// One curve of a plot, as the layout needs it.
pub(super) struct ChartCurve {
    /// The entity that holds its values.
    pub path: EntityPath,
    /// Its run.
    pub slot: RunNamespace,
    /// Its name in the legend, the same for both runs.
    pub label: String,
    /// Its role.
    pub role: CurveRole,
    /// Whether its values hold until the next sample.
    pub stepped: bool,
    /// Whether it is a side of the band around the line of the same label.
    pub bound: bool,
    /// Of a limit, the label of the curve that it is for.
    pub limit_of: Option<String>,
}

impl ChartCurve {
    /// The label of the curve that it belongs to.
    pub fn owner_label(&self) -> &str {
        self.limit_of.as_deref().unwrap_or(&self.label)
    }
}

/// One plot, as the layout needs it.
pub(super) struct TimeChart {
    /// Its title.
    pub title: String,
    /// Charts of one group are shown together.
    pub group: Option<String>,
    /// The ends of its axis, when they are given.
    pub range: Option<[f64; 2]>,
    /// The lowest and the highest value of its curves and limits, once they are known.
    pub span: Option<[f64; 2]>,
    /// The entity of its legend.
    pub legend: EntityPath,
    /// Its curves.
    pub lines: Vec<ChartCurve>,
}

impl TimeChart {
    /// Makes room for values up to these ends.
    pub fn widen_range(&mut self, ends: Option<[f64; 2]>) {
        let known = [self.span, ends].into_iter().flatten().flatten();
        self.span = ValueRange::default().extended_by(known).low_and_high();
    }
}

/// One scalar entity with its unsent samples.
struct ScalarCurve {
    path: EntityPath,
    quantity: RowQuantity,
    factor: f64,
    offset: f64,
    interpolation: Interpolation,
    samples: Vec<f64>,
    /// The range of all samples so far.
    span: ValueRange,
}

/// Every scalar entity of a recording.
pub(super) struct ScalarSignals {
    curves: Vec<ScalarCurve>,
    /// Names of the curves of columns, which come first.
    names: Vec<String>,
    limits: Vec<LimitLine>,
}

/// A limit in a plot.
struct LimitLine {
    path: EntityPath,
    value: f64,
    /// Its ends [s].
    during: [f64; 2],
}

impl ScalarSignals {
    /// Plans the entities: one under `/signals` for each signal of the view, and one under `/plots` for each curve in another unit.
    pub fn new(header: &RunHeader, slot: &RunNamespace) -> (Self, Vec<TimeChart>) {
        let columns = &header.columns;
        let own = || header.view.signals.iter().map(|&signal| (signal, &columns[signal]));
        let mut curves: Vec<ScalarCurve> = own()
            .map(|(column, it)| {
                let path = slot.entity_path(column_entity_path(it));
                ScalarCurve::new(path, RowQuantity::Column(column), 1.0, 0.0, interpolation_of_kind(it.kind))
            })
            .collect();
        let names = own().map(|(_, it)| slot.run_label(&column_title(it))).collect();
        let mut limits = Vec::new();
        let plots = header.view.plots.iter().enumerate();
        let charts = plots.map(|(number, plot)| {
            let mut chart = plan_chart(number, plot, columns, slot, &mut curves);
            // Of two runs the first one has the limits.
            if slot.is_first() {
                add_limits(&mut chart, number, plot, &header.view.limits, &mut limits);
            }
            chart
        });
        let charts = charts.collect();
        (Self { curves, names, limits }, charts)
    }

    /// Names every column with its unit, for plots made by hand.
    pub fn send_names(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for (curve, name) in self.curves.iter().zip(&self.names) {
            let style = SeriesLines::new().with_names([name.as_str()]);
            stream.log_static(curve.path.clone(), &style)?;
        }
        Ok(())
    }

    /// Takes one row.
    pub fn push_row(&mut self, time: f64, row: &Row<RecordedVariables>) {
        for curve in &mut self.curves {
            let sample = curve.quantity.evaluate(time, row) * curve.factor + curve.offset;
            curve.samples.push(sample);
        }
    }

    /// Sends the collected samples of these time points, without those that no eye would miss, and forgets them.
    pub fn send(&mut self, stream: &RecordingStream, time_points: &TimePoints) -> RecordingStreamResult<()> {
        let times = time_points.times_in_seconds();
        for curve in &mut self.curves {
            curve.span = curve.span.extended_by(curve.samples.iter().copied());
            let indices =
                decimation::swinging_door_indices(&times, &curve.samples, curve.interpolation, curve.span);
            let scalars = Scalars::new(indices.iter().map(|&index| curve.samples[index]));
            let axes = time_points.time_columns_at(&indices);
            curve.samples.clear();
            stream.send_columns(curve.path.clone(), axes, scalars.columns_of_unit_batches()?)?;
        }
        Ok(())
    }

    /// Sends the limits of checks, after the last row.
    pub fn send_limits(&self, stream: &RecordingStream, clock: &TimelineClock) -> RecordingStreamResult<()> {
        self.limits.iter().try_for_each(|limit| {
            let time_points: TimePoints = limit.during.iter().map(|end| clock.time_point_at(*end)).collect();
            let columns = Scalars::new([limit.value; 2]).columns_of_unit_batches()?;
            stream.send_columns(limit.path.clone(), time_points.time_columns(), columns)
        })
    }

    /// The range of the samples of an entity so far.
    pub fn value_range(&self, path: &EntityPath) -> Option<[f64; 2]> {
        let limit = self.limits.iter().find(|limit| limit.path == *path);
        let curve = || self.curves.iter().find(|curve| curve.path == *path)?.span.low_and_high();
        limit.map(|limit| [limit.value; 2]).or_else(curve)
    }
}

/// Sends columns of an analysis, beside the signals of the nodes and thinned like them.
pub(super) fn send_derived_columns(
    stream: &RecordingStream,
    derived: &AnalysisColumns,
    time_points: &TimePoints,
) -> RecordingStreamResult<()> {
    let times = time_points.times_in_seconds();
    for (column, signal) in derived.columns().zip(derived.columns) {
        let path = escaped_entity_path(["signals", derived.analysis, derived.group, signal.name]);
        let name = column_title(&column);
        stream.log_static(path.clone(), &SeriesLines::new().with_names([name.as_str()]))?;
        let span = ValueRange::default().extended_by(signal.values.iter().copied());
        let indices = decimation::swinging_door_indices(&times, signal.values, Interpolation::Linear, span);
        let scalars = Scalars::new(indices.iter().map(|&index| signal.values[index]));
        let axes = time_points.time_columns_at(&indices);
        stream.send_columns(path, axes, scalars.columns_of_unit_batches()?)?;
    }
    Ok(())
}

/// Plots of columns of an analysis, one for each unit.
pub(super) fn derived_charts(derived: &AnalysisColumns) -> Vec<TimeChart> {
    let mut charts: Vec<TimeChart> = Vec::new();
    for signal in derived.columns {
        let title = match unit_text(signal.unit) {
            unit if unit.is_empty() => "-".to_owned(),
            unit => unit,
        };
        let line = ChartCurve {
            path: escaped_entity_path(["signals", derived.analysis, derived.group, signal.name]),
            slot: RunNamespace::default(),
            label: signal.name.to_owned(),
            role: CurveRole::Other,
            stepped: false,
            bound: false,
            limit_of: None,
        };
        let known = charts.iter().position(|chart| chart.title == title);
        let index = known.unwrap_or_else(|| {
            let number = (charts.len() + 1).to_string();
            let legend = escaped_entity_path(["legends", derived.analysis, derived.group, &number]);
            let (title, lines) = (title.clone(), Vec::new());
            charts.push(TimeChart { title, group: None, range: None, span: None, legend, lines });
            charts.len() - 1
        });
        let chart = &mut charts[index];
        chart.widen_range(ValueRange::default().extended_by(signal.values.iter().copied()).low_and_high());
        chart.lines.push(line);
    }
    charts
}

impl ScalarCurve {
    fn new(
        path: EntityPath,
        quantity: RowQuantity,
        factor: f64,
        offset: f64,
        interpolation: Interpolation,
    ) -> Self {
        Self {
            path,
            quantity,
            factor,
            offset,
            interpolation,
            samples: Vec::new(),
            span: ValueRange::default(),
        }
    }
}

/// Makes an entity path of names; separators in a name are escaped, so `std.v_x` stays one part.
pub(super) fn escaped_entity_path<const N: usize>(parts: [&str; N]) -> EntityPath {
    EntityPath::new(parts.into_iter().map(EntityPathPart::from).collect())
}

/// The entity of a column.
pub(super) fn column_entity_path(column: &Column) -> EntityPath {
    let side = match column.direction {
        VariableDirection::Input => "inputs",
        VariableDirection::Output => "outputs",
    };
    escaped_entity_path(["signals", &column.node, side, &column.variable])
}

fn column_title(column: &Column) -> String {
    name_with_unit(&column.qualified_name(), column.unit.as_deref())
}

/// The viewer paints the curves of a plot, and lists them in the legend, in the order of their paths.
/// A measurement is noisy and must lie below the others: its path comes first, if need be as an entity
/// of its own. A band lies between them.
fn plan_chart(
    number: usize,
    plot: &TimePlot,
    columns: &Columns<RecordedVariables>,
    slot: &RunNamespace,
    curves: &mut Vec<ScalarCurve>,
) -> TimeChart {
    let mut series: Vec<&PlotSeries> = plot.series.iter().collect();
    series.sort_by_key(|it| (it.role != CurveRole::Measurement, !it.bound));
    let first_of_others = series
        .iter()
        .enumerate()
        .filter(|(_, it)| it.role != CurveRole::Measurement)
        .map(|(rank, it)| series_entity_path(number, rank, it, columns))
        .min();
    let mut lines = Vec::new();
    for (rank, it) in series.into_iter().enumerate() {
        let natural = series_entity_path(number, rank, it, columns);
        let covered = it.role == CurveRole::Measurement
            && first_of_others.as_ref().is_some_and(|other| *other < natural);
        let path = if covered { plot_path(number, rank) } else { natural };
        let made = path == plot_path(number, rank);
        let path = slot.entity_path(path);
        let interpolation = column_of_series(it)
            .map_or(Interpolation::Linear, |index| interpolation_of_kind(columns[index].kind));
        if made {
            let quantity = it.quantity.clone();
            curves.push(ScalarCurve::new(path.clone(), quantity, it.factor, it.offset, interpolation));
        }
        lines.push(ChartCurve {
            path,
            slot: slot.clone(),
            label: it.label.clone(),
            role: it.role,
            stepped: interpolation == Interpolation::Hold,
            bound: it.bound,
            limit_of: None,
        });
    }
    let (title, group) = (plot.title.clone(), plot.group.clone());
    let legend = escaped_entity_path(["legends", &(number + 1).to_string()]);
    TimeChart { title, group, range: plot.range, span: None, legend, lines }
}

/// Draws the limits of checks in a plot of their signals, below the curves.
fn add_limits(
    chart: &mut TimeChart,
    number: usize,
    plot: &TimePlot,
    known: &[PlotLimit],
    limits: &mut Vec<LimitLine>,
) {
    for series in plot.series.iter().filter(|series| !series.bound) {
        let own = known.iter().filter(|limit| Some(limit.column) == column_of_series(series));
        for limit in own {
            let rank = format!("limit{:03}", limits.len() + 1);
            let path = escaped_entity_path(["plots", &(number + 1).to_string(), &rank]);
            let value = limit.value * series.factor + series.offset;
            limits.push(LimitLine { path: path.clone(), value, during: limit.during });
            chart.lines.push(ChartCurve {
                path,
                slot: RunNamespace::default(),
                label: "limit".to_owned(),
                role: CurveRole::Limit,
                stepped: false,
                bound: false,
                limit_of: Some(series.label.clone()),
            });
        }
    }
}

fn interpolation_of_kind(kind: ValueKind) -> Interpolation {
    match kind {
        ValueKind::Real => Interpolation::Linear,
        _ => Interpolation::Hold,
    }
}

fn series_entity_path(
    number: usize,
    rank: usize,
    series: &PlotSeries,
    columns: &Columns<RecordedVariables>,
) -> EntityPath {
    match column_of_series(series) {
        Some(index) if (series.factor, series.offset) == (1.0, 0.0) => column_entity_path(&columns[index]),
        _ => plot_path(number, rank),
    }
}

fn column_of_series(series: &PlotSeries) -> Option<NumberIndex<RecordedVariables>> {
    match series.quantity {
        RowQuantity::Column(index) => Some(index),
        RowQuantity::Formula(_) => None,
    }
}

fn plot_path(number: usize, rank: usize) -> EntityPath {
    escaped_entity_path(["plots", &(number + 1).to_string(), &(rank + 1).to_string()])
}
