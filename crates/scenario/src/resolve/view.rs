//! Resolves `[view]` to the layout of the replay, by columns of the recording.

use std::collections::HashSet;

use assessment::{CheckCondition, CheckPlan};
use cosim::system::{CouplingPlan, NodePlan};
use diagnostics::{Error, ErrorCollector, Spanned};
use manoeuvre::Channel;
use recording::table::{TableError, read_untimed_columns};
use recording::view::{
    BodyArrow, DistanceSource, GraphNode, NodeGraph, PlotLimit, PoseColumns, ReplayView, RowQuantity,
    TrackEdges, XyPlot, XyPlotFunction, XyPlotPoint, road_edges,
};
use recording::{
    Column, Columns, NumberIndex, RecordedSelection, RecordedVariables, RunHeader, VariableDirection,
};

use super::plots::{MOST_SIGNALS, plots_by_unit, resolve_plot};
use super::quantity::SignalScope;
use super::record::check_variable_patterns;
use super::signal_units::SignalUnits;
use crate::document::{self, Scenario};
use crate::pattern::matches_wildcard;

/// A graph of more nodes shows nothing.
const MOST_NODES: usize = 100;
/// The usual name of the road-wheel angle of a car.
const STEER: &str = "delta";
/// Default positions of the axles ahead of the position, in lengths of the body.
const AXLES: [f64; 2] = [0.30, -0.29];

/// The layout that the scenario of a recording asks for.
///
/// # Errors
/// All that does not fit, with its places in the file.
pub fn replay_layout(scenario: &Scenario, header: &RunHeader) -> Result<ReplayView, Error> {
    resolve_view(scenario, header, &SignalUnits::from_recorded_columns(&header.columns))
}

/// The layout that the scenario asks for; without plots there is one for each unit of each node.
///
/// # Errors
/// All that does not fit, with its places in the file.
pub(super) fn resolve_view(
    scenario: &Scenario,
    header: &RunHeader,
    units: &SignalUnits,
) -> Result<ReplayView, Error> {
    let written = &scenario.document.view;
    let scope = &SignalScope::new(scenario, &header.columns, units);
    let mut mistakes = ErrorCollector::default();
    let pose = written.pose.as_ref().map(|it| resolve_pose(scope, it)).transpose();
    // The path of a pose that is wrong cannot be followed, and the pose is what is told.
    let along = pose.as_ref().ok().and_then(Option::as_ref);
    let distance = mistakes.ok_or_record(resolve_distance(scope, written, along));
    let pose = mistakes.ok_or_record(pose);
    let track = written.track.as_ref().map(|it| resolve_track(scenario, scope, it)).transpose();
    let track = mistakes.ok_or_record(track);
    let arrows = mistakes
        .ok_or_record(ErrorCollector::collect_all(written.arrow.iter().map(|it| resolve_arrow(scope, it))));
    let xy_plots = written.xy_plot.iter().map(|it| xy_plot(scope, it));
    let xy_plots = mistakes.ok_or_record(ErrorCollector::collect_all(xy_plots));
    let plots = written.plot.iter().map(|it| resolve_plot(scenario, scope, it));
    let plots = mistakes.ok_or_record(ErrorCollector::collect_all(plots)).unwrap_or_default();
    mistakes.into_result()?;
    let patterns = written.signals.as_deref();
    check_variable_patterns(scenario, &header.columns, patterns.unwrap_or_default())?;
    let mut view = ReplayView {
        distance: distance.flatten(),
        pose: pose.flatten(),
        track: track.flatten(),
        arrows: arrows.unwrap_or_default(),
        xy_plots: xy_plots.unwrap_or_default(),
        plots: if plots.is_empty() { plots_by_unit(header.columns.number_columns()) } else { plots },
        ..ReplayView::default()
    };
    view.add_signals(view.shown_columns());
    view.add_signals(signals_outside_plots(patterns, &header.columns));
    Ok(view)
}

/// The layout of a run without a scenario: a plot for each unit of each node.
#[must_use]
pub fn layout_by_unit(columns: &Columns<RecordedVariables>) -> ReplayView {
    let mut view = ReplayView { plots: plots_by_unit(columns.number_columns()), ..ReplayView::default() };
    view.add_signals(view.shown_columns());
    view.add_signals(signals_outside_plots(None, columns));
    view
}

/// The signals that have curves, in plots or not: those that patterns name; without patterns all of a run that is not wide.
fn signals_outside_plots(
    patterns: Option<&[Spanned<String>]>,
    columns: &Columns<RecordedVariables>,
) -> Vec<NumberIndex<RecordedVariables>> {
    let is_narrow = columns.number_columns().len() <= MOST_SIGNALS;
    let is_named = |column: &Column| match patterns {
        Some(patterns) => {
            let name = column.qualified_name();
            patterns.iter().any(|pattern| matches_wildcard(pattern.get_ref(), &name))
        }
        None => is_narrow,
    };
    let named = columns.number_columns().filter(|(_, column)| is_named(column));
    named.map(|(index, _)| index).collect()
}

/// The pose of the only node whose outputs have the usual names and units of a position and a heading on the ground, `X`, `Y` and `psi`: what
/// can be shown of a body without `[view.pose]`. None where no node or several have them.
#[must_use]
pub fn usual_pose(columns: &Columns<RecordedVariables>) -> Option<PoseColumns> {
    let outputs = || columns.number_columns().filter(|(_, it)| it.direction == VariableDirection::Output);
    let find = |node: &str, channel: Channel| {
        let fits = |it: &Column| {
            it.node == node
                && it.variable == channel.variable_name()
                && it.unit.as_deref().is_none_or(|unit| unit == channel.unit_name())
        };
        outputs().find(|(_, column)| fits(column)).map(|(index, _)| index)
    };
    let mut bodies = outputs()
        .filter(|(_, column)| column.variable == Channel::Heading.variable_name())
        .filter_map(|(_, column)| {
            let [x, y, heading] = Channel::POSE.map(|channel| find(&column.node, channel));
            Some((column.node.as_str(), x?, y?, heading?))
        });
    let (node, x, y, heading) = bodies.next()?;
    let steer = columns.number_columns().find(|(_, column)| {
        column.node == node && column.variable == STEER && column.unit.as_deref() == Some("rad")
    });
    let length = document::Pose::DEFAULT_LENGTH;
    bodies.next().is_none().then(|| PoseColumns {
        x,
        y,
        heading,
        steer: steer.map(|(index, _)| index),
        speed: find(node, Channel::ForwardSpeed),
        length,
        width: document::Pose::DEFAULT_WIDTH,
        axles: AXLES.map(|share| share * length),
    })
}

/// Adds the signals of checks to those with curves, and the constants that checks compare them with.
pub fn add_checks(view: &mut ReplayView, checks: &[CheckPlan], recorded: &RecordedSelection) {
    view.limits = limits_from_checks(checks, recorded);
    let conditions = checks.iter().filter_map(|check| match &check.condition {
        CheckCondition::Run(condition) => Some(condition),
        CheckCondition::Results(..) => None,
    });
    let signals = conditions.flat_map(|it| it.number_indices());
    view.add_signals(signals.filter_map(|it| recorded.recorded_index(it)));
}

/// The constants that checks compare recorded signals with.
fn limits_from_checks(checks: &[CheckPlan], recorded: &RecordedSelection) -> Vec<PlotLimit> {
    let mut limits = Vec::new();
    let mut known = HashSet::new();
    for check in checks {
        let CheckCondition::Run(condition) = &check.condition else { continue };
        for bound in condition.signal_bounds() {
            let Some(column) = recorded.recorded_index(bound.of) else { continue };
            let limit = PlotLimit { column, value: bound.value, during: check.during };
            let [from, until] = limit.during;
            if known.insert((column.position(), [limit.value, from, until].map(f64::to_bits))) {
                limits.push(limit);
            }
        }
    }
    limits
}

fn resolve_pose(scope: &SignalScope, written: &document::Pose) -> Result<PoseColumns, Error> {
    let find = |word: &Spanned<String>| scope.find_number_column(word);
    let maybe = |word: &Option<Spanned<String>>| word.as_ref().map(find).transpose();
    let position = ErrorCollector::collect_both(find(&written.x), find(&written.y));
    let pose = ErrorCollector::collect_both(position, find(&written.heading));
    let motion = ErrorCollector::collect_both(maybe(&written.steer), maybe(&written.speed));
    let (((x, y), heading), (steer, speed)) = ErrorCollector::collect_both(pose, motion)?;
    Ok(PoseColumns {
        x,
        y,
        heading,
        steer,
        speed,
        length: written.length,
        width: written.width,
        axles: written.axles.unwrap_or(AXLES.map(|share| share * written.length)),
    })
}

/// The two coordinates of a point.
fn resolve_point(
    scope: &SignalScope,
    x: &Spanned<String>,
    y: &Spanned<String>,
) -> Result<[RowQuantity; 2], Error> {
    ErrorCollector::collect_both(scope.parse_quantity(x), scope.parse_quantity(y)).map(|(x, y)| [x, y])
}

fn resolve_distance(
    scope: &SignalScope,
    written: &document::View,
    pose: Option<&PoseColumns>,
) -> Result<Option<DistanceSource>, Error> {
    Ok(match (&written.distance, pose, &written.speed) {
        (Some(word), ..) => Some(DistanceSource::Given(scope.parse_quantity(word)?)),
        (None, Some(pose), _) => Some(DistanceSource::Along([pose.x, pose.y])),
        (None, None, Some(word)) => Some(DistanceSource::Driven(scope.parse_quantity(word)?)),
        (None, None, None) => None,
    })
}

fn resolve_track(
    scenario: &Scenario,
    scope: &SignalScope,
    written: &Spanned<document::Track>,
) -> Result<TrackEdges, Error> {
    let document::Track { path, left, right, center, half_width, widths, closed } = written.get_ref();
    let wrong = |message: &str| {
        let help = "write `left` and `right`, or `center` with `half_width`; or with `widths`, which are columns of the \
                    file that `path` names";
        scenario.error_at(written, message).with_help(help)
    };
    let sides = match (left, right, center) {
        (Some(left), Some(right), None) => Some([left, right]),
        (None, None, Some(_)) => None,
        _ => return Err(wrong("expected the two edges of the track, or its center")),
    };
    let quantities = |[x, y]: &[Spanned<String>; 2]| resolve_point(scope, x, y);
    match (path, sides, center, half_width, widths) {
        (None, Some([left, right]), _, None, None) => {
            let (left, right) = ErrorCollector::collect_both(quantities(left), quantities(right))?;
            Ok(TrackEdges::Sides([left, right]))
        }
        (None, None, Some(center), Some(half), None) => {
            Ok(TrackEdges::Center(quantities(center)?, [*half; 2]))
        }
        (Some(path), Some([left, right]), _, None, None) => {
            let [x_l, y_l, x_r, y_r] =
                read_point_columns(scenario, path, [&left[0], &left[1], &right[0], &right[1]])?;
            Ok(TrackEdges::Edges([(x_l, y_l), (x_r, y_r)].map(|(x, y)| {
                let mut edge: Vec<_> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
                edge.extend(edge.first().copied().filter(|_| *closed));
                edge
            })))
        }
        (Some(path), None, Some([x, y]), half, widths) if half.is_some() != widths.is_some() => {
            let [x, y, left, right] = match widths {
                Some([left, right]) => read_point_columns(scenario, path, [x, y, left, right])?,
                None => {
                    let [x, y] = read_point_columns(scenario, path, [x, y])?;
                    let half = vec![half.unwrap_or_default(); x.len()];
                    [x, y, half.clone(), half]
                }
            };
            let mut center: Vec<_> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
            let mut widths: Vec<_> = left.into_iter().zip(right).map(|(l, r)| [l, r]).collect();
            center.extend(center.first().copied().filter(|_| *closed));
            widths.extend(widths.first().copied().filter(|_| *closed));
            Ok(TrackEdges::Edges(road_edges(&center, &widths)))
        }
        _ => Err(wrong("the track has more or less than it needs")),
    }
}

/// Columns of a file of points; what it lacks is pointed at.
fn read_point_columns<const N: usize>(
    scenario: &Scenario,
    path: &Spanned<String>,
    wanted: [&Spanned<String>; N],
) -> Result<[Vec<f64>; N], Error> {
    let names = wanted.map(|word| word.get_ref().as_str());
    let file = scenario.source.resolve_path(path);
    let kept = scenario.source.attached_text(&file);
    let read = read_untimed_columns(&file, kept, &names).map_err(|error: TableError| {
        let at = wanted.into_iter().find(|word| Some(word.get_ref().as_str()) == error.offending_word());
        scenario.error_at(at.unwrap_or(path), error.to_string())
    })?;
    let mut read = read.into_iter();
    Ok(std::array::from_fn(|_| read.next().unwrap_or_default()))
}

fn resolve_arrow(scope: &SignalScope, written: &document::Arrow) -> Result<BodyArrow, Error> {
    let quantity =
        |word: &Option<Spanned<String>>| word.as_ref().map(|word| scope.parse_quantity(word)).transpose();
    let scale = match *written.scale.get_ref() {
        scale if scale.is_finite() && scale != 0.0 => Ok(scale),
        scale => Err(scope.error_at(&written.scale, format!("expected a length in m, found {scale}"))),
    };
    let vector = ErrorCollector::collect_both(quantity(&written.x), quantity(&written.y));
    let rest = ErrorCollector::collect_both(quantity(&written.turn), scale);
    let ((x, y), (turn, scale)) = ErrorCollector::collect_both(vector, rest)?;
    let document::Arrow { label, role, at, .. } = written;
    Ok(BodyArrow { label: label.clone(), role: *role, at: *at, vector: [x, y], turn, scale })
}

fn xy_plot(scope: &SignalScope, written: &document::XyPlot) -> Result<XyPlot, Error> {
    let axes = [&written.x, &written.y];
    let ranges = axes.map(|axis| match *axis.range.get_ref() {
        [from, to] if from.is_finite() && to.is_finite() && from != to => Ok(()),
        [from, to] => {
            let message = format!("expected two different ends of an axis, found {from} and {to}");
            Err(scope.error_at(&axis.range, message))
        }
    });
    let points = ErrorCollector::collect_all(written.points.iter().map(|it| {
        let coordinates = resolve_point(scope, &it.x, &it.y)?;
        Ok(XyPlotPoint { label: it.label.clone(), role: it.role, coordinates })
    }));
    let curves = ErrorCollector::collect_all(written.curves.iter().map(|it| {
        let (y, moves) = scope.parse_function(&it.y)?;
        Ok(XyPlotFunction { label: it.label.clone(), role: it.role, y, moves })
    }));
    let ellipse = match &written.ellipse {
        Some(axes) if written.circle.is_some() => {
            Err(scope.error_at(axes, "expected `circle` or `ellipse`, found both".to_owned()))
        }
        Some(axes) if !axes.get_ref().iter().all(|it| it.is_finite() && *it > 0.0) => {
            let [x, y] = axes.get_ref();
            let message = format!("expected two positive half axes, found {x} and {y}");
            Err(scope.error_at(axes, message))
        }
        axes => Ok(axes.as_ref().map(|axes| *axes.get_ref()).or(written.circle.map(|it| [it; 2]))),
    };
    let shown = ErrorCollector::collect_both(points, curves);
    let (_, (ellipse, (points, curves))) = ErrorCollector::collect_both(
        ErrorCollector::collect_all(ranges),
        ErrorCollector::collect_both(ellipse, shown),
    )?;
    Ok(XyPlot {
        title: written.title.clone(),
        labels: axes.map(|axis| axis.label.clone()),
        ranges: axes.map(|axis| *axis.range.get_ref()),
        ellipse,
        trail: written.trail,
        points,
        curves,
    })
}

/// The nodes and their connections; empty for a single node, and where nobody could read it.
pub(super) fn node_graph(nodes: &[NodePlan], order: &[usize], coupling: &CouplingPlan) -> NodeGraph {
    if !(2..=MOST_NODES).contains(&nodes.len()) {
        return NodeGraph::default();
    }
    let is_looped = |node: usize| coupling.loops.iter().any(|it| it.nodes.contains(&node));
    let named = |node: &usize| {
        let name = nodes[*node].name.clone();
        GraphNode { name, is_looped: is_looped(*node) }
    };
    let rank = |node: usize| order.iter().position(|it| *it == node);
    let mut edges = Vec::new();
    for (to, plan) in nodes.iter().enumerate() {
        let sources = plan.connected_sources(nodes);
        edges.extend(sources.filter_map(|(from, _)| rank(from).zip(rank(to))));
    }
    edges.sort_unstable();
    edges.dedup();
    NodeGraph { nodes: order.iter().map(named).collect(), edges }
}
