//! Collects recorded numbers in columns and assigns an entity to each curve of a plot.

use re_sdk::EntityPathPart;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{Scalars, SeriesLines};
use recording::view::{Limit, Plot, Quantity, Role, Series};
use recording::{
    Column, Columns, DerivedColumns, Direction, NumberIndex, Recorded, Row, RunHeader, ValueKind,
};

use super::decimation::{self, Interpolation, ValueRange};
use super::run_slot::RunSlot;
use super::timeline::{Clock, TimePoints};

/// One curve of a plot, as the layout needs it.
pub(super) struct ChartLine {
    /// The entity that holds its values.
    pub path: EntityPath,
    /// Its run.
    pub slot: RunSlot,
    /// Its name in the legend, the same for both runs.
    pub label: String,
    /// Its role.
    pub role: Role,
    /// Whether its values hold until the next sample.
    pub stepped: bool,
    /// Whether it is a side of the band around the line of the same label.
    pub bound: bool,
}

/// One plot, as the layout needs it.
pub(super) struct Chart {
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
    pub lines: Vec<ChartLine>,
}

impl Chart {
    /// Makes room for values up to these ends.
    pub fn widen(&mut self, ends: Option<[f64; 2]>) {
        let known = [self.span, ends].into_iter().flatten().flatten();
        self.span = ValueRange::default().with(known).ends();
    }
}

/// One scalar entity with its unsent samples.
struct Curve {
    path: EntityPath,
    quantity: Quantity,
    factor: f64,
    offset: f64,
    interpolation: Interpolation,
    samples: Vec<f64>,
    /// The range of all samples so far.
    span: ValueRange,
}

/// Every scalar entity of a recording.
pub(super) struct Signals {
    curves: Vec<Curve>,
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

impl Signals {
    /// Plans the entities: one per column under `/signals`, and one under `/plots` for each curve in
    /// another unit.
    pub fn new(
        header: &RunHeader,
        slot: &RunSlot,
        lacks: &[NumberIndex<Recorded>],
    ) -> (Self, Vec<Chart>) {
        let columns = &header.columns;
        let own = || columns.numbers().filter(|(column, _)| !lacks.contains(column));
        let mut curves: Vec<Curve> = own()
            .map(|(column, it)| {
                let path = slot.path(signal_path(it));
                Curve::new(path, Quantity::Column(column), 1.0, 0.0, interpolation(it.kind))
            })
            .collect();
        let names = own().map(|(_, it)| slot.label(&name_with_unit(it))).collect();
        let mut limits = Vec::new();
        let plots = header.view.plots.iter().enumerate();
        let charts = plots.map(|(number, plot)| {
            let mut chart = chart(number, plot, columns, slot, &mut curves);
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
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        for (curve, name) in self.curves.iter().zip(&self.names) {
            let style = SeriesLines::new().with_names([name.as_str()]);
            stream.log_static(curve.path.clone(), &style)?;
        }
        Ok(())
    }

    /// Takes one row.
    pub fn push(&mut self, time: f64, row: &Row<Recorded>) {
        for curve in &mut self.curves {
            let sample = curve.quantity.value(time, row) * curve.factor + curve.offset;
            curve.samples.push(sample);
        }
    }

    /// Sends the collected samples of these time points, without those that no eye would miss, and forgets them.
    pub fn send(
        &mut self,
        stream: &RecordingStream,
        time_points: &TimePoints,
    ) -> RecordingStreamResult<()> {
        let times = time_points.seconds();
        for curve in &mut self.curves {
            curve.span = curve.span.with(curve.samples.iter().copied());
            let indices = decimation::retained_indices(
                &times,
                &curve.samples,
                curve.interpolation,
                curve.span,
            );
            let scalars = Scalars::new(indices.iter().map(|&index| curve.samples[index]));
            let axes = time_points.axes_of(&indices);
            curve.samples.clear();
            stream.send_columns(curve.path.clone(), axes, scalars.columns_of_unit_batches()?)?;
        }
        Ok(())
    }

    /// Sends the limits of checks, after the last row.
    pub fn send_limits(
        &self,
        stream: &RecordingStream,
        clock: &Clock,
    ) -> RecordingStreamResult<()> {
        self.limits.iter().try_for_each(|limit| {
            let time_points: TimePoints = limit.during.iter().map(|end| clock.at(*end)).collect();
            let columns = Scalars::new([limit.value; 2]).columns_of_unit_batches()?;
            stream.send_columns(limit.path.clone(), time_points.axes(), columns)
        })
    }

    /// The range of the samples of an entity so far.
    pub fn span(&self, path: &EntityPath) -> Option<[f64; 2]> {
        let limit = self.limits.iter().find(|limit| limit.path == *path);
        let curve = || self.curves.iter().find(|curve| curve.path == *path)?.span.ends();
        limit.map(|limit| [limit.value; 2]).or_else(curve)
    }
}

/// Sends columns of an analysis, beside the signals of the nodes and thinned like them.
pub(super) fn add(
    stream: &RecordingStream,
    derived: &DerivedColumns,
    time_points: &TimePoints,
) -> RecordingStreamResult<()> {
    let times = time_points.seconds();
    for (column, signal) in derived.columns().zip(derived.columns) {
        let path = entity(["signals", derived.analysis, derived.group, signal.name]);
        let name = name_with_unit(&column);
        stream.log_static(path.clone(), &SeriesLines::new().with_names([name.as_str()]))?;
        let span = ValueRange::default().with(signal.values.iter().copied());
        let indices =
            decimation::retained_indices(&times, signal.values, Interpolation::Linear, span);
        let scalars = Scalars::new(indices.iter().map(|&index| signal.values[index]));
        let axes = time_points.axes_of(&indices);
        stream.send_columns(path, axes, scalars.columns_of_unit_batches()?)?;
    }
    Ok(())
}

/// Plots of columns of an analysis, one for each unit.
pub(super) fn derived_charts(derived: &DerivedColumns) -> Vec<Chart> {
    let mut charts: Vec<Chart> = Vec::new();
    for signal in derived.columns {
        let title = if signal.unit.is_empty() { "-" } else { signal.unit };
        let line = ChartLine {
            path: entity(["signals", derived.analysis, derived.group, signal.name]),
            slot: RunSlot::default(),
            label: signal.name.to_owned(),
            role: Role::Other,
            stepped: false,
            bound: false,
        };
        let known = charts.iter().position(|chart| chart.title == title);
        let index = known.unwrap_or_else(|| {
            let number = (charts.len() + 1).to_string();
            let legend = entity(["legends", derived.analysis, derived.group, &number]);
            let (title, lines) = (title.to_owned(), Vec::new());
            charts.push(Chart { title, group: None, range: None, span: None, legend, lines });
            charts.len() - 1
        });
        let chart = &mut charts[index];
        chart.widen(ValueRange::default().with(signal.values.iter().copied()).ends());
        chart.lines.push(line);
    }
    charts
}

impl Curve {
    fn new(
        path: EntityPath,
        quantity: Quantity,
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
pub(super) fn entity<const N: usize>(parts: [&str; N]) -> EntityPath {
    EntityPath::new(parts.into_iter().map(EntityPathPart::from).collect())
}

/// The entity of a column.
pub(super) fn signal_path(column: &Column) -> EntityPath {
    let side = match column.direction {
        Direction::Input => "inputs",
        Direction::Output => "outputs",
    };
    entity(["signals", &column.node, side, &column.variable])
}

fn name_with_unit(column: &Column) -> String {
    match &column.unit {
        Some(unit) => format!("{} [{unit}]", column.name()),
        None => column.name(),
    }
}

/// The viewer paints the curves of a plot, and lists them in the legend, in the order of their paths.
/// A measurement is noisy and must lie below the others: its path comes first, if need be as an entity
/// of its own. A band lies between them.
fn chart(
    number: usize,
    plot: &Plot,
    columns: &Columns<Recorded>,
    slot: &RunSlot,
    curves: &mut Vec<Curve>,
) -> Chart {
    let mut series: Vec<&Series> = plot.series.iter().collect();
    series.sort_by_key(|it| (it.role != Role::Measurement, !it.bound));
    let first_of_others = series
        .iter()
        .enumerate()
        .filter(|(_, it)| it.role != Role::Measurement)
        .map(|(rank, it)| natural_path(number, rank, it, columns))
        .min();
    let mut lines = Vec::new();
    for (rank, it) in series.into_iter().enumerate() {
        let natural = natural_path(number, rank, it, columns);
        let covered = it.role == Role::Measurement
            && first_of_others.as_ref().is_some_and(|other| *other < natural);
        let path = if covered { plot_path(number, rank) } else { natural };
        let made = path == plot_path(number, rank);
        let path = slot.path(path);
        let interpolation =
            column(it).map_or(Interpolation::Linear, |index| interpolation(columns[index].kind));
        if made {
            let quantity = it.quantity.clone();
            curves.push(Curve::new(path.clone(), quantity, it.factor, it.offset, interpolation));
        }
        lines.push(ChartLine {
            path,
            slot: slot.clone(),
            label: it.label.clone(),
            role: it.role,
            stepped: interpolation == Interpolation::Hold,
            bound: it.bound,
        });
    }
    let (title, group) = (plot.title.clone(), plot.group.clone());
    let legend = entity(["legends", &(number + 1).to_string()]);
    Chart { title, group, range: plot.range, span: None, legend, lines }
}

/// Draws the limits of checks in a plot of their signals, below the curves.
fn add_limits(
    chart: &mut Chart,
    number: usize,
    plot: &Plot,
    known: &[Limit],
    limits: &mut Vec<LimitLine>,
) {
    for series in plot.series.iter().filter(|series| !series.bound) {
        let own = known.iter().filter(|limit| Some(limit.column) == column(series));
        for limit in own {
            let rank = format!("limit{:03}", limits.len() + 1);
            let path = entity(["plots", &(number + 1).to_string(), &rank]);
            let value = limit.value * series.factor + series.offset;
            limits.push(LimitLine { path: path.clone(), value, during: limit.during });
            chart.lines.push(ChartLine {
                path,
                slot: RunSlot::default(),
                label: "limit".to_owned(),
                role: Role::Limit,
                stepped: false,
                bound: false,
            });
        }
    }
}

fn interpolation(kind: ValueKind) -> Interpolation {
    match kind {
        ValueKind::Real => Interpolation::Linear,
        _ => Interpolation::Hold,
    }
}

fn natural_path(
    number: usize,
    rank: usize,
    series: &Series,
    columns: &Columns<Recorded>,
) -> EntityPath {
    match column(series) {
        Some(index) if (series.factor, series.offset) == (1.0, 0.0) => signal_path(&columns[index]),
        _ => plot_path(number, rank),
    }
}

fn column(series: &Series) -> Option<NumberIndex<Recorded>> {
    match series.quantity {
        Quantity::Column(index) => Some(index),
        Quantity::Formula(_) => None,
    }
}

fn plot_path(number: usize, rank: usize) -> EntityPath {
    entity(["plots", &(number + 1).to_string(), &(rank + 1).to_string()])
}
