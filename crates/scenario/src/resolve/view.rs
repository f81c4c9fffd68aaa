//! Resolves `[view]` to the layout of the replay, by columns of the recording.

use assessment::{CheckPlan, Condition};
use cosim::system::{CouplingPlan, NodePlan};
use diagnostics::{Error, Mistakes, Spanned};
use recording::table::{TableError, columns};
use recording::view::{
    Arrow, Distance, Function, Graph, GraphNode, Limit, Point, Pose, Quantity, Track, View, XyPlot,
    edges,
};
use recording::{RunHeader, Selection};

use super::plots::{plot, plots_by_unit};
use super::quantity::SignalScope;
use super::signal_units::SignalUnits;
use crate::document::{self, Scenario};

/// A graph of more nodes shows nothing.
const MOST_NODES: usize = 100;
/// Default positions of the axles ahead of the position, in lengths of the body.
const AXLES: [f64; 2] = [0.30, -0.29];

/// The layout that the scenario of a recording asks for.
///
/// # Errors
/// All that does not fit, with its places in the file.
pub fn replay_layout(scenario: &Scenario, header: &RunHeader) -> Result<View, Error> {
    view(scenario, header, &SignalUnits::of_recording(&header.columns))
}

/// The layout that the scenario asks for; without plots there is one for each unit of each node.
///
/// # Errors
/// All that does not fit, with its places in the file.
pub(super) fn view(
    scenario: &Scenario,
    header: &RunHeader,
    units: &SignalUnits,
) -> Result<View, Error> {
    let written = &scenario.document.view;
    let scope = &SignalScope::new(scenario, &header.columns, units);
    let mut mistakes = Mistakes::default();
    let pose = written.pose.as_ref().map(|it| pose(scope, it)).transpose();
    // The path of a pose that is wrong cannot be followed, and the pose is what is told.
    let along = pose.as_ref().ok().and_then(Option::as_ref);
    let distance = mistakes.take(distance(scope, written, along));
    let pose = mistakes.take(pose);
    let track = written.track.as_ref().map(|it| track(scenario, scope, it)).transpose();
    let track = mistakes.take(track);
    let arrows = mistakes.take(Mistakes::all(written.arrow.iter().map(|it| arrow(scope, it))));
    let xy_plots = written.xy_plot.iter().map(|it| xy_plot(scope, it));
    let xy_plots = mistakes.take(Mistakes::all(xy_plots));
    let plots = written.plot.iter().map(|it| plot(scenario, scope, it));
    let plots = mistakes.take(Mistakes::all(plots)).unwrap_or_default();
    mistakes.finish()?;
    Ok(View {
        distance: distance.flatten(),
        pose: pose.flatten(),
        track: track.flatten(),
        arrows: arrows.unwrap_or_default(),
        xy_plots: xy_plots.unwrap_or_default(),
        plots: if plots.is_empty() { plots_by_unit(header.columns.numbers()) } else { plots },
        limits: Vec::new(),
        graph: Graph::default(),
    })
}

/// The constants that checks compare recorded signals with.
pub fn limits(checks: &[CheckPlan], recorded: &Selection) -> Vec<Limit> {
    let mut limits = Vec::new();
    for check in checks {
        let Condition::Run(condition) = &check.condition else { continue };
        for bound in condition.bounds() {
            let Some(column) = recorded.recorded(bound.of) else { continue };
            let limit = Limit { column, value: bound.value, during: check.during };
            if !limits.contains(&limit) {
                limits.push(limit);
            }
        }
    }
    limits
}

fn pose(scope: &SignalScope, written: &document::Pose) -> Result<Pose, Error> {
    let find = |word: &Spanned<String>| scope.column(word);
    let maybe = |word: &Option<Spanned<String>>| word.as_ref().map(find).transpose();
    let position = Mistakes::both(find(&written.x), find(&written.y));
    let pose = Mistakes::both(position, find(&written.heading));
    let motion = Mistakes::both(maybe(&written.steer), maybe(&written.speed));
    let (((x, y), heading), (steer, speed)) = Mistakes::both(pose, motion)?;
    Ok(Pose {
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
fn point(
    scope: &SignalScope,
    x: &Spanned<String>,
    y: &Spanned<String>,
) -> Result<[Quantity; 2], Error> {
    Mistakes::both(scope.quantity(x), scope.quantity(y)).map(|(x, y)| [x, y])
}

fn distance(
    scope: &SignalScope,
    written: &document::View,
    pose: Option<&Pose>,
) -> Result<Option<Distance>, Error> {
    Ok(match (&written.distance, pose, &written.speed) {
        (Some(word), ..) => Some(Distance::Given(scope.quantity(word)?)),
        (None, Some(pose), _) => Some(Distance::Along([pose.x, pose.y])),
        (None, None, Some(word)) => Some(Distance::Driven(scope.quantity(word)?)),
        (None, None, None) => None,
    })
}

fn track(
    scenario: &Scenario,
    scope: &SignalScope,
    written: &Spanned<document::Track>,
) -> Result<Track, Error> {
    let document::Track { path, left, right, center, half_width, widths, closed } =
        written.get_ref();
    let wrong = |message: &str| {
        let help = "write `left` and `right`, or `center` with `half_width`; or with `widths`, which are columns of the \
                    file that `path` names";
        scenario.error(written, message).help(help)
    };
    let sides = match (left, right, center) {
        (Some(left), Some(right), None) => Some([left, right]),
        (None, None, Some(_)) => None,
        _ => return Err(wrong("expected the two edges of the track, or its center")),
    };
    let quantities = |[x, y]: &[Spanned<String>; 2]| point(scope, x, y);
    match (path, sides, center, half_width, widths) {
        (None, Some([left, right]), _, None, None) => {
            let (left, right) = Mistakes::both(quantities(left), quantities(right))?;
            Ok(Track::Sides([left, right]))
        }
        (None, None, Some(center), Some(half), None) => {
            Ok(Track::Center(quantities(center)?, [*half; 2]))
        }
        (Some(path), Some([left, right]), _, None, None) => {
            let [x_l, y_l, x_r, y_r] =
                read(scenario, path, [&left[0], &left[1], &right[0], &right[1]])?;
            Ok(Track::Edges([(x_l, y_l), (x_r, y_r)].map(|(x, y)| {
                let mut edge: Vec<_> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
                edge.extend(edge.first().copied().filter(|_| *closed));
                edge
            })))
        }
        (Some(path), None, Some([x, y]), half, widths) if half.is_some() != widths.is_some() => {
            let [x, y, left, right] = match widths {
                Some([left, right]) => read(scenario, path, [x, y, left, right])?,
                None => {
                    let [x, y] = read(scenario, path, [x, y])?;
                    let half = vec![half.unwrap_or_default(); x.len()];
                    [x, y, half.clone(), half]
                }
            };
            let mut center: Vec<_> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
            let mut widths: Vec<_> = left.into_iter().zip(right).map(|(l, r)| [l, r]).collect();
            center.extend(center.first().copied().filter(|_| *closed));
            widths.extend(widths.first().copied().filter(|_| *closed));
            Ok(Track::Edges(edges(&center, &widths)))
        }
        _ => Err(wrong("the track has more or less than it needs")),
    }
}

/// Columns of a file of points; what it lacks is pointed at.
fn read<const N: usize>(
    scenario: &Scenario,
    path: &Spanned<String>,
    wanted: [&Spanned<String>; N],
) -> Result<[Vec<f64>; N], Error> {
    let names = wanted.map(|word| word.get_ref().as_str());
    let file = scenario.source.resolve(path);
    let kept = scenario.source.attached(&file);
    let read = columns(&file, kept, &names).map_err(|error: TableError| {
        let at = wanted.into_iter().find(|word| Some(word.get_ref().as_str()) == error.word());
        scenario.error(at.unwrap_or(path), error.to_string())
    })?;
    let mut read = read.into_iter();
    Ok(std::array::from_fn(|_| read.next().unwrap_or_default()))
}

fn arrow(scope: &SignalScope, written: &document::Arrow) -> Result<Arrow, Error> {
    let quantity =
        |word: &Option<Spanned<String>>| word.as_ref().map(|word| scope.quantity(word)).transpose();
    let scale = match *written.scale.get_ref() {
        scale if scale.is_finite() && scale != 0.0 => Ok(scale),
        scale => Err(scope.error(&written.scale, format!("expected a length in m, found {scale}"))),
    };
    let vector = Mistakes::both(quantity(&written.x), quantity(&written.y));
    let rest = Mistakes::both(quantity(&written.turn), scale);
    let ((x, y), (turn, scale)) = Mistakes::both(vector, rest)?;
    let document::Arrow { label, role, at, .. } = written;
    Ok(Arrow { label: label.clone(), role: *role, at: *at, vector: [x, y], turn, scale })
}

fn xy_plot(scope: &SignalScope, written: &document::XyPlot) -> Result<XyPlot, Error> {
    let axes = [&written.x, &written.y];
    let ranges = axes.map(|axis| match *axis.range.get_ref() {
        [from, to] if from.is_finite() && to.is_finite() && from != to => Ok(()),
        [from, to] => {
            let message = format!("expected two different ends of an axis, found {from} and {to}");
            Err(scope.error(&axis.range, message))
        }
    });
    let points = Mistakes::all(written.points.iter().map(|it| {
        let coordinates = point(scope, &it.x, &it.y)?;
        Ok(Point { label: it.label.clone(), role: it.role, coordinates })
    }));
    let curves = Mistakes::all(written.curves.iter().map(|it| {
        let (y, moves) = scope.function(&it.y)?;
        Ok(Function { label: it.label.clone(), role: it.role, y, moves })
    }));
    let ellipse = match &written.ellipse {
        Some(axes) if written.circle.is_some() => {
            Err(scope.error(axes, "expected `circle` or `ellipse`, found both".to_owned()))
        }
        Some(axes) if !axes.get_ref().iter().all(|it| it.is_finite() && *it > 0.0) => {
            let [x, y] = axes.get_ref();
            let message = format!("expected two positive half axes, found {x} and {y}");
            Err(scope.error(axes, message))
        }
        axes => Ok(axes.as_ref().map(|axes| *axes.get_ref()).or(written.circle.map(|it| [it; 2]))),
    };
    let shown = Mistakes::both(points, curves);
    let (_, (ellipse, (points, curves))) =
        Mistakes::both(Mistakes::all(ranges), Mistakes::both(ellipse, shown))?;
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
pub(super) fn graph(nodes: &[NodePlan], order: &[usize], coupling: &CouplingPlan) -> Graph {
    if !(2..=MOST_NODES).contains(&nodes.len()) {
        return Graph::default();
    }
    let is_looped = |node: usize| coupling.loops.iter().any(|it| it.nodes.contains(&node));
    let named = |node: &usize| {
        let name = nodes[*node].name.clone();
        GraphNode { name, is_looped: is_looped(*node) }
    };
    let rank = |node: usize| order.iter().position(|it| *it == node);
    let mut edges = Vec::new();
    for (to, plan) in nodes.iter().enumerate() {
        let numbers = plan.connections.iter().map(|link| link.source.index);
        let givers = numbers.filter_map(|source| {
            nodes.iter().position(|it| it.outputs.positions().contains(&source.position()))
        });
        let texts = plan.texts.connections.iter().map(|source| source.index);
        let speakers = texts.filter_map(|source| {
            nodes.iter().position(|it| it.texts.outputs.positions().contains(&source.position()))
        });
        edges.extend(givers.chain(speakers).filter_map(|from| rank(from).zip(rank(to))));
    }
    edges.sort_unstable();
    edges.dedup();
    Graph { nodes: order.iter().map(named).collect(), edges }
}
