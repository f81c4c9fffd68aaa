//! Describes the layout of a replay by typed indices: the `[view]` of a scenario without names.

use expression::Expression;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use units::display::label_unit;

use crate::row::{RecordedVariables, Row};
use expression::{ColumnIndex, NumberIndex, ReadableRow, TextIndex};

/// The layout of a replay.
#[derive(Debug, Clone, Default)]
pub struct ReplayView {
    /// The moving body, when the scenario names one.
    pub pose: Option<PoseColumns>,
    /// The source of the distance; without it the replay has no such timeline.
    pub distance: Option<DistanceSource>,
    /// The edges of the road.
    pub track: Option<TrackEdges>,
    /// Arrows that the body carries.
    pub arrows: Vec<BodyArrow>,
    /// Diagrams of one quantity over another.
    pub xy_plots: Vec<XyPlot>,
    /// The time plots, from top to bottom.
    pub plots: Vec<TimePlot>,
    /// The signals that have curves of their own, also outside of plots, in the order of the row.
    pub signals: Vec<NumberIndex<RecordedVariables>>,
    /// Limits of checks, to be drawn in the plots of their signals.
    pub limits: Vec<PlotLimit>,
    /// The nodes and their connections, in a run with several nodes.
    pub graph: NodeGraph,
}

/// The nodes of a run and the connections between them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NodeGraph {
    /// The nodes in the order in which they step.
    pub nodes: Vec<GraphNode>,
    /// From the node that gives a value to the one that takes it, by their places, each pair once.
    pub edges: Vec<(usize, usize)>,
}

/// A node of a graph.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GraphNode {
    /// Its name.
    pub name: String,
    /// Whether it gets values from what it gives.
    pub is_looped: bool,
}

/// A constant that a check compares a signal with.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotLimit {
    /// The signal.
    pub column: NumberIndex<RecordedVariables>,
    /// The constant, in the unit of the signal.
    pub value: f64,
    /// First and last moment of the check [s].
    pub during: [f64; 2],
}

/// A number that each row gives.
#[derive(Debug, Clone)]
pub enum RowQuantity {
    /// The number in this column.
    Column(NumberIndex<RecordedVariables>),
    /// A formula over the row; NaN where it has no value.
    Formula(Expression<RecordedVariables>),
}

impl RowQuantity {
    /// The columns that it depends on.
    fn number_indices(&self) -> Vec<NumberIndex<RecordedVariables>> {
        match self {
            RowQuantity::Column(column) => vec![*column],
            RowQuantity::Formula(formula) => formula.number_indices(),
        }
    }

    /// Whether it is this column as it is.
    #[must_use]
    pub fn is_column(&self, column: NumberIndex<RecordedVariables>) -> bool {
        matches!(self, RowQuantity::Column(own) if *own == column)
    }

    /// Its value in the row at `time` [s].
    #[must_use]
    pub fn evaluate(&self, time: f64, row: &Row<RecordedVariables>) -> f64 {
        match self {
            RowQuantity::Column(column) => row[*column],
            RowQuantity::Formula(formula) => formula.evaluate(time, row),
        }
    }
}

impl ReplayView {
    /// The columns that poses, arrows, diagrams and plots show, some of them repeatedly.
    #[must_use]
    pub fn shown_columns(&self) -> Vec<NumberIndex<RecordedVariables>> {
        let pose = self.pose.iter().flat_map(PoseColumns::columns);
        let arrows = self.arrows.iter().flat_map(|it| it.vector.iter().chain([&it.turn]).flatten());
        let points = self.xy_plots.iter().flat_map(|it| &it.points).flat_map(|it| &it.coordinates);
        let series = self.plots.iter().flat_map(|it| &it.series).map(|it| &it.quantity);
        let quantities = arrows.chain(points).chain(series).flat_map(RowQuantity::number_indices);
        pose.chain(quantities).collect()
    }

    /// Adds signals with curves of their own; each is there once, in the order of the row.
    pub fn add_signals(&mut self, signals: impl IntoIterator<Item = NumberIndex<RecordedVariables>>) {
        self.signals.extend(signals);
        self.signals.sort_unstable_by_key(|it| it.position());
        self.signals.dedup();
    }

    /// The layout for a run without these columns; plots stay, if need be without a curve.
    #[must_use]
    pub fn without_columns(&self, lacks: &[NumberIndex<RecordedVariables>]) -> ReplayView {
        let has = |quantity: &RowQuantity| match quantity {
            RowQuantity::Column(column) => !lacks.contains(column),
            RowQuantity::Formula(formula) => !formula.number_indices().iter().any(|it| lacks.contains(it)),
        };
        let mut view = self.clone();
        let whole = |it: &PoseColumns| !it.columns().any(|column| lacks.contains(&column));
        view.pose = view.pose.filter(whole);
        view.signals.retain(|column| !lacks.contains(column));
        view.distance = view.distance.filter(|it| match it {
            DistanceSource::Given(quantity) | DistanceSource::Driven(quantity) => has(quantity),
            DistanceSource::Along(position) => !position.iter().any(|column| lacks.contains(column)),
        });
        view.arrows.retain(|it| it.vector.iter().chain([&it.turn]).flatten().all(has));
        for plot in &mut view.xy_plots {
            plot.points.retain(|it| it.coordinates.iter().all(has));
        }
        for plot in &mut view.plots {
            plot.series.retain(|it| has(&it.quantity));
        }
        view
    }
}

/// The pose of the moving body; `x` to `speed` are numbers of the row.
#[derive(Debug, Clone)]
pub struct PoseColumns {
    /// Position east [m].
    pub x: NumberIndex<RecordedVariables>,
    /// Position north [m].
    pub y: NumberIndex<RecordedVariables>,
    /// Heading [rad], counter-clockwise from x.
    pub heading: NumberIndex<RecordedVariables>,
    /// Road-wheel angle of the steered wheels [rad].
    pub steer: Option<NumberIndex<RecordedVariables>>,
    /// Speed [m/s], which colours the driven line.
    pub speed: Option<NumberIndex<RecordedVariables>>,
    /// Length of the drawn box [m].
    pub length: f64,
    /// Width of the drawn box [m].
    pub width: f64,
    /// How far the front and the rear axle are ahead of the position [m].
    pub axles: [f64; 2],
}

impl PoseColumns {
    fn columns(&self) -> impl Iterator<Item = NumberIndex<RecordedVariables>> + use<> {
        [Some(self.x), Some(self.y), Some(self.heading), self.steer, self.speed].into_iter().flatten()
    }
}

/// The source of the distance [m].
#[derive(Debug, Clone)]
pub enum DistanceSource {
    /// The distance itself.
    Given(RowQuantity),
    /// The length of the line through these points [m].
    Along([NumberIndex<RecordedVariables>; 2]),
    /// The integral of this speed [m/s].
    Driven(RowQuantity),
}

/// The edges of the road [m].
#[derive(Debug, Clone)]
pub enum TrackEdges {
    /// Known from the start: the left and the right edge.
    Edges([Vec<[f64; 2]>; 2]),
    /// Points of the left and the right edge from each row.
    Sides([[RowQuantity; 2]; 2]),
    /// A point of the centre line from each row, and how far the edges are to its left and right.
    Center([RowQuantity; 2], [f64; 2]),
}

/// The left and the right edge of a road with this centre line; `widths` are from there to both [m]. Points that
/// follow another one at less than 1 mm are left out, as they tell no direction.
#[must_use]
pub fn road_edges(center: &[[f64; 2]], widths: &[[f64; 2]]) -> [Vec<[f64; 2]>; 2] {
    let mut kept: Vec<usize> = Vec::new();
    for (index, point) in center.iter().enumerate() {
        let far = |&last: &usize| (point[0] - center[last][0]).hypot(point[1] - center[last][1]) >= 1e-3;
        if kept.last().is_none_or(far) {
            kept.push(index);
        }
    }
    let mut edges = [Vec::new(), Vec::new()];
    for (rank, &index) in kept.iter().enumerate() {
        let neighbour = |rank: usize| center[kept[rank.min(kept.len() - 1)]];
        let (before, after) = (neighbour(rank.saturating_sub(1)), neighbour(rank + 1));
        let (dx, dy) = (after[0] - before[0], after[1] - before[1]);
        let length = dx.hypot(dy);
        if length == 0.0 {
            continue;
        }
        let (left_x, left_y) = (-dy / length, dx / length);
        for (edge, side) in edges.iter_mut().zip([widths[index][0], -widths[index][1]]) {
            edge.push([center[index][0] + side * left_x, center[index][1] + side * left_y]);
        }
    }
    edges
}

/// An arrow on the body.
#[derive(Debug, Clone)]
pub struct BodyArrow {
    /// Its name.
    pub label: String,
    /// Its role.
    pub role: CurveRole,
    /// Its origin in the frame of the body [m].
    pub at: [f64; 3],
    /// Its components ahead and to the left, 0 where there is none.
    pub vector: [Option<RowQuantity>; 2],
    /// The angle by which the frame of these components is turned to the left against the body [rad].
    pub turn: Option<RowQuantity>,
    /// Its length [m] for a vector of length 1.
    pub scale: f64,
}

/// A diagram of one quantity over another.
#[derive(Debug, Clone)]
pub struct XyPlot {
    /// Its title.
    pub title: String,
    /// The labels of the axes, x and y, with units as they are written.
    pub labels: [String; 2],
    /// The ends of the axes, x and y; the first one is at the left or at the bottom.
    pub ranges: [[f64; 2]; 2],
    /// Half axes of an ellipse around the origin, such as a limit.
    pub ellipse: Option<[f64; 2]>,
    /// Duration of the trail of a point [s].
    pub trail: f64,
    /// Moving points.
    pub points: Vec<XyPlotPoint>,
    /// Curves y(x).
    pub curves: Vec<XyPlotFunction>,
}

/// One scale would leave little of a diagram whose axes differ more than so many times in length.
const MOST_ELONGATION: f64 = 8.0;

impl XyPlot {
    /// Whether a unit is as long on both axes: around an ellipse, and where both axes state the same unit.
    #[must_use]
    pub fn has_equal_scales(&self) -> bool {
        let [across, up] = self.ranges.map(|[from, to]| (to - from).abs());
        let [x_unit, y_unit] =
            self.labels.each_ref().map(|label| label_unit(label).map(units::display::unit_text));
        let is_same_quantity = x_unit.is_some() && x_unit == y_unit;
        let elongation = (across / up).max(up / across);
        self.ellipse.is_some() || (is_same_quantity && elongation < MOST_ELONGATION)
    }
}

/// A moving point of a diagram.
#[derive(Debug, Clone)]
pub struct XyPlotPoint {
    /// Its name.
    pub label: String,
    /// Its role.
    pub role: CurveRole,
    /// Its coordinates.
    pub coordinates: [RowQuantity; 2],
}

/// A curve of a diagram.
#[derive(Debug, Clone)]
pub struct XyPlotFunction {
    /// Its name.
    pub label: String,
    /// Its role.
    pub role: CurveRole,
    /// Its y.
    pub y: Expression<RecordedVariablesAndX>,
    /// Whether it depends on more than x.
    pub moves: bool,
}

impl XyPlotFunction {
    /// Its y at `x`, in the row at `time` [s].
    #[must_use]
    pub fn evaluate_at(&self, time: f64, row: &Row<RecordedVariables>, x: f64) -> f64 {
        self.y.evaluate(time, &RowWithX { row, x })
    }
}

/// Marks recorded rows with one more number: the x of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedVariablesAndX;

impl RecordedVariablesAndX {
    /// The index of x, which comes before the numbers of the row.
    pub const X: NumberIndex<RecordedVariablesAndX> = NumberIndex::new(0);

    /// The index of a column of the row.
    #[must_use]
    pub const fn from_recorded_index(
        index: ColumnIndex<RecordedVariables>,
    ) -> ColumnIndex<RecordedVariablesAndX> {
        match index {
            ColumnIndex::Number(it) => ColumnIndex::Number(NumberIndex::new(it.position() + 1)),
            ColumnIndex::Text(it) => ColumnIndex::Text(TextIndex::new(it.position())),
        }
    }
}

struct RowWithX<'a> {
    row: &'a Row<RecordedVariables>,
    x: f64,
}

impl ReadableRow<RecordedVariablesAndX> for RowWithX<'_> {
    #[inline]
    fn number_at(&self, index: NumberIndex<RecordedVariablesAndX>) -> Option<f64> {
        match index.position().checked_sub(1) {
            Some(position) => self.row.number_at(NumberIndex::new(position)),
            None => Some(self.x),
        }
    }

    #[inline]
    fn text_at(&self, index: TextIndex<RecordedVariablesAndX>) -> Option<&str> {
        self.row.text_at(TextIndex::new(index.position()))
    }
}

/// One time plot.
#[derive(Debug, Clone)]
pub struct TimePlot {
    /// Its title, with the unit in brackets.
    pub title: String,
    /// Plots of one group are shown together, apart from other groups.
    pub group: Option<String>,
    /// The lower and the upper end of its axis, when they are given.
    pub range: Option<[f64; 2]>,
    /// Its curves.
    pub series: Vec<PlotSeries>,
}

/// One curve of a plot.
#[derive(Debug, Clone)]
pub struct PlotSeries {
    /// Its values.
    pub quantity: RowQuantity,
    /// Factor to the plot's unit.
    pub factor: f64,
    /// Offset after the factor.
    pub offset: f64,
    /// Its name in the legend.
    pub label: String,
    /// Its role, which decides its colour.
    pub role: CurveRole,
    /// Whether it is a side of the band around the curve of the same label.
    pub bound: bool,
}

/// Meaning of a curve; one role has one colour in every view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CurveRole {
    /// No meaning: a colour by position.
    #[default]
    Other,
    /// A set point.
    Reference,
    /// The truth.
    Plant,
    /// A measured value.
    Measurement,
    /// An estimated value.
    Estimate,
    /// A disturbance, a limit or a fault.
    Limit,
}

#[cfg(test)]
mod tests {
    use expression::{Expression, SignalOperand};

    use super::{
        ColumnIndex, CurveRole, NumberIndex, RecordedVariablesAndX, Row, TextIndex, XyPlot, XyPlotFunction,
        road_edges,
    };

    #[test]
    fn a_curve_depends_on_x_and_on_the_row() {
        let y = Expression::parse("x + 10 * car.b * (car.state == 'on')", &mut |name| {
            let operand = match name {
                "x" => SignalOperand::Number(RecordedVariablesAndX::X),
                "car.b" => {
                    RecordedVariablesAndX::from_recorded_index(ColumnIndex::Number(NumberIndex::new(1)))
                        .into()
                }
                _ => RecordedVariablesAndX::from_recorded_index(ColumnIndex::Text(TextIndex::new(0))).into(),
            };
            Some(operand.into())
        });
        let (label, role) = (String::new(), CurveRole::Other);
        let curve = XyPlotFunction { label, role, y: y.expect("a formula"), moves: true };
        let row = Row::from_values(vec![5.0, 7.0], vec!["on".to_owned()]);
        assert_eq!([1.0, 2.0].map(|x| curve.evaluate_at(0.0, &row, x)), [71.0, 72.0]);
        assert!(curve.evaluate_at(0.0, &Row::default(), 1.0).is_nan());
    }

    #[test]
    fn axes_of_one_unit_have_one_scale() {
        let plot = |labels: [&str; 2], ranges, ellipse| XyPlot {
            title: String::new(),
            labels: labels.map(str::to_owned),
            ranges,
            ellipse,
            trail: 0.0,
            points: Vec::new(),
            curves: Vec::new(),
        };
        let square = [[2.0, -2.0], [-2.0, 2.0]];
        assert!(plot(["F_y", "F_x"], square, Some([1.6; 2])).has_equal_scales());
        assert!(plot(["a_y [m/s2]", "a_x [m/s^2]"], square, None).has_equal_scales());
        assert!(plot(["F_y / F_z [1]", "F_x / F_z [1]"], square, None).has_equal_scales());
        assert!(!plot(["a", "b"], square, None).has_equal_scales());
        assert!(!plot(["alpha [deg]", "F_y / F_z [1]"], square, None).has_equal_scales());
        assert!(!plot(["X [m]", "Y [m]"], [[0.0, 900.0], [0.0, 5.0]], None).has_equal_scales());
    }

    #[test]
    fn the_edges_of_a_round_track_are_circles_even_with_repeated_points() {
        let angles = (0..=360).map(|degree| f64::from(degree).to_radians());
        // Counter-clockwise: the left edge is inside.
        let center: Vec<_> = angles.flat_map(|a| [[100.0 * a.cos(), 100.0 * a.sin()]; 2]).collect();
        let [left, right] = road_edges(&center, &vec![[3.0, 4.0]; center.len()]);
        assert_eq!((left.len(), right.len()), (361, 361));
        for (edge, radius) in [(left, 97.0), (right, 104.0)] {
            for [x, y] in edge {
                assert!((x.hypot(y) - radius).abs() < 1e-3, "{x} {y}");
            }
        }
        assert!(road_edges(&[[1.0, 1.0]; 3], &[[1.0; 2]; 3])[0].is_empty());
    }
}
